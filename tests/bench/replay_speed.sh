#!/usr/bin/env bash
# How large a recording is, and how fast bmureplay runs it again: the emulated 96 cells, driven for some time, standing
# with closed contactors, and at rest.
set -euo pipefail

usage() {
  cat <<'TEXT'
usage: tests/bench/replay_speed.sh BIN [SECONDS [RUNS]]

BIN is the folder with mmusim and bmureplay; SECONDS of each (default 600), RUNS of each (default 5).

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

scenario() {
  echo '0 pack soc_permille 800'
  case $1 in
    driven) printf '1 vehicle on\n+4 load profile drive\n' ;;
    closed) printf '1 vehicle on\n' ;;
    "at rest") ;;
  esac
}

measure() {
  local state=$1 threads run
  scenario "$state" >"$folder/run.scn"
  rm -f "$folder"/run.log*
  "$bin/mmusim" --pack config/packs/lfp-96s.json --with-master --scenario "$folder/run.scn" --seconds "$seconds" --quiet \
    --record "$folder/run.log" || [[ $? -eq 3 ]]
  zstd --quiet -3 "$folder/run.log" -o "$folder/run.log.zst"
  awk -v state="$state" -v plain="$(stat -c %s "$folder/run.log")" -v packed="$(stat -c %s "$folder/run.log.zst")" \
    -v seconds="$seconds" 'BEGIN {
    printf "96 cells %s, %d s: %.1f MB of text, %.1f MB packed in one piece; %.0f MB an hour packed\n",
           state, seconds, plain / 1e6, packed / 1e6, packed / 1e6 * 3600 / seconds }'
  for threads in 1 2; do
    for ((run = 0; run < runs; ++run)); do
      "$bin/bmureplay" --json --threads "$threads" "$folder/run.log" >"$folder/result.json"
      jq -r 'if .identical then .covered_s / .took_s else error("not identical") end' "$folder/result.json"
    done | sort -g | awk -v threads="$threads" '
      { times[NR] = $1 }
      END { printf "bmureplay --threads %d: %.0f times as fast as it happened (median of %d; %.0f to %.0f)\n",
                   threads, times[int((NR + 1) / 2)], NR, times[1], times[NR] }'
  done
}

for state in driven closed "at rest"; do measure "$state"; done
