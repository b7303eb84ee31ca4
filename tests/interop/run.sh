#!/usr/bin/env bash
# Puts what the program writes before other people's programs:
#   tests/interop/run.sh BUILD_DIR
#
# Khronos validator   0 errors and 0 warnings on a GLB of every verb that writes one
# three.js            joints of our BVH and GLB where a plain forward kinematics of the BVH puts them,
#                     every animation track bound to a node
# Blender, assimp     the same joints, frames and times, at the same places
#
# The plain reference (forward_kinematics.py) has nothing of laban in it. What a machine lacks is
# skipped with a line that says so; tools/install_dependencies.sh --all brings it. Exits 1 if
# anything differs. LABAN_DATA=folder adds real captures.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
build=$(cd "$1" && pwd)
source=$(cd "$here/../.." && pwd)
laban=$build/tools/laban/laban
work=$build/interop

# Other programs keep float32: the furthest off that any joint was seen is 2e-6 m.
tolerance_m=1e-4
# What a BVH loses on the way through laban.
round_trip_m=1e-6
# 0.1 degrees at each of the six joints from the hips to the hand, which are 4.4 m off it in all.
compact_tolerance_m=1e-2

failures=0
cases=()
skipped() { echo "interop: skipped: $*" >&2; }
stage() { echo "-- interop: $* ($SECONDS s so far)"; }
# hold COMMAND..: what must succeed; the others are run all the same.
hold() { "$@" || failures=$((failures + 1)); }
compare() { hold python3 "$here/compare.py" "$@"; }

# tell NAME UNIT_M BVH: writes positions/NAME.csv
tell() { python3 "$here/forward_kinematics.py" "$3" "$2" >"positions/$1.csv"; }

# What the positions are not compared of, for the validator alone: compact keys, characters with a new
# animation, and what is special about glTF.
write_glb_alone() {
  local take=$source/data/take.bvh name
  "$laban" convert "$take" -o compact.glb --compact --force -q >/dev/null
  "$laban" convert "$take" --compact-tolerance 0.01 --no-mesh -o take_fine.glb --force -q >/dev/null
  "$laban" apply "$take" --time 2 --flow -1 --compact -o styled_compact.glb --force -q >/dev/null
  for name in minimal armature external step cubic_spline; do
    "$laban" convert "$source/tests/io/gltf/$name.gltf" -o "gltf_$name.glb" --force -q >/dev/null
    "$laban" convert "$source/tests/io/gltf/$name.gltf" --compact -o "gltf_${name}_compact.glb" --force -q >/dev/null
  done
  [[ -n "${LABAN_DATA:-}" ]] || return 0
  for name in "" --compact; do
    "$laban" apply "$LABAN_DATA/gltf/cesium_man.gltf" --map "$here/cesium_man_map.json" --time 2 $name \
      -o "cesium_man$name.glb" --force -q >/dev/null
  done
  for name in rigged_simple simple_skin; do
    "$laban" convert "$LABAN_DATA/gltf/$name.gltf" -o "$name.glb" --force -q >/dev/null
  done
}

# write_case NAME VERB ARGUMENT..: NAME.bvh and NAME.glb of one motion, and where its joints are
write_case() {
  local name=$1
  shift
  "$laban" "$@" -o "$name.bvh" --force -q >/dev/null
  "$laban" "$@" -o "$name.glb" --force -q >/dev/null
  add_case "$name"
}

# add_case NAME: takes NAME.bvh and NAME.glb in, and holds our own table of joint positions to theirs
add_case() {
  tell "$1" 0.01 "$1.bvh"
  cases+=("$1")
  "$laban" convert "$1.bvh" --unit 0.01 -o "$1.csv" --force -q >/dev/null
  compare "positions/$1.csv" "$1.csv" $round_trip_m "our table: $1"
}

# convert_case NAME INPUT.bvh UNIT_M: a converted file, held to the file it came from
convert_case() {
  write_case "$1" convert "$2" --unit "$3" --output-unit 0.01
  tell "$1.source" "$3" "$2"
  compare "positions/$1.source.csv" "positions/$1.csv" $round_trip_m "round trip: $1"
}

write_files() {
  local take=$source/data/take.bvh phrase=$source/data/phrase format
  convert_case take "$take" 0.01
  # Six channels below the root, a frame rate of 23.976 Hz, turns past 180 degrees, odd names.
  convert_case awkward "$here/awkward.bvh" 0.01
  write_case one_frame convert "$take" --begin 30 --end 31
  write_case resampled convert "$take" --rate 47.5
  write_case in_place convert "$take" --root-motion in-place
  write_case root_joint convert "$take" --root-motion root-joint
  write_case mirrored convert "$take" --mirror
  write_case styled apply "$take" --time 2 --flow -1
  write_case blend blend "$phrase"/phrase_walk_{p01,p07}.bvh --alpha 0.4
  for format in bvh glb; do
    "$laban" corpus --clips "$phrase" --pattern 'phrase_{content}_{performer}' --blends 4 \
      --write-blends sheet --blend-format $format -o sheet.csv --force -q >/dev/null
  done
  cp sheet/blend_001.* .
  add_case blend_001
  if [[ -z "${LABAN_DATA:-}" ]]; then
    skipped "real captures: LABAN_DATA is not set"
    return
  fi
  # Six channels on every joint, of one who walks and of one who stands; 31 joints in a unit of
  # their own; 43 joints.
  convert_case bandai "$LABAN_DATA/bandai1/dataset-1_walk_normal_001.bvh" 0.01
  convert_case bandai_standing "$LABAN_DATA/bandai1/dataset-1_bye_proud_001.bvh" 0.01
  convert_case cmu_31 "$LABAN_DATA/cmu_clips/walk_07_01.bvh" 0.05644
  convert_case cmu_43 "$LABAN_DATA/cmu_dance/modern_02.bvh" 0.01
  write_case cmu_31_styled apply cmu_31.bvh --weight 2
}

# check_positions PROGRAM FORMAT..: what PROGRAM told of each case beside the reference
check_positions() {
  local program=$1 name format
  shift
  for name in "${cases[@]}"; do
    for format in "$@"; do
      compare "positions/$name.csv" "positions/$name.$format.$program.csv" $tolerance_m \
        "$program: $name.$format"
    done
  done
}

# Installs what package.json names. 1 if there is no npm or no registry; any other fault is an error.
have_node_packages() {
  if ! command -v npm >/dev/null; then
    skipped "Khronos validator and three.js: npm is not installed"
    return 1
  fi
  cmp -s package.json node_modules/installed.json && return
  if ! npm install --no-audit --no-fund --loglevel=error 2>npm.log; then
    if grep -qE 'ENOTFOUND|EAI_AGAIN|ECONNREFUSED|ENETUNREACH|ETIMEDOUT' npm.log; then
      skipped "Khronos validator and three.js: npm reaches no registry"
    else
      cat npm.log >&2
      failures=$((failures + 1))
    fi
    return 1
  fi
  cp package.json node_modules/installed.json
}

check_by_node() {
  have_node_packages || return 0
  stage "Khronos validator"
  hold node validate.mjs ./*.glb sheet/*.glb
  stage "three.js"
  hold node three_positions.mjs positions "${cases[@]/%/.bvh}" "${cases[@]/%/.glb}"
  check_positions three bvh glb
  hold node three_positions.mjs positions compact.glb@60
  compare positions/take.csv positions/compact.glb.three.csv $compact_tolerance_m "three: compact.glb"
}

check_by_blender() {
  if ! command -v blender >/dev/null; then
    skipped "Blender: it is not installed"
    return
  fi
  stage "Blender"
  local files=("${cases[@]/%/.bvh}" "${cases[@]/%/.glb}")
  # A failing script may leave the exit code 0, so its last line is looked for.
  if ! blender --factory-startup -b --python-exit-code 1 -P "$here/blender_positions.py" -- \
    positions "${files[@]}" >blender.log 2>&1 ||
    ! grep -q "^blender_positions: ${#files[@]} files$" blender.log; then
    tail -n 20 blender.log >&2
    failures=$((failures + 1))
  fi
  check_positions blender bvh glb
}

check_by_assimp() {
  if [[ ! -e /usr/include/assimp/scene.h ]] || ! command -v g++ >/dev/null; then
    skipped "assimp: libassimp-dev or g++ is not installed"
    return
  fi
  stage "assimp"
  g++ -std=c++20 -O1 "$here/assimp_positions.cpp" -lassimp -o assimp_positions
  hold ./assimp_positions positions "${cases[@]/%/.bvh}" "${cases[@]/%/.glb}"
  check_positions assimp bvh glb
}

# Nothing of an earlier run may stand in for what this one fails to write.
mkdir -p "$work"
cd "$work"
rm -rf positions sheet ./*.bvh ./*.glb ./*.csv
mkdir positions
cp "$here"/package.json "$here"/*.mjs .

stage "writing files"
write_files
write_glb_alone
check_by_node
check_by_blender
check_by_assimp

stage "$failures failed"
exit $((failures > 0))
