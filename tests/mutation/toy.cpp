// Test subject of the mutation tool: every kind of change, in code small enough that the effect of each is known. Not
// part of the project's build; toy_checks.cpp has the checks, self_test.py lists the mutants that they must kill and
// those that they cannot.
#include <array>
#include <chrono>
#include <cstdint>

using namespace std::chrono_literals;
using Duration = std::chrono::nanoseconds;
struct Clock {
  using duration = Duration;
  using rep = Duration::rep;
  using period = Duration::period;
  using time_point = std::chrono::time_point<Clock>;
};
using TimePoint = Clock::time_point;

struct Row {
  int limit = 0;
  bool counts = true;
  Duration wait = 10ms;
};
constexpr std::array<Row, 2> rows{{{.limit = 5}, {.limit = 7, .counts = false, .wait = 20ms}}};
constexpr int half_step = 2;
constexpr int step_length = half_step + half_step;
constexpr int limit_min = 1;

consteval bool limits_rise() {
  for (std::size_t index = 1; index < rows.size(); ++index) {
    if (rows[index].limit <= rows[index - 1].limit) return false;
  }
  return true;
}
static_assert(limits_rise());

constexpr bool is_beyond(int value, int limit) {
  return value >= limit && limit >= limit_min;
}
static_assert(is_beyond(5, 5) && !is_beyond(4, 5));

int beyond_count(int value) {
  int count = 0;
  for (const Row& row : rows) {
    if (!row.counts) continue;
    if (is_beyond(value, row.limit)) ++count;
  }
  return count;
}

bool is_late(TimePoint now, TimePoint since, std::size_t row) {
  const Duration waited = now - since;
  return waited > rows[row].wait || since == TimePoint{};
}

int walk(int steps, bool back) {
  int at = 0;
  for (int done = 0; done < steps; done += 1) at += back ? -step_length : step_length;
  return at;
}
