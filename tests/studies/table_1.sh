#!/usr/bin/env bash
# Table 1 of [Torresani06] beside ours, under all three protocols, and what the intervals say of the fifth regressor:
# is it below linear interpolation on every factor, and above none of the paper's other three?
#
#   tests/studies/table_1.sh LABAN [TABLE.csv ..]      # default table: labels/phrase.csv
#   RUNS=100 PICTURES=folder tests/studies/table_1.sh build/release/tools/laban/laban captures.csv
#
# RUNS: random splits (default 500). PICTURES: a folder for the tables as bars and CSV.
set -euo pipefail
laban=${1:?"usage: table_1.sh LABAN [TABLE.csv ..]"}
shift
tables=("$@")
((${#tables[@]})) || tables=("$(dirname "$0")/../../labels/phrase.csv")

for table in "${tables[@]}"; do
  for protocol in random leave-performer-out leave-content-out; do
    options=(--labels "$table" --protocol "$protocol" --force)
    [[ $protocol == random ]] && options+=(--runs "${RUNS:-500}")
    if [[ -n ${PICTURES:-} ]]; then
      name=$PICTURES/$(basename "$table" .csv)_$protocol
      options+=(--plot "$name.svg" --csv "$name.csv" --runs-csv "${name}_runs.csv")
    fi
    printf '\n== %s, %s ==\n' "$table" "$protocol"
    "$laban" evaluate "${options[@]}" || printf 'no table: exit code %d\n' $?
  done
done
