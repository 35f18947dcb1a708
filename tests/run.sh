#!/usr/bin/env bash
# Installs what is needed, builds everything, checks format and static analysis, and runs all
# tests. Run again, it only builds what changed.
#
# usage: tests/run.sh [--fast]     --fast leaves out static analysis
set -euo pipefail
cd "$(dirname "$0")/.."

samples/install.sh --tests
cmake --preset release -DCGS_BUILD_TESTS=ON >/dev/null
cmake --build --preset release

echo "format"
git ls-files '*.h' '*.cpp' | xargs clang-format-14 --dry-run --Werror
[ "${1:-}" = "--fast" ] || tests/tidy.sh

ctest --preset release -j 2
