#!/usr/bin/env python3
"""Runs every `laban ...` line of README's code blocks, in order, in a fresh folder.

Usage: readme_commands.py README LABAN_PROGRAM SOURCE_DIR WORK_DIR
`data` and `labels` of the project and, as `captures`, the embedded corpus are linked into the folder. The
one command that must fail (training on a sheet that is still blank) is expected to say so.
"""
import pathlib
import re
import shutil
import subprocess
import sys


def main():
    readme, program, source, work = (pathlib.Path(argument).resolve() for argument in sys.argv[1:5])
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    for name, target in (("data", "data"), ("labels", "labels"), ("captures", "data/phrase")):
        (work / name).symlink_to(source / target)
    commands = re.findall(r"^ {4,}laban (.+?)(?: {2,}#.*)?$", readme.read_text(), re.MULTILINE)
    if len(commands) < 8:
        print(f"only {len(commands)} commands found in {readme}")
        return 1
    for command in commands:
        result = subprocess.run(f"'{program}' {command}", shell=True, cwd=work, capture_output=True, text=True)
        blank = "sheet.csv -o mine.laban" in command
        if (result.returncode != 0) != blank or (blank and "still blank" not in result.stderr):
            print(f"laban {command}\nexit code {result.returncode}\n{result.stderr}")
            return 1
        print(f"ok: laban {command}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
