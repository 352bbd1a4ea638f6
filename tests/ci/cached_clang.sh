#!/usr/bin/env bash
# Compiler launcher of CMake for clang: ccache, so that a clone in another folder finds what was compiled here although clang writes the
# folder into a precompiled header. ccache then takes a checksum beside that header for its content: of the preprocessed text without the
# folder, macros included.
#
# What a debugger shows of an object that was found may name the other clone's folder.
#
# usage: tests/ci/cached_clang.sh SOURCE_FOLDER CCACHE CLANG ARGUMENTS...
set -euo pipefail

# Objects name sources relative to this folder, wherever it is.
export CCACHE_BASEDIR=$1 CCACHE_NOHASHDIR=1 CCACHE_SLOPPINESS=pch_defines,time_macros CCACHE_PCH_EXTSUM=1
# A file that is the same by inode, size and time of change is hashed once.
export CCACHE_INODECACHE=1
ccache=$2
shift 2

# The folder as a pattern of sed.
# shellcheck disable=SC2001  # a class of characters
folder_pattern=$(sed 's/[][\.*^$|]/\\&/g' <<<"$CCACHE_BASEDIR")

# read_command ARGUMENTS...: of a command that writes a precompiled header; sets the header, and the command that preprocesses it
read_command() {
  preprocess=()
  header=''
  while [[ $# -gt 0 ]]; do
    case "$1 ${2:-}" in
      "-Xclang -emit-pch") shift 2 ;;
      "-o "*) header=$2; shift 2 ;;
      "-MF "* | "-MT "*) shift 2 ;;
      "-MD "* | "-c "*) shift ;;
      *) preprocess+=("$1"); shift ;;
    esac
  done
  preprocess+=(-E -dD)
}

checksum() { { "${preprocess[@]}"; printf '%s\n' "${preprocess[@]}"; } | sed "s|$folder_pattern|.|g" | sha256sum; }

if [[ " $* " == *" -Xclang -emit-pch "* ]]; then
  read_command "$@"
  rm -f "$header.sum"
  before=$(checksum)
  # Not by ccache: it holds the folder, and one of another clone would be refused.
  "$@"
  # Of a text that was edited meanwhile there is no checksum: ccache then goes by the precompiled header itself.
  [[ $(checksum) != "$before" ]] || echo "$before" >"$header.sum"
  exit
fi

# CMake includes the header's text, too, for compilers that have not read the precompiled one; its path is absolute.
if [[ " $* " == *" -Xclang -include-pch -Xclang "* ]]; then
  arguments=()
  while [[ $# -gt 0 ]]; do
    if [[ $# -ge 4 && "$1 $2 $3" == "-Xclang -include -Xclang" && $4 == */cmake_pch.hxx ]]; then
      shift 4
    else
      arguments+=("$1")
      shift
    fi
  done
  set -- "${arguments[@]}"
fi
exec "$ccache" "$@"
