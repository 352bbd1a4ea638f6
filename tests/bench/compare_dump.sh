#!/usr/bin/env bash
# Compares bmudump with can-utils' log2long on one candump log, alternately and in the same run, so that both see the
# same machine. log2long only rewrites the bytes; bmudump also checks, decodes, names and scales every signal.
#
#   compare_dump.sh BIN_DIRECTORY [LINES] [RUNS]
#
# Prints median, fastest and slowest in frames a second, the ratio of the medians and the peak resident size. Exits
# non-zero if something does not work; a slow machine is no failure.
set -euo pipefail

bin=${1:?usage: compare_dump.sh BIN_DIRECTORY [LINES] [RUNS]}
lines=${2:-1000000}
runs=${3:-7}

fail() {
  echo "compare_dump: $*" >&2
  exit 1
}
command -v log2long >/dev/null || fail "log2long is missing: install can-utils"

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$bin/make_candump_log" "$lines" >"$work/log"
[[ $(wc -l <"$work/log") == "$lines" ]] || fail "the log has not $lines lines"
"$bin/bmudump" -r "$work/log" --summary --strict >"$work/summary" || fail "the log has frames that fail: $(cat "$work/summary")"

# Appends "SECONDS RESIDENT_KB STATUS" of one run to the file of its tool.
measure() {
  local tool=$1
  shift
  "$bin/run_measured" "$@" >>"$work/$tool"
}
once() {
  measure log2long sh -c "exec log2long <'$work/log'"
  measure bmudump "$bin/bmudump" -r "$work/log"
  measure bmudump_json "$bin/bmudump" -r "$work/log" --json
  measure bmudump_summary "$bin/bmudump" -r "$work/log" --summary
}

once
rm "$work"/log2long "$work"/bmudump*  # the first round only warms the page cache
for ((run = 0; run < runs; ++run)); do once; done

echo "$lines frames, $runs runs each, alternating; frames/s"
for tool in log2long bmudump bmudump_json bmudump_summary; do
  sort -n "$work/$tool" | awk -v tool="$tool" -v lines="$lines" '
    $3 != 0 { print tool " exited with " $3 > "/dev/stderr"; exit 1 }
    { seconds[NR] = $1; if ($2 > resident) resident = $2 }
    END {
      median = NR % 2 ? seconds[(NR + 1) / 2] : (seconds[NR / 2] + seconds[NR / 2 + 1]) / 2
      printf "%-16s median %10.0f  fastest %10.0f  slowest %10.0f  resident %d kB\n",
             tool, lines / median, lines / seconds[1], lines / seconds[NR], resident
      print median > "'"$work"'/median_" tool
    }' || fail "$tool does not work"
done
awk '{ median[NR] = $1 } END { printf "bmudump / log2long: %.2f\n", median[1] / median[2] }' \
  "$work/median_log2long" "$work/median_bmudump"
