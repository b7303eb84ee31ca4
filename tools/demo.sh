#!/usr/bin/env bash
# Sets up and runs the main job on the embedded corpus: installs what is missing, builds the command
# line, trains the default model and gives a clip another Effort. Its files are in build/demo/.
#
#   tools/demo.sh            # no more than that
#   tools/demo.sh --studio   # builds the studio too (which takes npm) and opens it on that clip
set -euo pipefail
cd "$(dirname "$0")/.."

tools/install_dependencies.sh "$@"
targets=(laban_cli default_model)
[[ "${1:-}" == --studio ]] && targets+=(studio_pages)
export CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime
cmake --preset demo -DCMAKE_CXX_COMPILER_LAUNCHER=ccache \
  -DLABAN_BUILD_STUDIO="$([[ "${1:-}" == --studio ]] && echo ON || echo OFF)" >/dev/null
cmake --build build/demo -j "$(nproc)" --target "${targets[@]}" -- --quiet

# data/take.bvh: one take of all five actions by a performer who is not in the corpus.
laban=build/demo/tools/laban/laban
mkdir -p build/demo/out
"$laban" apply data/take.bvh --flow 1 --weight 2 --time 1.5 -o build/demo/out/strong.bvh --force \
  --report build/demo/out/strong.json --picture build/demo/out/strong.png
"$laban" convert build/demo/out/strong.bvh -o build/demo/out/strong.glb --force

echo
echo "In build/demo/out: strong.bvh and strong.glb (the take, more bound, strong and sudden), strong.json (the report),"
echo "strong.png (input above output). Next: $laban --help"
if [[ "${1:-}" == --studio ]]; then exec "$laban" studio data/take.bvh; fi
