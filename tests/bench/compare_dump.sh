#!/usr/bin/env bash
# Compares bmudump with can-utils' log2long on one candump log, alternately and in the same run, so that both see the
# same machine. log2long only rewrites the bytes; bmudump also checks, decodes, names and scales every signal.
#
#   compare_dump.sh BIN_DIRECTORY [LINES] [RUNS] [STARTS]
#
# Prints median, fastest and slowest in frames a second and the peak resident size; the ratios to log2long; and how long it
# takes from the start of bmudump to the end of a run that shows one line, STARTS times. Exits non-zero if something does
# not work or takes more than 32 MB; a slow machine is no failure.
set -euo pipefail

bin=${1:?usage: compare_dump.sh BIN_DIRECTORY [LINES] [RUNS]}
lines=${2:-1000000}
runs=${3:-7}
starts=${4:-101}
resident_max_kB=32768

fail() {
  echo "compare_dump: $*" >&2
  exit 1
}
command -v log2long >/dev/null || fail "log2long is missing: install can-utils"
command -v zstd >/dev/null || fail "zstd is missing: install zstd"

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$bin/make_candump_log" "$lines" >"$work/log"
[[ $(wc -l <"$work/log") == "$lines" ]] || fail "the log has not $lines lines"
"$bin/bmudump" -r "$work/log" --summary --strict >"$work/summary" || fail "the log has frames that fail: $(cat "$work/summary")"

zstd -q -10 "$work/log" -o "$work/log.zst"

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
  measure bmudump_zstd "$bin/bmudump" -r "$work/log.zst"
}

once
rm "$work"/log2long "$work"/bmudump*  # the first round only warms the page cache
for ((run = 0; run < runs; ++run)); do once; done

echo "$lines frames, $runs runs each, alternating; frames/s"
for tool in log2long bmudump bmudump_json bmudump_summary bmudump_zstd; do
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
for tool in bmudump bmudump_json bmudump_summary bmudump_zstd; do
  awk -v tool="$tool" '{ median[NR] = $1 } END { printf "%s / log2long: %.2f\n", tool, median[1] / median[2] }' \
    "$work/median_log2long" "$work/median_$tool"
  awk -v max="$resident_max_kB" '$2 > max { exit 1 }' "$work/$tool" || fail "$tool took more than $resident_max_kB kB"
done

for ((run = 0; run < starts; ++run)); do measure first_line "$bin/bmudump" -r "$work/log" -n 1; done
sort -n "$work/first_line" | awk '
  $3 != 0 { exit 1 }
  { ms[NR] = $1 * 1000 }
  END { printf "start to the first line, and the end: median %.1f ms, fastest %.1f, slowest %.1f of %d\n",
               ms[int((NR + 1) / 2)], ms[1], ms[NR], NR }' || fail "bmudump -n 1 does not work"
