#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Installs what is needed, builds everything, checks the format and runs all tests. Run again, it
# only builds what changed.
#
# usage: tests/run.sh [--tidy|--long]
#   --tidy adds static analysis (tests/tidy.sh), half an hour
#   --long adds all faults and kills, and ten million runs of the fuzzer, an hour and a half
#     (tests/reliability.sh --long)
set -euo pipefail
cd "$(dirname "$0")/.."
case "$*" in
  "" | --tidy | --long) ;;
  *)
    echo "usage: tests/run.sh [--tidy|--long]" >&2
    exit 2
    ;;
esac

samples/install.sh --tests
cmake --preset release -DCGS_BUILD_TESTS=ON >/dev/null
cmake --build --preset release

echo "format"
git ls-files '*.h' '*.cpp' | xargs -P 2 -n 60 clang-format-14 --dry-run --Werror
if [ "${1:-}" = "--tidy" ]; then tests/tidy.sh; fi

ctest --preset release -j 2
if [ "${1:-}" = "--long" ]; then tests/reliability.sh --long; fi
