#!/usr/bin/env python3
"""Holds code compiled for a newer machine apart: an object of another instruction set defines no weak symbol.

A template or inline function that is compiled at two levels has one name, and the linker may keep the copy
that an older machine cannot run. So such an object may define local symbols and its kernel table only, and
none that another object of the library defines too.
Usage: check_kernel_symbols.py NM LIBRARY; prints one line a violation and exits 1 if there is any.
"""
import subprocess
import sys

NEWER = "_kernels_v3"  # part of the object's name


def defined_symbols(nm, library):
    """{object: {symbol: nm's letter}} of what other objects can see."""
    text = subprocess.run([nm, "--defined-only", "--extern-only", library], check=True, capture_output=True, text=True)
    objects = {}
    symbols = {}
    for line in text.stdout.splitlines():
        fields = line.split()
        if line.endswith(":"):
            symbols = objects.setdefault(line[:-1], {})
        elif len(fields) == 3:
            symbols[fields[2]] = fields[1]
    return objects


def problems(objects):
    newer = {name: symbols for name, symbols in objects.items() if NEWER in name}
    if not newer:
        yield f"no object named {NEWER}"
    for name, symbols in newer.items():
        for symbol, letter in symbols.items():
            if symbol.startswith(("_ZTS", "_ZTI")):
                continue  # a type's name, which sanitizers write down: no code
            if letter in "WVu":
                yield f"{name}: {symbol} is a template's or an inline function's"
            for other, others in objects.items():
                if other not in newer and symbol in others:
                    yield f"{name}: {symbol} is defined by {other} too"
        if not symbols:
            yield f"{name}: defines nothing"


def main():
    found = list(problems(defined_symbols(sys.argv[1], sys.argv[2])))
    print("\n".join(found))
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
