#!/usr/bin/env bash
# Sets up and passes the tests.
#
#   tools/test.sh         # installs, builds (release, warnings are errors), runs every test
#   tools/test.sh --all   # also formatting, clang++ with sanitizers, fuzzers, clang-tidy, interop
#
# LABAN_DATA=folder adds the tests on real captures (see data/README.md); without it they are
# skipped and say so.
set -euo pipefail
cd "$(dirname "$0")/.."

all=false
[[ "${1:-}" == --all ]] && all=true
jobs=$(nproc)
export CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime
export CTEST_OUTPUT_ON_FAILURE=1

stage() { printf '\n== %s (%d s so far)\n' "$*" "$SECONDS"; }

# build PRESET TARGET..
build() {
  local preset=$1
  shift
  cmake --preset "$preset" -DCMAKE_CXX_COMPILER_LAUNCHER=ccache >/dev/null
  cmake --build "build/$preset" -j "$jobs" --target "$@" -- --quiet
}

stage "dependencies"
if $all; then tools/install_dependencies.sh --all; else tools/install_dependencies.sh --test; fi

if $all; then
  stage "formatting"
  git ls-files '*.h' '*.cpp' | xargs clang-format --dry-run --Werror
fi

stage "release: build and test"
build ci all public_headers_compile_alone
ctest --test-dir build/ci -j "$jobs" --quiet --output-on-failure

stage "studio: its pages in Chromium"
tests/studio/run.sh build/ci

if $all; then
  stage "clang++ with address and undefined-behaviour sanitizers: build and test"
  export LSAN_OPTIONS=suppressions=$PWD/tools/cmake/leaks.supp:print_suppressions=0
  build sanitize all
  ctest --test-dir build/sanitize -j "$jobs" --quiet --output-on-failure -LE package

  stage "fuzzers: a few seconds a reader"
  tests/fuzz/run.sh 5

  # A target of the unity build is one file: the headers, most of the work, are read once. The analyzer
  # follows paths through a file's own functions only, so what reads hostile files is given to it alone,
  # with the commands of a build that is configured but never made: one where every file is its own.
  stage "clang-tidy"
  sed -n 's|.*"file": "\(.*/src/.*\)".*|\1|p' build/sanitize/compile_commands.json |
    xargs -P "$jobs" -n 1 clang-tidy --quiet -p build/sanitize --config-file=.clang-tidy \
      --checks=-bugprone-suspicious-include 2>/dev/null
  cmake --preset analyze >/dev/null
  git ls-files 'src/io/*.cpp' 'src/base/*.cpp' 'src/*/*_file.cpp' 'src/*/*_table.cpp' 'src/*/stored_rig.cpp' |
    xargs -P "$jobs" -n 4 clang-tidy --quiet -p build/analyze --checks='-*,clang-analyzer-*' 2>/dev/null

  stage "interop: three.js, Blender, assimp and the Khronos validator read our files"
  tests/interop/run.sh build/ci
fi

stage "all passed"
