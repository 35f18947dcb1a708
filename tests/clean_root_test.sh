#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Installs the packages in a Debian 12 that has nothing else, and runs the example of the README
# there, as a user that is not root and has no network. Prints how large it all is: the same as the
# image of samples/container/Dockerfile, which is made alike. By hand, as root, with debootstrap and
# a network; five minutes, and ten more with --libraries, which also builds somebody else's project
# with libcgs-dev.
#
# usage: clean_root_test.sh PACKAGES CAPTURE ROOT [--libraries]
#   PACKAGES  where `cpack -G DEB` wrote (build/release)
#   CAPTURE   what cgs_make_capture wrote (out/capture)
#   ROOT      a folder to make the system in, and to delete
set -euo pipefail
sources="$(cd "$(dirname "$0")/.." && pwd)"
packages="$1" capture="$2" root="$3" more="${4:-}"
if [ "$(id -u)" -ne 0 ] || ! command -v debootstrap >/dev/null; then
  echo "skipped: needs root, and debootstrap"
  exit 77
fi
[ ! -e "$root" ] || { echo "$root is there already" >&2; exit 2; }
log=$(mktemp)
trap 'rm -rf --one-file-system "$root" "$log"' EXIT

quietly() { "$@" >"$log" 2>&1 || { tail -40 "$log" >&2; exit 1; }; }
within() { env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8 chroot "$root" "$@"; }
as_user() {  # without any network
  env -i PATH=/usr/sbin:/usr/bin:/bin HOME=/home/user LC_ALL=C.UTF-8 \
    unshare -n chroot --userspec=1000:1000 "$root" sh -c "cd /home/user && $1"
}
install_packages() {  # install_packages NAME...: ours are those of PACKAGES
  quietly within apt-get install -y -q --no-install-recommends "$@"
  within apt-get clean
}
size() { du -sxB MB --exclude="$root"/{packages,home,var/lib/apt/lists} "$root" | cut -f1; }

quietly debootstrap --variant=minbase bookworm "$root"
# As the slim image of Debian: neither pages, nor guides, nor translations.
cat >"$root/etc/dpkg/dpkg.cfg.d/slim" <<'EOF'
path-exclude=/usr/share/man/*
path-exclude=/usr/share/doc/*
path-include=/usr/share/doc/*/copyright
path-exclude=/usr/share/locale/*
EOF
cp "$sources/samples/container/left_out" "$root/etc/dpkg/dpkg.cfg.d/"
find "$root/usr/share/doc" -type f ! -name copyright -delete
rm -rf "$root"/usr/share/{man,locale}/* "$root"/var/lib/apt/lists/* "$root"/var/cache/apt/*
echo "bare system: $(size)"

mkdir "$root/packages"
cp "$packages"/{cgs,libcgs-dev,python3-cgs}_*_amd64.deb "$root/packages"
quietly within apt-get update -qq
install_packages $(cd "$root" && ls packages/cgs_*.deb | sed 's|^|/|')
echo "with cgs: $(size)"

within useradd --create-home --uid 1000 user
cp -r "$capture" "$root/home/user/capture"
within chown -R 1000:1000 /home/user
as_user "cgs --version && cgs run capture --views view_01,view_02,view_03 --assume-unit m -o out/portal -q &&
         cgs verify out/portal && ls -s out/portal/report.html"
echo "the example ran"

install_packages $(cd "$root" && ls packages/python3-cgs_*.deb | sed 's|^|/|')
as_user "python3 -c 'import cgs; print(cgs.read_model(\"out/portal/model\").input)'"
echo "with python3-cgs: $(size)"

if [ "$more" = "--libraries" ]; then
  install_packages $(cd "$root" && ls packages/libcgs-dev_*.deb | sed 's|^|/|') g++ cmake make
  cp -r "$sources/tests/consumer" "$root/home/user/consumer"
  as_user "cmake -S consumer -B build >configure.log 2>&1 && cmake --build build >build.log 2>&1 && build/consumer" ||
    { tail -30 "$root"/home/user/*.log >&2; exit 1; }
  echo "a project was built with libcgs-dev"
fi
