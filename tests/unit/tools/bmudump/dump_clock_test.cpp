// Settings of the clock in a log: their detection, and their exclusion from the counts.
#include <cstdint>
#include <vector>

#include "tests/support/catch.hpp"
#include "tools/bmudump/clock_jumps.hpp"
#include "tools/bmudump/line_start.hpp"
#include "tools/bmudump/statistics.hpp"

namespace {

using namespace bmu;
using namespace bmu::dump;

constexpr std::int64_t s = 1'000'000;
constexpr std::int64_t ms = 1'000;
constexpr std::int64_t in_2023_us = 1'700'000'000 * s;
constexpr std::int64_t hour_us = 3'600 * s;

/// Takes frames of bus 0, `period_us` apart; returns how often the clock was set among them.
std::uint64_t run(ClockJumps& clock, std::int64_t from_us, int count, std::int64_t period_us = 20 * ms) {
  const std::uint64_t before = clock.count();
  for (int i = 0; i < count; ++i) static_cast<void>(clock.take(0, from_us + i * period_us));
  return clock.count() - before;
}

}  // namespace

TEST_CASE("the first setting of a clock that began in 1970 is found, however few frames there are",
          "[unit][bmudump][clock]") {
  ClockJumps clock;
  CHECK_FALSE(clock.take(0, 12 * s).is_found());
  const ClockJump jump = clock.take(0, in_2023_us);
  CHECK(jump.by_us == in_2023_us - 12 * s);
  CHECK(jump.is_certain);
  CHECK(clock.left_out_us() == jump.by_us);
  CHECK(run(clock, in_2023_us + 20 * ms, 100) == 0);
}

TEST_CASE("a clock that is set back is found at the bus whose order it breaks", "[unit][bmudump][clock]") {
  ClockJumps clock;
  CHECK(run(clock, in_2023_us, 100) == 0);
  CHECK_FALSE(clock.take(1, in_2023_us + 1'900 * ms).is_found());  // of another bus, and out of order
  const ClockJump jump = clock.take(0, in_2023_us - hour_us);
  CHECK(jump.by_us == -hour_us - 1'900 * ms);
  CHECK(jump.is_certain);
  CHECK_FALSE(clock.take(1, in_2023_us - hour_us + 5 * ms).is_found());
  CHECK(run(clock, in_2023_us - hour_us + 20 * ms, 100) == 0);
  CHECK(clock.count() == 1);
}

TEST_CASE("milliseconds back are an adapter's, and of one frame there is no order", "[unit][bmudump][clock]") {
  ClockJumps clock;
  CHECK(run(clock, in_2023_us, 100) == 0);
  CHECK_FALSE(clock.take(0, in_2023_us + 1'975 * ms).is_found());
  CHECK(clock.take(0, in_2023_us + 1'969 * ms).is_found());
  ClockJumps single;
  CHECK_FALSE(single.take(0, 9 * s).is_found());
  CHECK_FALSE(single.take(0, 1 * s).is_found());
}

TEST_CASE("a clock that is set forward is found where no bus had a frame for far longer than ever",
          "[unit][bmudump][clock]") {
  ClockJumps clock;
  CHECK(run(clock, in_2023_us, 100) == 0);
  const ClockJump jump = clock.take(1, in_2023_us + hour_us);
  CHECK(jump.by_us == hour_us - 1'980 * ms);
  CHECK_FALSE(jump.is_certain);
  CHECK(run(clock, in_2023_us + hour_us, 100) == 0);

  // Intervals in which the bus may also have been silent.
  ClockJumps silent;
  run(silent, in_2023_us, 100);
  CHECK_FALSE(silent.take(0, in_2023_us + 11'900 * ms).is_found());
  ClockJumps sparse;
  CHECK(run(sparse, in_2023_us, 100, 60 * s) == 0);
  CHECK_FALSE(sparse.take(0, in_2023_us + 6'000 * s + 1'100 * s).is_found());
  ClockJumps few;
  CHECK(run(few, in_2023_us, 10) == 0);
  CHECK_FALSE(few.take(0, in_2023_us + hour_us).is_found());
}

TEST_CASE("jumps there and back come to nothing", "[unit][bmudump][clock]") {
  ClockJumps clock;
  run(clock, in_2023_us, 100);
  CHECK(run(clock, in_2023_us + hour_us, 100) == 1);
  CHECK(run(clock, in_2023_us + 4 * s, 100) == 1);
  CHECK(clock.left_out_us() == hour_us - 1'980 * ms + (4 * s - hour_us - 1'980 * ms));
}

TEST_CASE("what the clock was set by is in no rate, gap, load and silence", "[unit][bmudump][clock][statistics]") {
  const CanFrame frame = data_frame(0x7A1, 8);
  ClockJumps clock;
  BusStatistics set;
  BusStatistics steady;
  std::int64_t steady_us = 0;
  for (const std::int64_t from_us : {12 * s, in_2023_us, in_2023_us - hour_us}) {
    for (int i = 0; i < 100; ++i) {
      const LogLine line{.kind = LogLineKind::frame, .time_us = from_us + i * 20 * ms, .bus = "can0", .frame = frame};
      static_cast<void>(clock.take(0, line.time_us));
      set.count(line, {}, clock.left_out_us());
      // No known time elapses at a setting of the clock.
      const LogLine same{.kind = LogLineKind::frame, .time_us = steady_us, .bus = "can0", .frame = frame};
      steady.count(same, {});
      steady_us += i == 99 ? 0 : 20 * ms;
    }
  }
  CHECK(clock.count() == 2);
  const IdStatistics& row = set.standard(0x7A1);
  CHECK(row.rate_per_s() == Approx(steady.standard(0x7A1).rate_per_s()));
  CHECK(row.rate_per_s() == Approx(50.0).epsilon(0.01));
  CHECK(row.gap_max_us == 20 * ms);
  CHECK(row.silence_us(set.until_us) == 0);
  CHECK(set.load_bit_per_s() == Approx(steady.load_bit_per_s()));
  CHECK(set.span_s() == Approx(5.94));
  CHECK(set.first_us == 12 * s);  // as in the log
  CHECK(set.last_us == in_2023_us + 1'980 * ms);
}

TEST_CASE("the end of a gap is reported as the log has it", "[unit][bmudump][clock][statistics]") {
  const CanFrame frame = data_frame(0x7A1, 8);
  BusStatistics bus;
  const auto count = [&](std::int64_t time_us, std::int64_t left_out_us) {
    bus.count({.kind = LogLineKind::frame, .time_us = time_us, .bus = "can0", .frame = frame}, {}, left_out_us);
  };
  count(10 * s, 0);
  count(100 * s, 90 * s);
  count(103 * s, 90 * s);
  CHECK(bus.standard(0x7A1).gap_max_us == 3 * s);
  CHECK(bus.standard(0x7A1).gap_end_us == 103 * s);
}

TEST_CASE("times since another line are without what the clock was set by", "[unit][bmudump][clock]") {
  for (const auto& [form, expected] :
       {std::pair{TimeForm::zero, "(2.000000) can0"}, {TimeForm::delta, "(0.500000) can0"}}) {
    TextWriter out(-1);
    LineStart start({.time = form});
    for (const auto& [time_us, jump_us] :
         {std::pair{12 * s, std::int64_t{0}}, {13'500 * ms, std::int64_t{0}}, {in_2023_us, in_2023_us - 14 * s}}) {
      if (jump_us != 0) start.leave_out(jump_us);
      out.drop_pending();
      out.begin_line();
      start.print({.kind = LogLineKind::frame, .time_us = time_us, .bus = "can0"}, out);
    }
    CHECK(out.pending() == expected);
  }
}
