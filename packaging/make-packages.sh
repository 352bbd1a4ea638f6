#!/usr/bin/env bash
# Makes Debian packages of what is built, and lets lintian look at them: an error or a warning of its ends this with 1.
set -euo pipefail

repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# shellcheck source-path=SCRIPTDIR source=../tools/packages.sh
source "$repository/tools/packages.sh"

build=$repository/build
out=''

usage() {
  cat <<'TEXT'
usage: packaging/make-packages.sh [--build DIR] [--out DIR]

Installs what is missing, builds, and makes the packages bmud, bmud-tools and mmusim.

  --build DIR  where to build (default: build)
  --out DIR    where the packages go (default: packages in the build folder)

  packaging/make-packages.sh && sudo apt install ./build/packages/*.deb
TEXT
}

wrong_usage() {
  echo "make-packages.sh: $* (see packaging/make-packages.sh --help)" >&2
  exit 2
}

while [[ $# -gt 0 ]]; do
  case $1 in
    --build) build=$(realpath -m "${2:?--build needs a folder}"); shift 2 ;;
    --out) out=$(realpath -m "${2:?--out needs a folder}"); shift 2 ;;
    -h | --help) usage; exit 0 ;;
    *) wrong_usage "unknown argument '$1'" ;;
  esac
done
out=${out:-$build/packages}

packages_install build package
# A folder that is configured keeps its tests, or goes on without them.
[[ -f $build/CMakeCache.txt ]] || cmake -S "$repository" -B "$build" -G Ninja -DBMUD_TESTS=OFF
cmake --build "$build" --parallel 2 --target bmud bmuctl bmudump bmureplay bmucell mmusim descriptions changelogs
grep -q '^LOWDOWN:.*/lowdown$' "$build/CMakeCache.txt" || { cmake "$build"; cmake --build "$build" --target descriptions; }

rm -rf "$out"
mkdir -p "$out"
cpack --config "$build/CPackConfig.cmake" -G DEB -B "$out" >"$out/cpack.log" 2>&1 ||
  { cat "$out/cpack.log" >&2; exit 1; }
rm -rf "$out/_CPack_Packages"
# As root or not, the packages are the same.
# The packages are not uploaded to Debian, so their changelog closes no bug there.
lintian --allow-root --fail-on error,warning --suppress-tags initial-upload-closes-no-bugs "$out"/*.deb
ls "$out"/*.deb
