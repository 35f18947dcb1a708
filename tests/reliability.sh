#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The figures of reliability, one line each; more of everything than the tests try.
#
# usage: tests/reliability.sh [--long]
#   a share of the faults and 20 s of fuzzing per kind of file: half an hour on 2 cores;
#   --long tries all of them and ten million files or more of the fuzzer: an hour and a half
set -euo pipefail
cd "$(dirname "$0")/.."
if [ $# -gt 1 ] || { [ $# -eq 1 ] && [ "$1" != "--long" ]; }; then
  echo "usage: tests/reliability.sh [--long]" >&2
  exit 2
fi
faults=40 kills=40 seconds=20 runs=0
if [ "${1:-}" = "--long" ]; then faults=100000 kills=200 seconds=100 runs=10000000; fi

samples/install.sh --tests
cmake --preset release -DCGS_BUILD_TESTS=ON >/dev/null
cmake --build --preset release
bin=build/release/bin
status=0

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

# What a program prints in lines that start with a word; a program that fails is told.
figures() {
  local word=$1 output result=0 start=$SECONDS
  shift
  output=$("$@" 2>&1) || { result=1; echo "FAILED: $*"; grep -m5 -A4 Failure <<<"$output" || true; }
  output=$(grep "^$word" <<<"$output") || { result=1; output="NO FIGURE '$word': $*"; }
  echo "$output ($(((SECONDS - start + 30) / 60)) min)"
  return $result
}
# Runs on captures of three sizes, and how much memory they needed of what was foreseen.
foreseen_memory() {
  local result=0
  for size in 1 2 3; do
    "$bin/cgs_make_capture" "$folder/capture_$size" --downscale $size || result=1
    "$bin/cgs" run "$folder/capture_$size" --views view_01,view_02,view_03 --assume-unit m -q \
      -o "$folder/out_$size" || result=1
  done
  tests/eval/memory_ratio.py "$folder"/out_{1,2,3} || result=1
  return $result
}
bad_inputs() { figures 'bad inputs:' "$bin/e2e_bad_inputs_test"; }
sweep() {
  CGS_SWEEP=full TMPDIR=$(tests/memory_folder.sh) figures 'sweep:' "$bin/bad_input_sweep"
}
extremes() { CGS_SWEEP=full figures 'extremes cells' "$bin/extremes_test"; }
hashes() { figures 'hashes:' "$bin/e2e_verify_test"; }
power_cuts() {
  CGS_FAULTS=$faults figures 'power cuts:' tests/e2e/power_loss_test.py "$bin/cgs" "$bin/cgs_make_capture" \
    build/release/tests/power_loss
}
# The faults in two halves of about the same length.
injected_faults() {
  local result=0
  CGS_FAULTS=$faults figures 'faults:' "$bin/e2e_faults_test" --gtest_filter="$1" >"$folder/faults$1" || result=1
  sed 's/^faults:/of these/' "$folder/faults$1"
  return $result
}
faults_of_the_system() { injected_faults '*AnError*'; }
other_faults() { injected_faults '-*AnError*'; }
# Two at a time of what is named.
in_pairs() {
  local result=0
  for part in "$@"; do
    if [ "$(jobs -rp | wc -l)" -ge 2 ]; then wait -n || result=1; fi
    $part &
  done
  while [ -n "$(jobs -p)" ]; do wait -n || result=1; done
  return $result
}

# These measure times.
CGS_KILLS=$kills figures '\(cancel\|kills\|lost\)' "$bin/e2e_kill_test" || status=1
figures 'memory:' foreseen_memory || status=1
in_pairs sweep bad_inputs power_cuts other_faults faults_of_the_system extremes hashes || status=1
awk '/^faults:/ { survived += $2; tried += $5 }
  END { printf "faults: %d survived of %d tried\n", survived, tried; exit tried == 0 }' "$folder"/faults* || status=1
CGS_FUZZ_RUNS=$runs tests/fuzz/run.sh "$seconds" || status=1
exit $status
