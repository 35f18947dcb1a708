#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The types of the Python module: they name what there is, and the samples agree with them.
#
# usage: stubs_test.sh MODULE_FOLDER WORK_FOLDER
set -euo pipefail
cd "$(dirname "$0")/../.."
command -v stubtest >/dev/null || { echo "skipped: mypy is not installed" >&2; exit 77; }
rm -rf "$2"
mkdir -p "$2"
cp -r python/cgs-stubs "$2/cgs"
# Types made in C++ have a metaclass and a constructor that Python's own have not.
cat >"$2/allowed" <<'ALLOWED'
cgs\.(Camera|Frame|Mesh|Model|Picture|Scene|Splats|View|Volume)
cgs\.(Frame|Model|Picture|Scene|View|Volume)\.__init__
ALLOWED
# The types of Pillow are a package of their own, which machines may lack.
cat >"$2/mypy.ini" <<'SETTINGS'
[mypy]
[mypy-PIL.*]
ignore_missing_imports = True
SETTINGS
export MYPYPATH="$2"
PYTHONPATH="$1" stubtest cgs --allowlist "$2/allowed"
mypy --strict --config-file "$2/mypy.ini" --python-executable /usr/bin/python3 --cache-dir "$2/cache" samples/python/*.py
