#!/usr/bin/env bash
# Makes the embedded corpus and its labels again, byte for byte: data/phrase, data/take.bvh,
# labels/phrase.csv. Run it after a change to tools/make_phrase or to the kinematic observer.
set -euo pipefail
cd "$(dirname "$0")/.."

tools/install_dependencies.sh
cmake --preset demo >/dev/null
cmake --build build/demo -j "$(nproc)" --target laban_cli make_phrase -- --quiet
build/demo/tools/make_phrase/make_phrase data
build/demo/tools/laban/laban corpus --clips data/phrase --pattern 'phrase_{content}_{performer}' --blends 105 \
  --seed 1 --label measured -o labels/phrase.csv --force
