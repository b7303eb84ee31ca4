#!/usr/bin/env python3
"""forward_kinematics.py FILE.bvh METRES_PER_UNIT: where the joints of a BVH are.

The plain reference that other programs are held to: nothing of laban is in it. Position channels
stand in the OFFSET's place (three.js adds them to it: the same where the OFFSET is 0 0 0).
Prints frame,time_s,joint,x,y,z (metres) at evenly spread frames, the first and the last included.
"""

import math
import sys

SAMPLES = 25


def sample_frames(frame_count):
    """Every teller of positions picks frames so: a wrong frame count shows as a wrong last frame."""
    return sorted({i * (frame_count - 1) // (SAMPLES - 1) for i in range(SAMPLES)})


def turn(axis, degrees):
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return {
        "X": [[1, 0, 0], [0, c, -s], [0, s, c]],
        "Y": [[c, 0, s], [0, 1, 0], [-s, 0, c]],
        "Z": [[c, -s, 0], [s, c, 0], [0, 0, 1]],
    }[axis]


def product(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(3)) for j in range(3)] for i in range(3)]


def read_joints(words):
    """Joints in file order as dicts of name, parent, offset and channels; stops after MOTION."""
    joints, open_blocks = [], []
    for word in words:
        if word in ("ROOT", "JOINT"):
            name = " ".join(iter(lambda: next(words), "{"))  # it may hold spaces
            joints.append({"name": name, "parent": open_blocks[-1] if open_blocks else None})
            open_blocks.append(joints[-1])
        elif word == "{":
            open_blocks.append({})  # an end site: its OFFSET is nobody's
        elif word == "}":
            open_blocks.pop()
        elif word == "OFFSET":
            open_blocks[-1]["offset"] = [float(next(words)) for _ in range(3)]
        elif word == "CHANNELS":
            open_blocks[-1]["channels"] = [next(words) for _ in range(int(next(words)))]
        elif word == "MOTION":
            return joints
    raise ValueError("there is no MOTION")


def place(joints, row):
    """Positions of the joints, file units; a joint's parent comes before it."""
    values = iter(row)
    for joint in joints:
        position, rotation = list(joint["offset"]), turn("X", 0)
        for channel in joint["channels"]:
            value = next(values)
            if channel.endswith("position"):
                axis = "XYZ".index(channel[0])
                position[axis] = value
            else:
                rotation = product(rotation, turn(channel[0], value))
        parent = joint["parent"]
        if parent:
            frame, origin = parent["rotation"], parent["position"]
            position = [origin[i] + sum(frame[i][k] * position[k] for k in range(3)) for i in range(3)]
            rotation = product(frame, rotation)
        joint["position"], joint["rotation"] = position, rotation
    return [joint["position"] for joint in joints]


def main():
    path, unit_m = sys.argv[1], float(sys.argv[2])
    with open(path, encoding="utf-8") as file:
        words = iter(file.read().split())
    joints = read_joints(words)
    header = [next(words) for _ in range(5)]  # Frames: N Frame Time: T
    frame_count, frame_time_s = int(header[1]), float(header[4])
    # 0.0333333 stands for 1/30: the rate is whole, and the digits left out must not add up.
    if abs(round(1 / frame_time_s) * frame_time_s - 1) < 1e-4:
        frame_time_s = 1 / round(1 / frame_time_s)
    width = sum(len(joint["channels"]) for joint in joints)
    values = [float(word) for word in words]
    if len(values) != frame_count * width:
        raise ValueError(f"{len(values)} values are not {frame_count} rows of {width}")
    print("frame,time_s,joint,x,y,z")
    for frame in sample_frames(frame_count):
        positions = place(joints, values[frame * width : (frame + 1) * width])
        for joint, (x, y, z) in zip(joints, positions):
            xyz = f"{x * unit_m:.9f},{y * unit_m:.9f},{z * unit_m:.9f}"
            print(f"{frame},{frame * frame_time_s:.9f},{joint['name']},{xyz}")


if __name__ == "__main__":
    main()
