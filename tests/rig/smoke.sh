#!/bin/bash
# Guest script: proves the rig itself. candump records on vcan0 exactly what cansend sent. With "--exit N" it ends with N instead,
# with "--hang" it never ends, to prove that both are seen as what they are.
# shellcheck source-path=SCRIPTDIR source=guest-env.sh
source "$(dirname "$0")/guest-env.sh"

case ${1:-} in
  --exit) step "ending with status $2 on purpose"; exit "$2" ;;
  --hang) step "hanging on purpose"; sleep infinity ;;
esac

frames=(123#DEADBEEF 080#008F000000002A1F 040#06F9000000000575 143#R 1ABCDE55#0102)

step "vcan0 is there"
expect "vcan0 is up" grep -q UP <(ip -o link show vcan0)

step "record what is sent"
record smoke vcan0
for frame in "${frames[@]}"; do cansend vcan0 "$frame"; done
wait_for 10 "the last frame was recorded" grep -q " ${frames[-1]}\$" "$RIG_OUT/smoke.can.log"
stop smoke || true
printf '%s\n' "${frames[@]}" >"$RIG_OUT/sent"
awk '{ print $3 }' "$RIG_OUT/smoke.can.log" >"$RIG_OUT/received"
expect "every frame once, in order" cmp "$RIG_OUT/sent" "$RIG_OUT/received"
