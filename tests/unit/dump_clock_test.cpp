// Where the clock of a log was set: what is found, and what the counts leave out.
#include <cstdint>
#include <vector>

#include "protocol/can_bits.hpp"
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

/// Frames of bus 0, each `period_us` behind the one before; how often the clock was set among them.
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

  // What a bus may as well have been silent for.
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
  for (const std::int64_t from_us : {12 * s, in_2023_us, in_2023_us - hour_us}) {
    for (int i = 0; i < 100; ++i) {
      const LogLine line{.kind = LogLineKind::frame, .time_us = from_us + i * 20 * ms, .bus = "can0", .frame = frame};
      static_cast<void>(clock.take(0, line.time_us));
      set.count(line, {}, clock.sum());
    }
  }
  CHECK(clock.count() == 2);
  const IdStatistics& row = set.standard(0x7A1);
  CHECK(row.rate_per_s() == Approx(50.0));
  CHECK(set.frames_per_s() == Approx(50.0));
  CHECK(row.gap_max_us == 20 * ms);
  CHECK(row.silence_us(set.until_us) == 0);
  CHECK(set.load_bit_per_s() == Approx(50.0 * static_cast<double>(bits_on_wire(frame))));
  CHECK(set.span_s() == Approx(5.94));
  CHECK(set.first_us == 12 * s);  // as in the log
  CHECK(set.last_us == in_2023_us + 1'980 * ms);
}

TEST_CASE("the time between the two frames around a setting of the clock is in no rate, of whatever else came in it",
          "[unit][bmudump][clock][statistics]") {
  // One identifier each 20 ms and another 1 ms behind it, which is the last before each setting; and a third each
  // 200 ms, which does not come between a setting there and the one back.
  ClockJumps clock;
  BusStatistics bus;
  const auto take = [&](std::int64_t time_us, std::uint32_t id) {
    static_cast<void>(clock.take(0, time_us));
    bus.count({.kind = LogLineKind::frame, .time_us = time_us, .bus = "can0", .frame = data_frame(id, 8)}, {},
              clock.sum());
  };
  std::int64_t at_us = 0;
  const auto take_for = [&](int rounds, std::int64_t ahead_us) {
    for (int i = 0; i < rounds; ++i, at_us += 20 * ms) {
      take(in_2023_us + ahead_us + at_us, 0x7A1);
      take(in_2023_us + ahead_us + at_us + 1 * ms, 0x7A2);
      if (at_us % (200 * ms) == 0) take(in_2023_us + ahead_us + at_us + 2 * ms, 0x7A3);
    }
  };
  take_for(101, 0);
  take_for(5, hour_us);
  take_for(100, 0);
  REQUIRE(clock.count() == 2);
  for (const std::uint32_t id : {0x7A1U, 0x7A2U}) CHECK(bus.standard(id).rate_per_s() == Approx(50.0));
  CHECK(bus.standard(0x7A3).rate_per_s() == Approx(5.0));
  // Of 433 frames in 4,101 ms, without three, and without 18 and 19 ms around the settings.
  CHECK(bus.frames_per_s() == Approx(430.0 / 4.064));
}

TEST_CASE("without time between frames there is no rate", "[unit][bmudump][clock][statistics]") {
  const CanFrame frame = data_frame(0x7A1, 8);
  BusStatistics bus;
  const auto count = [&](std::int64_t time_us, const ClockJumps::Sum& clock) {
    bus.count({.kind = LogLineKind::frame, .time_us = time_us, .bus = "can0", .frame = frame}, {}, clock);
  };
  count(12 * s, {});
  count(100 * s, {.by_us = 87 * s, .count = 1});
  CHECK(bus.standard(0x7A1).rate_per_s() == 0.0);
  CHECK(bus.frames_per_s() == 0.0);
  CHECK(bus.load_bit_per_s() == 0.0);
  CHECK(bus.span_s() == Approx(1.0));
  count(102 * s, {.by_us = 87 * s, .count = 1});
  CHECK(bus.standard(0x7A1).rate_per_s() == Approx(0.5));
  // Of a frame that comes out of order behind a setting no time is left out.
  count(90 * s, {.by_us = 77 * s, .count = 2});
  CHECK(bus.standard(0x7A1).rate_per_s() == Approx(0.5));
}

TEST_CASE("the end of a gap is reported as the log has it", "[unit][bmudump][clock][statistics]") {
  const CanFrame frame = data_frame(0x7A1, 8);
  BusStatistics bus;
  const auto count = [&](std::int64_t time_us, const ClockJumps::Sum& clock) {
    bus.count({.kind = LogLineKind::frame, .time_us = time_us, .bus = "can0", .frame = frame}, {}, clock);
  };
  count(10 * s, {});
  count(100 * s, {.by_us = 90 * s, .count = 1});
  count(103 * s, {.by_us = 90 * s, .count = 1});
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
