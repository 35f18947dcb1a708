#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Runs the tests of one source out of a program of many. Takes the options of the program, too.
#
# usage: tests/one.sh build/release/bin/io_tests tests/io/images/npy_test.cpp [--gtest_...]
set -euo pipefail
program=$1
source=$2
shift 2
# By both names: two sources of a program may have a suite of one name.
filter=$(tr '\n' ' ' < "$source" | grep -oE '\bTEST(_F|_P)?\( *\w+, *\w+\)' |
         sed -E 's/TEST(_F)?\( *(\w+), *(\w+)\)/\2.\3/; s/TEST_P\( *(\w+), *(\w+)\)/*\/\1.\2\/*/' |
         paste -sd : || true)
if [ -z "$filter" ]; then
  echo "$source: no test found" >&2
  exit 1
fi
exec "$program" --gtest_filter="$filter" "$@"
