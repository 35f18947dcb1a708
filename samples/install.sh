#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Installs the Debian 12 packages that build and run this project; with --tests, also those its
# tests use. Does nothing, and needs no network, where they are all there.
set -euo pipefail
list="$(dirname "$0")/packages.txt"
case "$*" in
  "" | --tests) ;;
  *)
    echo "usage: samples/install.sh [--tests]" >&2
    exit 2
    ;;
esac

if [ "${1:-}" = "--tests" ]; then
  packages=$(grep -v '^#' "$list")
else
  packages=$(sed '/^# tests only/,$d' "$list" | grep -v '^#')
fi

missing=()
for package in $packages; do
  dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'install ok installed' ||
    missing+=("$package")
done
if [ ${#missing[@]} -eq 0 ]; then
  echo "packages: all there"
  exit 0
fi

echo "packages: installing ${#missing[@]}: ${missing[*]}"
as_root=()
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || { echo "installing needs root: run it as root, or install sudo" >&2; exit 1; }
  as_root=(sudo)
fi
"${as_root[@]}" apt-get update -qq
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
  apt-get install -y -q --no-install-recommends "${missing[@]}"
