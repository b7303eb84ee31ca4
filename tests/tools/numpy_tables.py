#!/usr/bin/env python3
"""What `laban convert` writes as CSV and as NPY, read by numpy, is the same table.

Usage: numpy_tables.py LABAN_PROGRAM CLIP WORK_DIR
"""
import pathlib
import subprocess
import sys

import numpy


def read_both(program, clip, data, folder):
    for ending in ("csv", "npy"):
        subprocess.run([program, "convert", clip, "--data", data, "-q", "--force", "-o", folder / f"{data}.{ending}"],
                       check=True, stdout=subprocess.DEVNULL)
    with open(folder / f"{data}.csv", encoding="utf-8") as file:
        head = file.readline()
        text = numpy.genfromtxt(file, names=True, delimiter=",", deletechars="")
    return head, text, numpy.load(folder / f"{data}.npy")


def main():
    program, clip, folder = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
    folder.mkdir(parents=True, exist_ok=True)
    expected = {"positions": ("time_s", "hips_x_m"), "pose": ("time_s", "hips_x_rad"), "effort": ("time_s", "flow")}
    for data, names in expected.items():
        head, text, binary = read_both(program, clip, data, folder)
        assert "frame_rate_hz=60" in head, head
        assert binary.dtype.fields["time_s"][2] == "frame_rate_hz=60", binary.dtype
        assert binary.dtype.names[:2] == names, binary.dtype.names
        assert text.dtype.names == binary.dtype.names, text.dtype.names
        for name in binary.dtype.names:
            assert numpy.array_equal(text[name], binary[name]), name
        assert numpy.allclose(numpy.diff(binary["time_s"]), 1 / 60), "time does not run at 60 Hz"
        print(f"ok: {data}, {len(binary)} frames of {len(binary.dtype.names)} columns")


if __name__ == "__main__":
    main()
