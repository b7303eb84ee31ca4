"""Where Blender puts the joints of BVH and GLB files; run inside Blender:

    blender --factory-startup -b --python-exit-code 1 -P blender_positions.py -- OUT_DIR FILE...

Writes OUT_DIR/NAME.blender.csv for each FILE with the columns frame,time_s,joint,x,y,z (metres,
+Y up; a BVH is in centimetres), and at the end the line "blender_positions: N files", N of those
that it could read: the exit code tells nothing of an import that fails.
"""

import builtins
import os
import sys

import bpy
import numpy

SAMPLES = 25  # forward_kinematics.py picks the same frames
BVH_FIRST_FRAME = 1

# Debian 12's Blender 3.4.1 is older than its Python and numpy: its BVH importer opens files with
# 'rU' (gone in Python 3.11), its glTF importer says numpy.bool (gone in numpy 1.24).
plain_open = builtins.open
builtins.open = lambda file, mode="r", *rest, **named: plain_open(
    file, mode.replace("U", ""), *rest, **named
)
numpy.bool = bool


def load(path):
    """The armature, its key times in frames, the frame of time 0 and the frames of a second."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if path.endswith(".bvh"):
        bpy.ops.import_anim.bvh(
            filepath=path,
            global_scale=0.01,
            frame_start=BVH_FIRST_FRAME,
            update_scene_fps=True,
            axis_forward="-Z",
            axis_up="Y",
        )
        first = BVH_FIRST_FRAME
        rate = bpy.context.scene.render.fps / bpy.context.scene.render.fps_base
    else:
        bpy.ops.import_scene.gltf(filepath=path)
        first, rate = 0, bpy.context.scene.render.fps
    (armature,) = (thing for thing in bpy.data.objects if thing.type == "ARMATURE")
    keys = [point.co[0] for point in armature.animation_data.action.fcurves[0].keyframe_points]
    return armature, keys, first, rate


def rows_of(path):
    armature, keys, first, rate = load(path)
    yield "frame,time_s,joint,x,y,z\n"
    for frame in sorted({i * (len(keys) - 1) // (SAMPLES - 1) for i in range(SAMPLES)}):
        whole = int(keys[frame] // 1)
        bpy.context.scene.frame_set(whole, subframe=keys[frame] - whole)
        for bone in armature.pose.bones:
            x, y, z = armature.matrix_world @ bone.head
            time_s = (keys[frame] - first) / rate
            yield f"{frame},{time_s:.9f},{bone.name},{x:.9f},{z:.9f},{-y:.9f}\n"


out_dir, *paths = sys.argv[sys.argv.index("--") + 1 :]
told = 0
for path in paths:
    try:
        rows = list(rows_of(path))
    except Exception as error:  # the importers raise of every kind
        print(f"{path}: {error}".rstrip())
        continue
    with open(os.path.join(out_dir, os.path.basename(path) + ".blender.csv"), "w") as file:
        file.writelines(rows)
    told += 1
print(f"blender_positions: {told} files", flush=True)
