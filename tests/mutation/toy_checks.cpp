// The checks of toy.cpp: status 0 if all pass. Not part of the project's build.
#include "toy.cpp"

int main() {
  const TimePoint start{1s};
  const bool counts = beyond_count(4) == 0 && beyond_count(5) == 1 && beyond_count(9) == 1;
  // Not const: a constant would be computed at compile time, where no mutant is ever selected.
  bool is_edge = is_beyond(1, 1) && !is_beyond(1, 0) && !is_beyond(-2, -3);
  const bool is_timed = !is_late(start + 10ms, start, 0) && is_late(start + 10ms + 1ns, start, 0) &&
                        is_late(TimePoint{1ns}, TimePoint{}, 0) && !is_late(start + 20ms, start, 1);
  const bool walks = walk(2, false) == 8 && walk(2, true) == -8;
  return counts && is_edge && is_timed && walks ? 0 : 1;
}
