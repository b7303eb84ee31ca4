#!/usr/bin/env python3
"""Every verb's --json, and every kind of it, is what tools/laban/output.schema.json says.

Usage: json_output.py LABAN_PROGRAM SCHEMA SOURCE_DIR WORK_DIR
"""
import csv
import io
import json
import pathlib
import shutil
import subprocess
import sys

import jsonschema


def rated_by_three(table, folder):
    """A label table of one observer as if three had filled it in: one on the spot, one higher and less sure, one
    who saw the first twenty rows only and those twice."""
    head, *rows = csv.reader(io.StringIO(table))
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow([*head, "repeat"])
    for n, row in enumerate(rows):
        cells = dict(zip(head, row))
        if cells["clip"]:
            cells["clip"] = str(folder / cells["clip"])
        for observer, shift, confidence, repeat in (("ann", 0, "", ""), ("bob", 0.25, 0.5, ""), ("cat", -0.5, 0, ""),
                                                    ("cat", -0.5, "", 1), ("cat", -0.25, "", 2)):
            if observer == "cat" and n >= 20:
                continue
            said = {f: round(min(3, max(-3, float(cells[f]) + shift)), 3) for f in ("flow", "weight", "time")}
            writer.writerow(({**cells, **said, "observer": observer, "source": "expert", "confidence": confidence}
                             | {"repeat": repeat})[h] for h in (*head, "repeat"))
    return out.getvalue()


def main():
    program, schema_path, source, work = (pathlib.Path(argument).resolve() for argument in sys.argv[1:5])
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    take, phrase, labels = source / "data/take.bvh", source / "data/phrase", source / "labels/phrase.csv"
    walk, other = phrase / "phrase_walk_p01.bvh", phrase / "phrase_walk_p02.bvh"
    model = program.parent / "phrase.laban"
    (work / "raters.csv").write_text(rated_by_three(labels.read_text(), labels.parent))
    commands = [
        "agree --labels raters.csv --bootstrap 200",
        f"apply {take} --time 1 -o styled.bvh --report report.json",
        f"apply {walk} --flow 1 -o walk.glb",
        f"apply {walk} --time +1 --way 3 --detail residual -o residual.bvh",
        f"apply {walk} {other} --weight 1 --output-dir styled",
        f"blend {walk} {other} --alpha 0.5 -o blend.bvh",
        f"convert {take} -o take.glb",
        f"corpus --clips {phrase} --pattern phrase_{{content}}_{{performer}} --blends 5 --label measured -o corpus.csv",
        f"corpus --clips {phrase} --pattern phrase_{{content}}_{{performer}} --blends 5 --label none -o blank.csv",
        "curve",
        f"draw {take} -o take.png",
        f"draw {take} --animate take.html",
        f"evaluate --labels {labels} --runs 2",
        f"evaluate --labels {labels} --protocol leave-performer-out --models linear-ridge,residual-kernel-ridge",
        f"evaluate --labels {labels} --protocol leave-content-out --models linear-ridge",
        f"evaluate --labels {labels} --closed-loop 2",
        f"inspect {take}",
        "inspect blank.csv",
        f"inspect {model}",
        f"loop synthesize {walk} --frames 300 -o loop.bvh",
        f"loop synthesize {walk} --seamless -o seamless.bvh",
        f"loop join {walk} {other} -o joined.bvh",
        f"loop turns {walk}",
        f"manifold learn {walk} -o walk.manifold --epochs 5 --size 30",
        f"manifold synthesize walk.manifold --start {walk}:0 --seconds 2 -o walked.bvh",
        "inspect walk.manifold",
        f"texture learn {walk} {other} -o walk.texture --min-frames 20 --threshold 0.1",
        "texture inspect walk.texture",
        "inspect walk.texture",
        "texture fragments walk.texture --labels fragments.csv",
        "texture synthesize walk.texture --seconds 5 -o textured.bvh",
        "texture path walk.texture 0 0 --length 1",
        f"texture edit walk.texture --texton 0 --pin 10:{walk}:10 --stretch 1.2 -o edited.bvh",
        f"match {walk} {other}",
        f"match {walk}",
        f"measure {walk} {take}",
        f"measure {walk} --against {walk}",
        f"segment {take}",
        f"suggest --labels {labels} --pool 20 --count 3",
        f"train --labels {labels} -o phrase.laban",
        "train --labels raters.csv -o each.laban --each-rater",
    ]
    schema = json.loads(schema_path.read_text())
    jsonschema.Draft7Validator.check_schema(schema)
    validator = jsonschema.Draft7Validator(schema)
    seen = set()
    for command in commands:
        result = subprocess.run([program, *command.split(), "--json"], cwd=work, capture_output=True, text=True)
        if result.returncode != 0:
            sys.exit(f"laban {command}\nexit code {result.returncode}\n{result.stderr}")
        output = json.loads(result.stdout)
        validator.validate(output)
        seen.add(output["schema"])
        print(f"ok: {output['schema']}: laban {command}")
    validator.validate(json.loads((work / "report.json").read_text()))
    known = {one["properties"]["schema"]["const"] for one in schema["definitions"].values()
             if "schema" in one.get("properties", {})}
    if known != seen:
        sys.exit(f"no command shows {known - seen}")
    broken = json.loads((work / "report.json").read_text())
    del broken["snippets"][0]["measured"]
    if validator.is_valid(broken):
        sys.exit("a report without its measured Effort passes")


if __name__ == "__main__":
    main()
