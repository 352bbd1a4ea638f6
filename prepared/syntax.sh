#!/usr/bin/env bash
# syntax.sh FILE...: each by itself, without precompiled headers; prints what fails.
for f in "$@"; do
  [[ -f $f ]] || { echo "MISSING $f"; continue; }
  if nice -n 19 c++ -std=c++20 -fsyntax-only -I. -I/usr/include/eigen3 -DBMUD_VERSION='"0"' "$f" >/tmp/syntax28 2>&1; then echo "ok $f"; else echo "FAILED $f"; grep -m4 -E "error" /tmp/syntax28; fi
done
