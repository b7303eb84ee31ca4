#!/usr/bin/env bash
# The studio's pages, driven in Debian's Chromium as users drive them.
#
#   tests/studio/run.sh BUILD_DIR    # BUILD_DIR has tools/laban/laban; pictures are left in BUILD_DIR/studio
set -euo pipefail
cd "$(dirname "$0")/../.."

build=$(realpath "$1")
work=$build/studio
mkdir -p "$work"
cp tests/studio/*.mjs tests/studio/package.json "$work"
[[ -f $work/node_modules/.installed && $work/node_modules/.installed -nt $work/package.json ]] ||
  (cd "$work" && npm install --no-package-lock --no-audit --no-fund --loglevel=error && touch node_modules/.installed)

export LABAN_PROGRAM=$build/tools/laban/laban LABAN_TAKE=$PWD/data/take.bvh LABAN_PHRASE=$PWD/labels/phrase.csv
cd "$work"
exec node --test --test-concurrency=1 --test-reporter=spec ./*.test.mjs
