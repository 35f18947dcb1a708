#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The figures of reliability, one line each; more of everything than the tests try.
#
# usage: tests/reliability.sh [--long]
#   a share of the faults and 20 s of fuzzing per kind of file: half an hour on 2 cores;
#   --long tries all of them and ten million files or more of the fuzzer: two hours
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

# What a program prints in lines that start with a word; a program that fails is told.
figures() {
  local word=$1 output result=0
  shift
  output=$("$@" 2>&1) || { result=1; echo "FAILED: $*"; grep -m5 -A4 Failure <<<"$output" || true; }
  grep "^$word" <<<"$output" || { result=1; echo "NO FIGURE '$word': $*"; }
  return $result
}
# Runs on captures of three sizes, and how much memory they needed of what was foreseen.
foreseen_memory() {
  local folder result=0
  folder=$(mktemp -d)
  for size in 1 2 3; do
    "$bin/cgs_make_capture" "$folder/capture_$size" --downscale $size || result=1
    "$bin/cgs" run "$folder/capture_$size" --views view_01,view_02,view_03 --assume-unit m -q \
      -o "$folder/out_$size" || result=1
  done
  tests/eval/memory_ratio.py "$folder"/out_{1,2,3} || result=1
  rm -rf "$folder"
  return $result
}
# The faults in two halves of about the same length.
injected_faults() {
  local folder tests pid pids=() result=0
  folder=$(mktemp -d)
  for tests in '*AnError*' '-*AnError*'; do
    "$bin/e2e_faults_test" --gtest_filter="$tests" >"$folder/${#pids[@]}" 2>&1 &
    pids+=($!)
  done
  for pid in "${pids[@]}"; do wait "$pid" || result=1; done
  sed 's/^faults:/of these/' "$folder"/*
  awk '/^faults:/ { survived += $2; tried += $5 }
    END { printf "faults: %d survived of %d tried\n", survived, tried; exit tried == 0 }' \
    "$folder"/* || result=1
  rm -rf "$folder"
  return $result
}
figures 'bad inputs:' "$bin/e2e_bad_inputs_test" || status=1
CGS_SWEEP=full TMPDIR=$(tests/memory_folder.sh) figures 'sweep:' "$bin/bad_input_sweep" || status=1
figures 'extremes cells' "$bin/extremes_test" || status=1
CGS_KILLS=$kills figures '\(cancel\|kills\|lost\)' "$bin/e2e_kill_test" || status=1
figures 'hashes:' "$bin/e2e_verify_test" || status=1
figures 'memory:' foreseen_memory || status=1
CGS_FAULTS=$faults figures 'power cuts:' tests/e2e/power_loss_test.py "$bin/cgs" "$bin/cgs_make_capture" \
  build/release/tests/power_loss || status=1
# Nothing from here on is held to a time.
CGS_FAULTS=$faults figures 'faults:' injected_faults &
faults_pid=$!
CGS_FUZZ_RUNS=$runs tests/fuzz/run.sh "$seconds" || status=1
wait $faults_pid || status=1
exit $status
