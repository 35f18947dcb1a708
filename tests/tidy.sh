#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# clang-tidy over every source but those of tests, warnings as errors. A file that passed is not checked again until
# it, a header of ours, or the rules change; the stamps are in build/tidy.
set -euo pipefail
cd "$(dirname "$0")/.."
stamps=build/tidy
cmake --preset release -B $stamps/each -DCMAKE_UNITY_BUILD=OFF >/dev/null
rules=$(git ls-files '*.h' .clang-tidy | xargs sha256sum | sha256sum | cut -c1-16)
export stamps rules
# Without the precompiled headers of GCC: each source must include what it uses. Nor with its
# warnings that Clang does not know.
sed -E 's/-Winvalid-pch -include [^ ]+cmake_pch.hxx//
        s/-fpch-preprocess|-Wno-(restrict|stringop-overflow|subobject-linkage)//g' \
  "$stamps/each/compile_commands.json" > "$stamps/compile_commands.json"

check() {
  local stamp
  stamp="$stamps/$(cat "$1" <(echo "$1 $rules") | sha256sum | cut -c1-32)"
  [ -f "$stamp" ] && return 0
  if output=$(clang-tidy-14 --quiet -p "$stamps" "$1" 2>/dev/null); then
    touch "$stamp"
    echo "tidy: $1"
  else
    printf 'tidy: %s FAILED\n%s\n' "$1" "$output"
    return 1
  fi
}
export -f check
git ls-files 'libcgs/*.cpp' 'io/*.cpp' 'meshing/*.cpp' 'convert/*.cpp' 'samples/*.cpp' |
  xargs -P "$(nproc)" -I{} bash -c 'check {}'
