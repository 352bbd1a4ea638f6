#!/usr/bin/env bash
# Lets libFuzzer look for inputs that break a promise of a parser, and says how far it came.
set -euo pipefail

repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
build=$repository/build-fuzz
seconds=60
seed=$((RANDOM + 1))
keeps=no
jobs=2
targets=()

usage() {
  cat <<'TEXT'
usage: tests/fuzz/explore.sh [--seconds S] [--build DIR] [--seed N] [--keep] [TARGET...]

Builds the fuzz targets with clang, lets each explore for S seconds, two at a time, and prints a line for each. Ends with
1 if one has found an input that breaks a promise, crashes, or takes too long or too much memory: the input stays in
DIR/fuzz/TARGET/, and the one command that repeats it is printed.

  --seconds S  for each target (default: 60)
  --build DIR  where to build, and where what was found stays for the next time (default: build-fuzz)
  --seed N     of libFuzzer's random numbers; else another one each time, which is printed
  --keep       adds what covers more than the committed corpora to them, as few and small inputs as do it

  tests/fuzz/explore.sh                          all targets, a minute each
  tests/fuzz/explore.sh --seconds 15             the short look that CI takes
  tests/fuzz/explore.sh --seconds 600 pack cell  ten minutes for what reads configurations
  build-fuzz/bin/fuzz_pack FILE                  one input once more

Targets are the files of tests/fuzz with a folder in tests/fuzz/corpora; docs/testing.md says what each is for. Columns:
inputs tried, and in a second; inputs that each cover something the others do not; edges of the program's control flow
covered of all that are linked into it; and the same of the parser's own files.
TEXT
}

wrong_usage() {
  echo "explore.sh: $* (see tests/fuzz/explore.sh --help)" >&2
  exit 2
}

# The parser's own files, for the last column: a pattern over their paths.
declare -A parser_files=(
  [candump]='protocol/candump\.'
  [cell]='config/(cell_|charge_plateau|derating_reader|fields|json_reader|list_fields)'
  [core_image]='daemon/core/core_image\.|protocol/(image|fields|enumerators)\.'
  [dump]='tools/bmudump/|protocol/candump\.'
  [frames]='protocol/(receive_check|signal|message|bits)\.'
  [history_pages]='daemon/history/(stray_rows|row_blob|history_reader|history_lives|history_row|history_columns)\.'
  [insulation]='protocol/ir155\.'
  [pack]='config/'
  [packed]='tools/common/(packed_text|frame_decoder|line_reader)\.'
  [record_line]='daemon/recording/record_line\.|protocol/candump\.'
  [recording]='daemon/recording/'
  [reply]='tools/bmuctl/|tools/common/(page|canvas)\.'
  [requests]='daemon/shell/(status_|why_|faults_|health_|modules_|balance_|freeze_).*'
  [script]='mmu/scenario'
  [serial]='daemon/shell/serial_'
  [state]='daemon/shell/state_'
  [table]='tools/bmucell/csv_file\.|libfccp/'
)

parse_arguments() {
  while [[ $# -gt 0 ]]; do
    case $1 in
      --seconds | --build | --seed)
        [[ $# -ge 2 ]] || wrong_usage "$1 needs a value"
        case $1 in
          --seconds) seconds=$2 ;;
          --build) build=$(realpath -m "$2") ;;
          --seed) seed=$2 ;;
        esac
        shift 2 ;;
      --keep) keeps=yes; shift ;;
      -h | --help) usage; exit 0 ;;
      -*) wrong_usage "unknown option '$1'" ;;
      *)
        [[ -v parser_files[$1] ]] || wrong_usage "no target '$1': there are ${!parser_files[*]}"
        targets+=("$1")
        shift ;;
    esac
  done
  [[ $seconds =~ ^[1-9][0-9]*$ && $seed =~ ^[1-9][0-9]*$ ]] || wrong_usage "seconds and seed are whole numbers above 0"
  if [[ ${#targets[@]} -eq 0 ]]; then mapfile -t targets < <(printf '%s\n' "${!parser_files[@]}" | sort); fi
}

build_targets() {
  local log=$build/explore-build.log
  mkdir -p "$build"
  if ! { CC=clang CXX=clang++ cmake -S "$repository" -B "$build" -G Ninja -DBMUD_FUZZ=ON &&
    cmake --build "$build" --parallel "$jobs" --target "${targets[@]/#/fuzz_}"; } >"$log" 2>&1; then
    tail -n 40 "$log" >&2
    return 1
  fi
}

# The sanitizer runtime of older clang fails now and then where the kernel spreads addresses widely.
run_target() {
  local target=$1
  shift
  local run=("$build/bin/fuzz_$target" -timeout=30 -rss_limit_mb=2048 "$@")
  local dictionary=$repository/tests/fuzz/dictionaries/$target.dict
  [[ ! -f $dictionary ]] || run+=(-dict="$dictionary")
  if setarch --addr-no-randomize true 2>/dev/null; then run=(setarch --addr-no-randomize "${run[@]}"); fi
  # A core is 2 MB: as many of them as usual need not be kept to catch who still uses them.
  ASAN_OPTIONS=quarantine_size_mb=64 "${run[@]}"
}

explore() {
  local target=$1 work=$build/fuzz/$1
  mkdir -p "$work/found"
  rm -f "$work/failed" "$work"/{crash,timeout,oom,leak,slow-unit}-*
  run_target "$target" -max_total_time="$seconds" -seed="$seed" -print_final_stats=1 -artifact_prefix="$work/" \
    "$work/found" "$repository/tests/fuzz/corpora/$target" >"$work/log" 2>&1 || touch "$work/failed"
  # Which functions were reached, once more over all inputs: it needs a process that ends by itself.
  run_target "$target" -runs=0 -print_coverage=1 "$work/found" "$repository/tests/fuzz/corpora/$target" \
    >"$work/coverage" 2>&1 || true
}

explore_all() {
  local running=0 target
  for target in "${targets[@]}"; do
    if [[ $running -ge $jobs ]]; then
      wait -n
      running=$((running - 1))
    fi
    explore "$target" &
    running=$((running + 1))
  done
  wait
}

# The last number behind a word in libFuzzer's log.
number_behind() {
  grep -oE "$1 *[0-9]+" "$2" | tail -n 1 | grep -oE '[0-9]+$' || echo 0
}

# "87 % of 1234": edges of the functions in the parser's own files.
parser_coverage() {
  awk -v files="/(${parser_files[$1]})" '
    /COVERED_FUNC: / && $NF ~ files {
      for (i = 1; i < NF; ++i) if ($i == "edges:") { split($(i + 1), edges, "/"); taken += edges[1]; all += edges[2] }
    }
    END { if (all > 0) printf "%d %% of %d", 100 * taken / all, all; else printf "-" }' "$build/fuzz/$1/coverage"
}

print_table() {
  local target work
  printf '%-14s %11s %8s %7s %16s  %s\n' target executions per_s inputs edges 'of the parser'
  for target in "${targets[@]}"; do
    work=$build/fuzz/$target
    printf '%-14s %11s %8s %7s %7s of %5s  %s%s\n' "$target" \
      "$(number_behind 'stat::number_of_executed_units:' "$work/log")" \
      "$(number_behind 'stat::average_exec_per_sec:' "$work/log")" \
      "$(number_behind ' corp:' "$work/coverage")" \
      "$(number_behind ' cov:' "$work/coverage")" \
      "$(number_behind 'Loaded 1 modules +[(]' "$work/log")" \
      "$(parser_coverage "$target")" \
      "$([[ ! -f $work/failed ]] || echo '  FAILED')"
  done
}

tell_failures() {
  local target work input status=0
  for target in "${targets[@]}"; do
    work=$build/fuzz/$target
    [[ -f $work/failed ]] || continue
    status=1
    echo "fuzz_$target: $(grep -m 1 -E 'does not hold|runtime error|assertion|ERROR: ' "$work/log" || tail -n 1 "$work/log")"
    input=$(find "$work" -maxdepth 1 -type f -regex '.*/\(crash\|timeout\|oom\|leak\)-[0-9a-f]+' | head -n 1)
    echo "  to repeat: $build/bin/fuzz_$target ${input:-"(no input was kept: see $work/log)"}"
  done
  return "$status"
}

# Those that cover something the committed ones do not, under names of what they were made by.
keep_inputs() {
  local target work input
  for target in "${targets[@]}"; do
    work=$build/fuzz/$target
    rm -rf "$work/more"
    mkdir "$work/more"
    cp "$repository/tests/fuzz/corpora/$target"/* "$work/more/"
    run_target "$target" -merge=1 -max_len=2048 "$work/more" "$work/found" >"$work/merge" 2>&1 || true
    for input in "$work/more"/*; do
      [[ ! -f $repository/tests/fuzz/corpora/$target/${input##*/} ]] || continue
      cp "$input" "$repository/tests/fuzz/corpora/$target/found-$(basename "$input" | cut -c 1-12)"
    done
  done
}

main() {
  parse_arguments "$@"
  build_targets
  echo "seed $seed, $seconds s for each target"
  explore_all
  print_table
  if [[ $keeps == yes ]]; then keep_inputs; fi
  tell_failures
}

main "$@"
