#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The program must start, and run, on a processor without AVX-512: only what the sources of these
# instructions define themselves may hold them (has_sixteen_lanes() chooses). An inline function
# that such a source shares with others could be the copy that the whole program gets.
#
# usage: instructions_test.sh PROGRAM AVX512_OBJECT...
set -euo pipefail
program="$1"
shift
if ! command -v objdump >/dev/null; then
  echo "skipped: objdump (binutils) is not installed"
  exit 77
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# Those that no other source defines: neither weak (W, V) nor undefined.
nm --defined-only "$@" | awk '$2 == "t" || $2 == "T" {print $3}' | sort -u >"$work/may"

# Functions with an instruction that AVX-512 alone has: its prefix is the byte 62, or it works on a
# mask register.
objdump -d -w --no-addresses "$program" |
  awk '/^<.*>:$/ {name = substr($0, 2, length($0) - 3)}
       /^\t62 |%k[0-7]/ {print name}' | sort -u >"$work/have"

count=$(wc -l <"$work/have")
if [ "$count" -eq 0 ]; then
  echo "no function has AVX-512: this test no longer sees what it looks for" >&2
  exit 1
fi
if comm -23 "$work/have" "$work/may" | c++filt >"$work/others" && [ -s "$work/others" ]; then
  echo "these use AVX-512 and are not of a source that may:" >&2
  cat "$work/others" >&2
  exit 1
fi
echo "$count functions with AVX-512, all of the sources that may have it"
