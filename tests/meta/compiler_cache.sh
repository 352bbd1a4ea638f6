#!/usr/bin/env bash
# tests/ci/cached_gcc.sh and cached_clang.sh: a clone in another folder finds what was compiled here, and nothing that was compiled of
# other text: of a header that is precompiled, of a macro or a comment in it, or with other options. Exit status 77: the compiler or ccache
# is not installed.
#
# usage: tests/meta/compiler_cache.sh gcc|clang
set -euo pipefail

repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
case ${1:-} in
  # Of two things that ccache could find, an object and a precompiled header, it keeps only the former of clang.
  gcc) compilers=(CC=gcc CXX=g++) options='' all_hits=2 comment_hits=0 ;;
  clang) compilers=(CC=clang CXX=clang++) options='"SHELL:-Xclang -fno-pch-timestamp"' all_hits=1 comment_hits=1 ;;
  *) echo "usage: compiler_cache.sh gcc|clang" >&2; exit 2 ;;
esac
compiler=$1
for program in "${compilers[1]#CXX=}" ccache ninja; do
  command -v "$program" >/dev/null || { echo "skipped: $program is not installed"; exit 77; }
done
folder=$(mktemp -d "${TMPDIR:-/tmp}/bmud-compiler-cache.XXXXXX")
trap 'rm -rf "$folder"' EXIT
export CCACHE_DIR=$folder/cache
unset CCACHE_DISABLE CCACHE_READONLY CCACHE_RECACHE CCACHE_REMOTE_STORAGE CCACHE_CONFIGPATH CXXFLAGS

fail() {
  echo "compiler_cache.sh: $compiler: $*" >&2
  exit 1
}

# make_clone NAME: a project whose one source has a precompiled header
make_clone() {
  mkdir "$folder/$1"
  cat >"$folder/$1/CMakeLists.txt" <<CMAKE
cmake_minimum_required(VERSION 3.25)
project(cached LANGUAGES CXX)
set(CMAKE_CXX_COMPILER_LAUNCHER "$repository/tests/ci/cached_$compiler.sh" "\${CMAKE_SOURCE_DIR}" ccache)
add_executable(shown shown.cpp)
target_include_directories(shown PRIVATE "\${CMAKE_SOURCE_DIR}")
target_compile_options(shown PRIVATE $options -g1 -fmacro-prefix-map=\${CMAKE_SOURCE_DIR}/=)
target_precompile_headers(shown PRIVATE <cstdio> [["value.hpp"]])
CMAKE
  printf '#pragma once\n// one\n#define MACRO 1\ninline int value() { return 1; }\n' >"$folder/$1/value.hpp"
  # A header that others include, too: GCC knows by its content that it was in the precompiled one.
  printf '#include "value.hpp"\nint main() { return std::printf("%%d %%d\\n", MACRO, value()) < 0; }\n' >"$folder/$1/shown.cpp"
}

# build NAME [OPTION]: compiles from the start; prints what the program prints, then how many objects came from the cache
build() {
  rm -rf "$folder/$1/build"
  build_again "$@"
}
# The same, of what has changed since.
build_again() {
  ccache --zero-stats >/dev/null
  { env "${compilers[@]}" cmake -S "$folder/$1" -B "$folder/$1/build" -G Ninja "${@:2}" && cmake --build "$folder/$1/build"; } \
    >"$folder/log" 2>&1 || fail "$1 does not build: $(cat "$folder/log")"
  "$folder/$1/build/shown"
  ccache --print-stats | awk '$1 == "direct_cache_hit" || $1 == "preprocessed_cache_hit" { sum += $2 } END { print "hits:", sum + 0 }'
}

# expect WHAT FOUND VALUES HITS
expect() { [[ $2 == "$3"$'\n'"hits: $4" ]] || fail "$1: found '${2//$'\n'/, }', expected '$3, hits: $4'"; }

make_clone here
make_clone "there [b] + c"
expect "the first build compiles" "$(build here)" "1 1" 0
expect "a clone elsewhere finds it" "$(build "there [b] + c")" "1 1" "$all_hits"
sed -i 's/MACRO 1/MACRO 2/' "$folder/here/value.hpp"
expect "a macro of the header that has changed is compiled" "$(build here)" "2 1" 0
sed -i 's|// one|// two|' "$folder/here/value.hpp"
expect "a comment that has changed is known to the precompiled header" "$(build here)" "2 1" "$comment_hits"
sed -i 's/return 1/return 3/' "$folder/here/value.hpp"
expect "a function that has changed is compiled" "$(build here)" "2 3" 0
expect "other options are compiled" "$(build here -DCMAKE_CXX_FLAGS=-O1)" "2 3" 0
expect "what was there is found again" "$(build here)" "2 3" "$all_hits"
# An incremental build has the former precompiled header in the place of the new one.
sed -i 's/return 3/return 4/' "$folder/here/value.hpp"
expect "what has changed is compiled again" "$(build_again here)" "2 4" 0
cp "$folder/here/value.hpp" "$folder/there [b] + c/"
expect "a clone elsewhere finds that, too" "$(build "there [b] + c")" "2 4" "$all_hits"
