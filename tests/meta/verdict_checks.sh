# shellcheck shell=bash
# For the scripts that check what is kept of a tool's verdicts. The caller's `look` runs the check with a made tool, which notes in
# $folder/looked the sources that it is asked to look at.

folder=$(mktemp -d "${TMPDIR:-/tmp}/bmud-verdicts.XXXXXX")
trap 'rm -rf "$folder"' EXIT
export XDG_CACHE_HOME=$folder/cache

fail() {
  echo "${0##*/}: $*" >&2
  exit 1
}

# expect WHAT LOOKED STATUS [ARGUMENTS...]: which sources it looks at, and how it ends
expect() {
  local what=$1 looked=$2 expected=$3 status=0 found
  shift 3
  : >"$folder/looked"
  look "$@" >"$folder/out" 2>&1 || status=$?
  found=$(sort "$folder/looked" | paste -sd' ')
  [[ $found == "$looked" ]] || fail "$what: found that it looks at '$found', expected '$looked': $(cat "$folder/out")"
  [[ $status -eq $expected ]] || fail "$what: found status $status, expected $expected: $(cat "$folder/out")"
}

# make_old: as if nothing had asked for what is kept for more than 30 days
make_old() {
  find "$XDG_CACHE_HOME" -type f -exec touch -d '31 days ago' {} +
}
# expect_kept COUNT: how many are left
expect_kept() {
  local kept
  kept=$(find "$XDG_CACHE_HOME" -type f | wc -l)
  [[ $kept -eq $1 ]] || fail "found $kept verdicts kept, expected $1: what nothing asks for goes after 30 days"
}
