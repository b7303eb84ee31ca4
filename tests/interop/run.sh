#!/usr/bin/env bash
# Puts what the program writes before other people's programs (needs npm):
#   tests/interop/run.sh BUILD_DIR
# Khronos validator: 0 errors and 0 warnings on GLB of a take, of a stylised take and of a blend sheet.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
build=$(cd "$1" && pwd)
source=$(cd "$here/../.." && pwd)
laban=$build/tools/laban/laban

if ! command -v npm >/dev/null; then
  echo "interop: skipped, npm is not installed" >&2
  exit 0
fi
work=$build/interop
mkdir -p "$work"
cp "$here"/package.json "$here"/*.mjs "$work"/
cd "$work"
[[ -d node_modules/gltf-validator ]] || npm install --no-audit --no-fund --loglevel=error

"$laban" convert "$source/data/take.bvh" -o take.glb --force -q
"$laban" apply "$source/data/take.bvh" --time 2 --flow -1 -o styled.glb --force -q >/dev/null
"$laban" corpus --clips "$source/data/phrase" --pattern 'phrase_{content}_{performer}' --blends 4 \
  --write-blends sheet -o sheet.csv --force -q >/dev/null
node validate.mjs take.glb styled.glb sheet/*.glb
if [[ -n "${LABAN_DATA:-}" ]]; then
  for capture in bandai1/dataset-1_walk_normal_001 cmu_clips/walk_07_01 cmu_dance/modern_02; do
    "$laban" convert "$LABAN_DATA/$capture.bvh" -o "$(basename "$capture").glb" --force -q
    node validate.mjs "$(basename "$capture").glb"
  done
else
  echo "interop: real captures skipped, LABAN_DATA is not set" >&2
fi
