#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Makes the pages of the public headers in a folder that need not exist; any warning of Doxygen fails.
#
# usage: docs.sh OUT
set -euo pipefail
if ! command -v doxygen >/dev/null; then
  echo "skipped: doxygen is not installed"
  exit 77
fi
mkdir -p "$1"
out=$(realpath "$1")
cd "$(dirname "$0")/.."
(cat docs/Doxyfile; echo "OUTPUT_DIRECTORY = \"$out\"") | doxygen -
