#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Makes the packages of Debian out of what was built, unpacks them and tries what is in them: the
# program, its manual and completion, the Python module, and a project of somebody else that is
# built with the libraries. What a clean system makes of them: tests/clean_root_test.sh.
#
# usage: package_test.sh BUILD_FOLDER CXX_COMPILER WORK_FOLDER
set -euo pipefail
sources="$(cd "$(dirname "$0")/.." && pwd)"
build="$1" compiler="$2" work="$3"
for tool in dpkg-shlibdeps file; do
  command -v $tool >/dev/null || { echo "skipped: $tool (packages dpkg-dev, file) is not installed"; exit 77; }
done
rm -rf "$work"
mkdir -p "$work/root"
work=$(cd "$work" && pwd)
root="$work/root"

fail() {
  echo "$*" >&2
  exit 1
}

is_there() {  # is_there PROGRAM: else says what is left out
  command -v "$1" >/dev/null || { echo "left out: $1 is not installed"; return 1; }
}

(cd "$build" && cpack -G DEB -B "$work") >"$work/cpack.log" 2>&1 || fail "$(cat "$work/cpack.log")"
rm -rf "$work/_CPack_Packages"
lintian=
if is_there lintian; then
  lintian --allow-root --fail-on error "$work"/*.deb >"$work/lintian.log" 2>&1 &
  lintian=$!
fi
for name in cgs libcgs-dev python3-cgs; do
  package=$(echo "$work/${name}"_*.deb)
  [ -f "$package" ] || fail "there is no package $name"
  dpkg-deb -x "$package" "$root"
  dpkg-deb -f "$package" Package Version Installed-Size | paste -sd ' '
  for file in copyright changelog.gz changelog.Debian.gz; do
    [ -s "$root/usr/share/doc/$name/$file" ] || fail "$name lacks its $file"
  done
done
needs() {  # needs PACKAGE OTHER
  dpkg-deb -f "$work/$1"_*.deb Depends | tr ',' '\n' | grep -qE "^ *$2( |$)" || fail "$1 does not need $2"
}
needs cgs 'libopencv-core[0-9]+'
needs python3-cgs 'libopencv-core[0-9]+'
needs python3-cgs python3-numpy
needs libcgs-dev libopencv-dev

# The program, without the symbols that only debuggers want.
program="$root/usr/bin/cgs"
version=$("$program" --version)
[ "$version" = "cgs $(dpkg-deb -f "$work"/cgs_*.deb Version | sed 's/-.*//')" ] || fail "--version says $version"
if nm "$program" 2>/dev/null | grep -q .; then fail "the program is not stripped"; fi
commands=$("$program" --help | sed -n '/^Subcommands:/,/^$/s/^  \([a-z]*\) .*/\1/p')
[ "$(wc -w <<<"$commands")" -gt 10 ] || fail "the help lists few commands: $commands"

# The manual.
manual="$root/usr/share/man"
for page in cgs $(printf 'cgs-%s ' $commands); do
  [ -s "$manual/man1/$page.1.gz" ] || fail "there is no page $page"
  for part in NAME SYNOPSIS DESCRIPTION OPTIONS EXAMPLES 'EXIT STATUS' 'SEE ALSO'; do
    zcat "$manual/man1/$page.1.gz" | grep -qE "^\.SH \"?$part" || fail "$page(1) lacks $part"
  done
done
if is_there man; then
  for page in "$manual"/man1/*; do
    LC_ALL=C.UTF-8 man --warnings -l -E UTF-8 -Tutf8 -Z "$page" 2>"$work/man.log" >/dev/null
    if [ -s "$work/man.log" ]; then fail "$page: $(cat "$work/man.log")"; fi
  done
  LC_ALL=C.UTF-8 MANWIDTH=80 man -M "$manual" cgs-run >"$work/cgs-run.txt" 2>"$work/man.log"
  grep -q '^ *--preset TEXT' "$work/cgs-run.txt" || fail "man cgs-run does not tell of --preset"
  if grep -n '[.][.][A-Z(]\|\\f' "$work/cgs-run.txt"; then fail "cgs-run(1) shows its markup"; fi
fi
if is_there mandoc; then
  for page in "$manual"/man1/*; do
    # There is no date but that of SOURCE_DATE_EPOCH, and lines are as long as they are.
    zcat "$page" | mandoc -T lint -W warning | grep -v 'missing date' >"$work/mandoc.log" || true
    if [ -s "$work/mandoc.log" ]; then fail "$page: $(cat "$work/mandoc.log")"; fi
  done
fi

# Completion, by bash itself.
completion="$root/usr/share/bash-completion/completions/cgs"
offers() {  # offers EXPECTED WORD...: what is offered for the last of the words
  local found
  found=$(bash --norc -c 'source "$0"; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _cgs
                          echo "${COMPREPLY[*]}"' "$completion" "${@:2}")
  [ "$found" = "$1" ] || fail "for ${*:2} bash offers: $found; it should: $1"
}
offers run cgs ru
offers '--preset --preview' cgs run --pre
offers draft cgs run photos --preset d
offers fine cgs run photos --preset = f
offers 'plane sphere cylinder' cgs measure part.stl --fit ''
offers '' cgs run photos --preset x
offers '' cgs run photos/
for command in $commands; do offers --help cgs "$command" --hel; done
bash --norc -c 'source "$0"; complete -p cgs' "$completion" | grep -q -- '-o default' ||
  fail "bash does not offer files"
if is_there zsh; then zsh -n "$root/usr/share/zsh/vendor-completions/_cgs"; fi

# The Python module, of the package and of no other folder.
PYTHONPATH="$root/usr/lib/python3/dist-packages" /usr/bin/python3 - "$root" <<'PY'
import sys
import cgs
assert cgs.__file__.startswith(sys.argv[1]), cgs.__file__
mesh = cgs.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
volume = mesh.measure(volume=True)["volume"]["value"]
assert abs(volume - 1 / 6) < 1e-6, volume
PY

# A project of somebody else.
cmake -S "$sources/tests/consumer" -B "$work/consumer" -DCMAKE_PREFIX_PATH="$root/usr" \
  -DCMAKE_CXX_COMPILER="$compiler" >"$work/configure.log" 2>&1 || fail "$(cat "$work/configure.log")"
cmake --build "$work/consumer" >"$work/consumer.log" || fail "$(cat "$work/consumer.log")"
(cd "$work" && consumer/consumer)

if [ -n "$lintian" ]; then
  wait "$lintian" || fail "$(cat "$work/lintian.log")"
  cat "$work/lintian.log"
  echo "lintian: no error"
fi
