#!/usr/bin/env bash
# Builds and runs the fuzzers, with the sanitizers (preset sanitize).
#
#   tests/fuzz/run.sh                   # every reader, 10 seconds each
#   tests/fuzz/run.sh 600               # 10 minutes each
#   tests/fuzz/run.sh 600 bvh gltf      # of these only
#
# Fails on the first finding: a crash, a leak, undefined behaviour, an exception other than
# base::Error, more memory than 16 times the file and 64 MB, or more than a second. The file that
# does it is kept in build/fuzz/findings; give it to the fuzzer as its only argument to see it
# again. What new files the fuzzers think of stays in build/fuzz/corpus for the next run.
set -euo pipefail
cd "$(dirname "$0")/../.."

seconds=${1:-10}
shift || true
programs=build/sanitize/tests/fuzz
cmake --preset sanitize -DCMAKE_CXX_COMPILER_LAUNCHER="$(command -v ccache || true)" >/dev/null
cmake --build build/sanitize --target fuzzers -- --quiet

readers=("$@")
if [[ $# -eq 0 ]]; then
  for seeds in "$programs"/*_fuzzer.seeds; do
    name=$(basename "$seeds")
    readers+=("${name%_fuzzer.seeds}")
  done
fi

for reader in "${readers[@]}"; do
  fuzzer=$programs/${reader}_fuzzer
  if [[ ! -x $fuzzer ]]; then
    echo "run.sh: there is no fuzzer for '$reader'" >&2
    exit 2
  fi
  mapfile -t seeds <"$fuzzer.seeds"
  corpus=build/fuzz/corpus/$reader
  findings=build/fuzz/findings
  mkdir -p "$corpus" "$findings"
  options=(-timeout=1 -rss_limit_mb=2048 -malloc_limit_mb=2048 -max_len=65536 -detect_leaks=1)
  [[ -f tests/fuzz/$reader.dict ]] && options+=(-dict="tests/fuzz/$reader.dict")
  log=$findings/$reader.log
  if ! "$fuzzer" "${options[@]}" -max_total_time="$seconds" -print_final_stats=1 \
    -artifact_prefix="$findings/$reader-" "$corpus" "${seeds[@]}" >"$log" 2>&1; then
    cat "$log" >&2
    echo "run.sh: $reader: a finding, see above and $findings" >&2
    exit 1
  fi
  printf '%-12s %10s executions, %4s seeds and more kept\n' "$reader" \
    "$(sed -n 's/^stat::number_of_executed_units: *//p' "$log")" "$(find "$corpus" -type f | wc -l)"
done
