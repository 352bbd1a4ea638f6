#!/usr/bin/env bash
# The module unit is fit for a microcontroller: all it is made of, linked together, asks nothing of other code but to
# move memory and to do arithmetic. No exceptions, no heap, no output, no abort.
#
#   microcontroller.sh OBJECT... ARCHIVE      all objects of bmud_mmu, of which those of the unit itself are picked, and
#                                             unit_alone.cpp's; the library from which the linker takes what they use
set -euo pipefail

allowed='mem(cpy|move|set|cmp)|(log|log1p|exp|exp2|expm1|lround|llround|round|sqrt|fmod)f?|__stack_chk_fail|_GLOBAL_OFFSET_TABLE_'
measuring='__(asan|ubsan|tsan|msan|sanitizer|sancov|gcov|llvm|odr_asan)_.*|_?__(start|stop)___?(llvm|sancov).*'  # builds that watch themselves
unit='/(mmu|front_end|thermistor)\.cpp\.o$'

archive=${*: -1}
objects=()
seen=0
for object in "${@:1:$#-1}"; do
  if [[ $object =~ $unit ]]; then
    seen=$((seen + 1))
  elif [[ $object != */unit_alone.cpp.o ]]; then
    continue
  fi
  objects+=("$object")
done
if ((seen != 3 || ${#objects[@]} != 4)); then
  printf 'wanted the objects of mmu.cpp, front_end.cpp, thermistor.cpp and unit_alone.cpp, found %d\n' "${#objects[@]}" >&2
  exit 1
fi

linked=$(mktemp)
trap 'rm -f "$linked"' EXIT
ld -r -o "$linked" "${objects[@]}" "$archive"
nm -C "$linked" | grep ' T bmu::RequestCheck::check' >/dev/null || {
  printf 'the linked unit has no receive check: nothing was taken from %s\n' "$archive" >&2
  exit 1
}
# A build that checks itself compares types of functions, and cleans up behind a check that fails.
if nm -u "$linked" | grep -E ' __(asan|ubsan)_' >/dev/null; then
  measuring+='|_ZTVN10__cxxabiv1.*|__gxx_personality_v0'
fi
wanted=$(nm -u "$linked" | awk '{print $2}' | grep -vxE "$allowed|$measuring" || true)
if [[ -n $wanted ]]; then
  printf 'the module unit needs %s\n' "$(c++filt <<<"$wanted" | tr '\n' ' ')" >&2
  exit 1
fi
