#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Lets libFuzzer loose on every reader (but that of Draco, which works in a child process), built
# with AddressSanitizer and UndefinedBehaviorSanitizer. What it learns stays in
# build/sanitize/fuzz/corpus for the next time; what it breaks a reader with lies in
# build/sanitize/fuzz/crashes and makes the script fail.
#
# usage: tests/fuzz/run.sh [SECONDS [KIND...]]     60 s for each kind of file if nothing is said
#   CGS_FUZZ_RUNS=N  ends a kind sooner, at twice its share of N runs, and fails if all made fewer
set -euo pipefail
cd "$(dirname "$0")/../.."
seconds=${1:-60}
shift || true

samples/install.sh --tests
cmake --preset sanitize >/dev/null
cmake --build --preset fuzz
fuzzer=$PWD/build/sanitize/bin/reader_fuzzer
results=$PWD/build/sanitize/fuzz
mkdir -p "$results/crashes"
if [ $# -gt 0 ]; then kinds=$(printf '%s\n' "$@"); else kinds=$("$fuzzer" --list); fi
wanted=${CGS_FUZZ_RUNS:-0}
most=$((2 * wanted / $(wc -l <<<"$kinds")))
[ "$most" -gt 0 ] || most=-1 # as many as there is time for
export fuzzer results seconds most
TMPDIR=$(mktemp -d -p "$(tests/memory_folder.sh)")
export TMPDIR
trap 'rm -rf "$TMPDIR"' EXIT

runs_in() { sed -n 's/^stat::number_of_executed_units: *//p' "$results/$1.log"; }
fuzz() {
  local corpus="$results/corpus/$1"
  mkdir -p "$corpus"
  rm -f "$results/$1.log"
  "$fuzzer" --kind="$1" --seed="$corpus/valid" || { echo "$1: its valid file cannot be made"; return 1; }
  local verdict=clean
  "$fuzzer" --kind="$1" -max_total_time="$seconds" -runs="$most" -max_len=65536 -timeout=20 -rss_limit_mb=6000 \
    -print_final_stats=1 -artifact_prefix="$results/crashes/$1-" "$corpus" \
    >"$results/$1.log" 2>&1 || verdict="DEFECT, see $results/$1.log"
  local runs edges
  runs=$(runs_in "$1")
  edges=$(grep -o 'cov: [0-9]*' "$results/$1.log" | tail -1 | cut -c6-)
  printf '%-20s %9s runs %6s edges  %s\n' "$1" "${runs:-0}" "${edges:-0}" "$verdict"
  [ "$verdict" = clean ]
}
export -f fuzz runs_in
status=0
xargs -P "$(nproc)" -I{} bash -c 'fuzz {}' <<<"$kinds" || status=1
runs=0
for kind in $kinds; do
  if [ -f "$results/$kind.log" ]; then of_kind=$(runs_in "$kind"); else of_kind=0; fi
  runs=$((runs + ${of_kind:-0}))
done
echo "fuzz: $runs runs of $(wc -l <<<"$kinds") kinds of file, $([ $status = 0 ] && echo clean || echo DEFECTS)"
[ "$runs" -ge "$wanted" ] || { echo "fuzz: fewer than the $wanted wanted"; status=1; }
exit $status
