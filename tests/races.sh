#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Looks for data races: what works in threads is built with ThreadSanitizer, and so is TBB, from
# Debian's source, for how the packaged one hands work from thread to thread would not be seen and
# all of it be reported. The source is fetched once and kept in build/race.
#
# usage: tests/races.sh [SOURCE...]   such as tests/meshing/volume/tsdf_test.cpp, of those that share a
#                                     program; if nothing is said, those that set a number of threads
set -euo pipefail
cd "$(dirname "$0")/.."

# Debian's source of TBB, without touching the lists of packages of this machine.
fetch_tbb() {
  local folder=$1 sources=/etc/apt/sources.list.d
  local apt=(-o "Dir::Etc::SourceList=/dev/null" -o "Dir::Etc::SourceParts=$folder/parts"
    -o "Dir::State::Lists=$folder/lists" -o "Dir::Cache=$folder/cache" -o APT::Sandbox::User=)
  mkdir -p "$folder"/{parts,lists/partial,cache/archives/partial}
  # Either form may be missing.
  { cat /etc/apt/sources.list $sources/*.list 2>/dev/null || true; } |
    sed -n 's/^deb /deb-src /p' >"$folder/parts/source.list"
  { cat $sources/*.sources 2>/dev/null || true; } |
    sed 's/^Types:.*/Types: deb-src/' >"$folder/parts/source.sources"
  apt-get "${apt[@]}" -qq update || true # one list that cannot be had does not matter
  (cd "$folder" && apt-get "${apt[@]}" -qq source --download-only onetbb)
  tar -C "$folder" --strip-components=1 -xf "$folder"/onetbb_*.orig.tar.xz
}

samples/install.sh --tests
tbb=$PWD/build/race/tbb
if [ ! -f "$tbb/CMakeLists.txt" ]; then
  echo "fetching the source of TBB"
  fetch_tbb "$tbb"
fi
cmake -G Ninja -S "$tbb" -B "$tbb/build" -DCMAKE_CXX_COMPILER=clang++-14 -DCMAKE_C_COMPILER=clang-14 \
  -DCMAKE_BUILD_TYPE=RelWithDebInfo -DTBB_TEST=OFF -DTBB_STRICT=OFF -DTBBMALLOC_BUILD=OFF \
  -DTBB_SANITIZE=thread -DTBB_OUTPUT_DIR_BASE=lib >/dev/null
cmake --build "$tbb/build"

if [ $# -gt 0 ]; then
  sources=("$@")
else
  mapfile -t sources < <(grep -rl max_allowed_parallelism tests --include='*_test.cpp' | sort)
fi
# tests/meshing/volume/tsdf_test.cpp is in meshing_tests
mapfile -t programs < <(printf '%s\n' "${sources[@]}" | sed -E 's|^tests/([^/]+)/.*|\1_tests|' | sort -u)
cmake --preset race >/dev/null
cmake --build --preset race --target "${programs[@]}"

status=0
report=$PWD/build/race/report # standard error is closed while images are decoded
for source in "${sources[@]}"; do
  name=${source#tests/}
  log=build/race/${name//\//_}.log
  verdict=clean
  rm -f "$report".*
  LD_LIBRARY_PATH="$tbb/build/lib_relwithdebinfo" \
    TSAN_OPTIONS="halt_on_error=1 suppressions=tests/races.supp log_path=$report" \
    tests/one.sh "build/race/bin/${name%%/*}_tests" "$source" >"$log" 2>&1 || verdict="FAILED, see $log"
  cat "$report".* >>"$log" 2>/dev/null || true
  if grep -q "Running 0 tests" "$log"; then verdict="NOT IN ${name%%/*}_tests"; fi
  printf '%-55s %s\n' "$source" "$verdict"
  [ "$verdict" = clean ] || status=1
done
exit $status
