#!/usr/bin/env bash
# tests/ci/cached_clang.sh: a clone in another folder finds what was compiled here, and nothing that was compiled of other text: of a
# header that is precompiled, of a macro in it, or with other options. Exit status 77: clang or ccache is not installed.
set -euo pipefail

repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
for program in clang++ ccache ninja; do
  command -v "$program" >/dev/null || { echo "skipped: $program is not installed"; exit 77; }
done
folder=$(mktemp -d "${TMPDIR:-/tmp}/bmud-cached-clang.XXXXXX")
trap 'rm -rf "$folder"' EXIT
export CCACHE_DIR=$folder/cache
unset CCACHE_DISABLE CCACHE_READONLY CCACHE_RECACHE CCACHE_REMOTE_STORAGE CCACHE_CONFIGPATH CXXFLAGS

fail() {
  echo "cached_clang.sh: $*" >&2
  exit 1
}

# make_clone NAME: a project whose one source has a precompiled header
make_clone() {
  mkdir "$folder/$1"
  cat >"$folder/$1/CMakeLists.txt" <<CMAKE
cmake_minimum_required(VERSION 3.25)
project(cached LANGUAGES CXX)
set(CMAKE_CXX_COMPILER_LAUNCHER "$repository/tests/ci/cached_clang.sh" "\${CMAKE_SOURCE_DIR}" ccache)
add_executable(shown shown.cpp)
target_include_directories(shown PRIVATE "\${CMAKE_SOURCE_DIR}")
target_compile_options(shown PRIVATE "SHELL:-Xclang -fno-pch-timestamp" -g1)
target_precompile_headers(shown PRIVATE <cstdio> [["value.hpp"]])
CMAKE
  printf '#pragma once\n#define MACRO 1\ninline int value() { return 1; }\n' >"$folder/$1/value.hpp"
  printf 'int main() { return std::printf("%%d %%d\\n", MACRO, value()) < 0; }\n' >"$folder/$1/shown.cpp"
}

# build NAME [OPTION]: compiles from the start; prints what the program prints, then how many objects came from the cache
build() {
  rm -rf "$folder/$1/build"
  ccache --zero-stats >/dev/null
  { CC=clang CXX=clang++ cmake -S "$folder/$1" -B "$folder/$1/build" -G Ninja "${@:2}" && cmake --build "$folder/$1/build"; } \
    >"$folder/log" 2>&1 || fail "$1 does not build: $(cat "$folder/log")"
  "$folder/$1/build/shown"
  ccache --print-stats | awk '$1 == "direct_cache_hit" || $1 == "preprocessed_cache_hit" { sum += $2 } END { print "hits:", sum + 0 }'
}

# expect WHAT FOUND VALUES HITS
expect() { [[ $2 == "$3"$'\n'"hits: $4" ]] || fail "$1: found '${2//$'\n'/, }', expected '$3, hits: $4'"; }

make_clone here
make_clone "there [b] + c"
expect "the first build compiles" "$(build here)" "1 1" 0
expect "a clone elsewhere finds it" "$(build "there [b] + c")" "1 1" 1
sed -i 's/MACRO 1/MACRO 2/' "$folder/here/value.hpp"
expect "a macro of the header that has changed is compiled" "$(build here)" "2 1" 0
sed -i 's/return 1/return 3/' "$folder/here/value.hpp"
expect "a function that has changed is compiled" "$(build here)" "2 3" 0
expect "other options are compiled" "$(build here -DCMAKE_CXX_FLAGS=-O1)" "2 3" 0
expect "what was there is found again" "$(build here)" "2 3" 1
