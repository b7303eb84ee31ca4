#!/usr/bin/env python3
"""Holds every #include to the module table: a module sees the modules it builds on, and theirs.

Also: public headers name std, Eigen and laban only; a file includes no other module's private headers.
Usage: check_includes.py SOURCE_DIR; prints one line a violation and exits 1 if there is any.
"""
import pathlib
import re
import sys

BUILDS_ON = {
    "base": [],
    "math": ["base"],
    "motion": ["math"],
    "io": ["motion"],
    "learn": ["math"],
    "align": ["motion"],
    "blend": ["align"],
    "effort": ["motion", "learn"],
    "transfer": ["blend", "effort"],
    "loop": ["motion"],
    "manifold": ["motion"],
    "texture": ["motion"],
    "draw": ["motion"],
}
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]', re.MULTILINE)


def visible(module):
    seen = {module}
    for below in BUILDS_ON[module]:
        seen |= visible(below)
    return seen


def check_file(path, module, public):
    allowed = visible(module)
    for quote, target in INCLUDE.findall(path.read_text()):
        parts = target.split("/")
        if parts[0] == "laban":
            if parts[1] not in allowed:
                yield f"{path}: module {module} may not see {target}"
        elif public and not (parts[0] == "Eigen" or (quote == "<" and "." not in target)):
            yield f"{path}: a public header may not include {target}"
        elif quote == '"' and parts[0] != module:
            yield f"{path}: {target} is not a private header of module {module} (\"{module}/..\")"


def main():
    root = pathlib.Path(sys.argv[1])
    problems = []
    for folder, public in ((root / "include/laban", True), (root / "src", False)):
        for path in sorted(p for p in folder.rglob("*") if p.suffix in (".h", ".cpp")):
            module = path.relative_to(folder).parts[0]
            if module not in BUILDS_ON:
                problems.append(f"{path}: module {module} is not in the table")
            else:
                problems += check_file(path, module, public)
    print("\n".join(problems))
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
