#!/usr/bin/env bash
# tools/test finds its tests in a folder that tools/demo has made without them, and tools/demo leaves them switched on.
# Configures only; nothing is built.
set -euo pipefail

repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
shared_folder=$(mktemp -d "${TMPDIR:-/tmp}/bmud-build-folder.XXXXXX")
trap 'rm -rf "$shared_folder"' EXIT

# usage: configure_as SCRIPT FUNCTION: as that script does it, each in a shell of its own
configure_as() {
  # shellcheck disable=SC1090,SC2034  # both scripts are checked by themselves, and read $build
  if ! (source "$repository/tools/$1" && build=$shared_folder && "$2") >"$shared_folder/log" 2>&1; then
    cat "$shared_folder/log" >&2
    exit 1
  fi
}

# usage: want_tests ON|OFF WHEN
want_tests() {
  grep -qx "BMUD_TESTS:BOOL=$1" "$shared_folder/CMakeCache.txt" && return
  echo "build_folder.sh: $2: found $(grep BMUD_TESTS "$shared_folder/CMakeCache.txt"), wanted $1" >&2
  exit 1
}

configure_as demo configure_programs
want_tests OFF "tools/demo in a new folder"
configure_as test configure_with_tests
want_tests ON "tools/test after tools/demo"
configure_as demo configure_programs
want_tests ON "tools/demo after tools/test"
