#!/usr/bin/env bash
# Compiler launcher of CMake for GCC: ccache, so that a clone in another folder finds what was compiled here.
#
# A precompiled header is found by the content of all that it includes (ccache's depend mode), never by its preprocessed text, which has no
# comments: GCC notes the checksum of each file in it, and takes a file in which only a comment differs for one that it has not read.
#
# usage: tests/ci/cached_gcc.sh SOURCE_FOLDER CCACHE GCC ARGUMENTS...
set -euo pipefail

# Objects name sources relative to this folder, wherever it is. ccache hashes a precompiled header like any other file if it may ignore
# what macros of time and of the header could change: no source here uses the former, and GCC itself refuses a header that was made with
# other macros.
export CCACHE_BASEDIR=$1 CCACHE_NOHASHDIR=1 CCACHE_SLOPPINESS=pch_defines,time_macros
# A file that is the same by inode, size and time of change is hashed once: the precompiled headers have 100 MB, and each of 440 sources
# asks for one.
export CCACHE_INODECACHE=1
ccache=$2
shift 2

if [[ " $* " == *" -x c++-header "* ]]; then
  # ccache would count the former one in its place to what the new one is made of: no other folder would find it.
  arguments=("$@")
  for ((i = 0; i + 1 < $#; ++i)); do [[ ${arguments[i]} != -o ]] || rm -f "${arguments[i + 1]}"; done
  # Entries that were made without depend mode do not count: they may name the header of another text.
  export CCACHE_DEPEND=1 CCACHE_NAMESPACE=precompiled-by-content
fi
exec "$ccache" "$@"
