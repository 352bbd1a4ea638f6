#!/usr/bin/env bash
# One recording through bmudump: exits non-zero if a line is damaged, a frame unknown or failed, or if the summary is
# not the one in the .expected file beside it.
#
#   check_fixture.sh BMUDUMP FIXTURE [--rewrite]
#
# --rewrite writes the .expected file anew; look at the difference before you commit it, and say why.
set -euo pipefail

bmudump=${1:?usage: check_fixture.sh BMUDUMP FIXTURE [--rewrite]}
fixture=${2:?usage: check_fixture.sh BMUDUMP FIXTURE [--rewrite]}
expected=${fixture%.log}.expected

for key in Name Origin Pack Date Shows Requirement; do
  grep -q "^# $key: ." "$fixture" || { echo "$fixture has no header line '# $key:'" >&2; exit 1; }
done
summary=$("$bmudump" -r "$fixture" --summary --strict) || { echo "$summary"; exit 1; }
if [[ ${3:-} == --rewrite ]]; then
  echo "$summary" >"$expected"
elif [[ -e $expected ]]; then
  diff -u "$expected" - <<<"$summary"
fi
