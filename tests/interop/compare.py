#!/usr/bin/env python3
"""compare.py EXPECTED.csv FOUND.csv TOLERANCE_M LABEL: are two tellings of joint positions one?

Both have the columns frame,time_s,joint,x,y,z, in any order of rows, or are tables of laban's own:
a comment line, then time_s,JOINT_x_m,JOINT_y_m,JOINT_z_m,.. with a row for every frame. Prints one
line; exits 1 if they name other frames, times or joints, or if a joint is further off than the
tolerance. Names are taken as a BVH of laban's spells them: what is no letter, digit or underscore
is an underscore.
"""

import csv
import math
import re
import sys

from forward_kinematics import sample_frames

TIME_TOLERANCE_S = 1e-5  # float32 seconds of a clip of a minute or two


def plain(name):
    return re.sub(r"[^A-Za-z0-9_]", "_", name)


def tidy_table(rows):
    return {
        (int(row["frame"]), plain(row["joint"])): [float(row[key]) for key in ("time_s", *"xyz")]
        for row in rows
    }


def laban_table(rows):
    joints = [key.removesuffix("_x_m") for key in rows[0] if key.endswith("_x_m")]
    return {
        (frame, plain(joint)): [
            float(rows[frame][key])
            for key in ("time_s", f"{joint}_x_m", f"{joint}_y_m", f"{joint}_z_m")
        ]
        for frame in sample_frames(len(rows))
        for joint in joints
    }


def read(path):
    try:
        with open(path, newline="", encoding="utf-8") as file:
            lines = file.readlines()
    except FileNotFoundError:
        sys.exit(f"BAD  {path}: was not written")
    is_ours = lines[:1] != [] and lines[0].startswith("#")
    rows = list(csv.DictReader(lines[1:] if is_ours else lines))
    if not rows:
        sys.exit(f"BAD  {path}: has no rows")
    table = laban_table(rows) if is_ours else tidy_table(rows)
    if not is_ours and len(table) != len(rows):
        sys.exit(f"BAD  {path}: tells a joint twice at one frame")
    return table


def difference(expected, found):
    """What is wrong, or the largest distance and where it is."""
    for what, index in (("frame", 0), ("joint", 1)):
        wanted, told = ({str(key[index]) for key in table} for table in (expected, found))
        if wanted != told:
            missing, extra = sorted(wanted - told)[:5], sorted(told - wanted)[:5]
            return f"{what}s differ: {missing} missing, {extra} unexpected", math.inf
    if expected.keys() != found.keys():
        return "a joint is missing at some frame", math.inf
    for key, (time_s, *_) in expected.items():
        if not abs(found[key][0] - time_s) <= TIME_TOLERANCE_S:
            return f"frame {key[0]} is at {found[key][0]:.6f} s, not at {time_s:.6f} s", math.inf
    distances = {key: math.dist(expected[key][1:], found[key][1:]) for key in expected}
    # A NaN loses every comparison, so it is looked for.
    frame, joint = max(distances, key=lambda key: (math.isnan(distances[key]), distances[key]))
    count = len({joint for _, joint in expected})
    last = max(frame for frame, _ in expected)
    return (
        f"{count} joints, frames 0 to {last}: "
        f"largest difference {distances[frame, joint]:.1e} m ({joint}, frame {frame})",
        distances[frame, joint],
    )


def main():
    expected_path, found_path, tolerance_m, label = sys.argv[1:]
    text, largest_m = difference(read(expected_path), read(found_path))
    good = largest_m <= float(tolerance_m)
    print(f"{'ok  ' if good else 'BAD '} {label}: {text}, allowed {tolerance_m} m", flush=True)
    sys.exit(not good)


if __name__ == "__main__":
    main()
