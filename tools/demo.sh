#!/usr/bin/env bash
# Sets up and runs the main job on the embedded corpus: installs what is missing, builds the command
# line, trains the default model and gives a clip another Effort. Its files are in build/demo/.
set -euo pipefail
cd "$(dirname "$0")/.."

tools/install_dependencies.sh
export CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime
cmake --preset demo -DCMAKE_CXX_COMPILER_LAUNCHER=ccache >/dev/null
cmake --build build/demo -j "$(nproc)" --target laban_cli default_model -- --quiet

# data/take.bvh: one take of all five actions by a performer who is not in the corpus.
laban=build/demo/tools/laban/laban
mkdir -p build/demo/out
"$laban" apply data/take.bvh --flow 1 --weight 2 --time 1.5 -o build/demo/out/strong.bvh --force \
  --report build/demo/out/strong.json --picture build/demo/out/strong.png
"$laban" convert build/demo/out/strong.bvh -o build/demo/out/strong.glb --force

echo
echo "In build/demo/out: strong.bvh and strong.glb (the take, more bound, strong and sudden), strong.json (the report),"
echo "strong.png (input above output). Next: $laban --help"
