#!/usr/bin/env bash
# How large a recording of a drive is, and how fast bmureplay runs it again: the emulated 96 cells, driven for some time.
set -euo pipefail

usage() {
  cat <<'TEXT'
usage: tests/bench/replay_speed.sh BIN [SECONDS [RUNS]]

BIN is the folder with mmusim and bmureplay; SECONDS of driving (default 600), RUNS of each (default 5).

  tests/bench/replay_speed.sh build/bin
TEXT
}

[[ ${1:-} != --help ]] || { usage; exit 0; }
[[ $# -ge 1 && $# -le 3 ]] || { usage >&2; exit 2; }
bin=$1
seconds=${2:-600}
runs=${3:-5}

cd "$(dirname "${BASH_SOURCE[0]}")/../.."
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

cat >"$folder/drive.scn" <<'TEXT'
0       pack soc_permille 800
1       vehicle on
+4      load profile drive
TEXT
"$bin/mmusim" --pack config/packs/lfp-96s.json --with-master --scenario "$folder/drive.scn" --seconds "$seconds" --quiet \
  --record "$folder/drive.log" || [[ $? -eq 3 ]]
zstd --quiet -3 "$folder/drive.log" -o "$folder/drive.log.zst"
plain=$(stat -c %s "$folder/drive.log")
packed=$(stat -c %s "$folder/drive.log.zst")
awk -v plain="$plain" -v packed="$packed" -v seconds="$seconds" 'BEGIN {
  printf "96 cells, %d s: %.1f MB of text, %.1f MB packed in one piece; %.0f MB an hour packed\n",
         seconds, plain / 1e6, packed / 1e6, packed / 1e6 * 3600 / seconds }'
for threads in 1 2; do
  for ((run = 0; run < runs; ++run)); do
    "$bin/bmureplay" --json --threads "$threads" "$folder/drive.log" >"$folder/result.json"
    jq -r 'if .identical then .covered_s / .took_s else error("not identical") end' "$folder/result.json"
  done | sort -g | awk -v threads="$threads" '
    { times[NR] = $1 }
    END { printf "bmureplay --threads %d: %.0f times as fast as it happened (median of %d; %.0f to %.0f)\n",
                 threads, times[int((NR + 1) / 2)], NR, times[1], times[NR] }'
done
