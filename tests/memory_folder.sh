#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Prints the folder for tests that write a million small files: in memory where there is room, as a
# disk would be waited for.
set -euo pipefail
memory=/dev/shm
room=$(df --output=avail "$memory" 2>/dev/null | tail -1 || echo 0) # [KiB]
if [ -w "$memory" ] && [ "$room" -gt 1000000 ]; then
  echo "$memory"
else
  echo "${TMPDIR:-/tmp}"
fi
