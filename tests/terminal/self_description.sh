#!/usr/bin/env bash
# What the programs say of themselves to a shell and to man: completions offer what may come next, and a manual page has every
# option and command of --help.   usage: self_description.sh PROGRAM_FOLDER
set -euo pipefail

programs=$(realpath "$1")
status=0

complain() {
  echo "$*" >&2
  status=1
}

# What bash would offer for the last of these words; sorted, on one line.
offered_by_bash() {
  local name=$1
  (
    # shellcheck source=/dev/null
    source <("$programs/$name" --completion bash)
    # Only a shell with a person before it lets a completion change its options.
    # shellcheck disable=SC2317  # the completion calls it
    compopt() { :; }
    COMP_WORDS=("$@") COMP_CWORD=$(($# - 1)) COMPREPLY=()
    "_$name"
    printf '%s\n' "${COMPREPLY[@]}" | sort | paste -sd' '
  )
}

expect_offered() {
  local wanted=$1 found
  shift
  found=$(offered_by_bash "$@")
  [[ $found == "$wanted" ]] || complain "bash, behind '$*': found '$found', wanted '$wanted'"
}

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
mkdir folder
touch 'a pack.json' drive.log

expect_offered 'watch' bmuctl wat
expect_offered 'accept assign' bmuctl modules a
expect_offered '--unheard' bmuctl modules assign --u
expect_offered '--json' bmuctl cells --j
expect_offered 'always auto never' bmuctl --color ''
expect_offered 'a pack.json drive.log folder' bmuctl report ''
expect_offered 'a pack.json' bmud --config 'a '
expect_offered 'folder' bmud --record ''
expect_offered 'debug error info warning' bmud --log-level ''
expect_offered '' bmudump --count ''
expect_offered 'drive.log' bmureplay d
expect_offered 'eval fit health resistance' bmucell ''
expect_offered '--charger-bus --check' mmusim --ch
expect_offered '--scenario --second-pack-bus --seconds --seed' mmusim --s

expect_whole_page() {
  local program=$1 page=$2 word
  # Without what is drawn: a dash is \-.
  sed 's/\\-/-/g; s/\\f[BIR]//g' "$page" >"$page.text"
  for word in $("$programs/$program" --help | grep -oE '^ +(-[a-zA-Z],)?--[a-z-]+|^ {2}[a-z]{3,} {2,}' | grep -oE -- '--[a-z-]+|[a-z]{3,}'); do
    grep -qF -- "$word" "$page.text" || complain "the manual page of $program has no $word, which its --help has"
  done
  for word in NAME SYNOPSIS DESCRIPTION OPTIONS EXAMPLES 'EXIT STATUS'; do
    grep -qx ".SH $word" "$page" || complain "the manual page of $program has no section $word"
  done
  # Of the section OPTIONS: a command may have an option of the same name.
  word=$(awk '/^\.SH/ { is_in = $2 == "OPTIONS" } is_in && was_head && seen[$0]++ { print } { was_head = $0 == ".TP" }' "$page")
  [[ -z $word ]] || complain "the manual page of $program lists twice: $word"
}

for program in bmud bmuctl bmudump bmureplay bmucell mmusim; do
  "$programs/$program" --man-page >"$program.page"
  expect_whole_page "$program" "$program.page"
  if command -v groff >/dev/null; then
    warnings=$(groff -man -Tutf8 -ww -z "$program.page" 2>&1)
    [[ -z $warnings ]] || complain "groff on the manual page of $program: $warnings"
  fi
  "$programs/$program" --completion zsh >"$program.zsh"
  if command -v zsh >/dev/null; then zsh -n "$program.zsh" || complain "zsh refuses the completion of $program"; fi
done
"$programs/bmuctl" --completion fish >/dev/null 2>&1 && complain "a shell nobody knows was accepted"
exit $status
