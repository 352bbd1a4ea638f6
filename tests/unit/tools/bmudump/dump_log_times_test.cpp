// Times of a log in all forms of candump's options, on one clock.

#include <cstdint>
#include <string_view>

#include "tests/support/catch.hpp"
#include "tools/bmudump/log_times.hpp"

namespace {

using namespace bmu;
using namespace bmu::dump;

std::int64_t taken(LogTimes& times, std::int64_t time_us, std::string_view bus = "can0") {
  LogLine line{.kind = LogLineKind::frame, .time_us = time_us, .bus = bus};
  times.take(line, LogTimeForm::seconds);
  times.note(line.time_us);
  return line.time_us;
}

}  // namespace

TEST_CASE("only candump's short times may be differences", "[unit][bmudump][log_times]") {
  CHECK_FALSE(LogTimes::are_absolute("(000.000000) can0 143#"));
  CHECK_FALSE(LogTimes::are_absolute(" (012.345678)  can0  143   [0]"));
  CHECK(LogTimes::are_absolute("(0000000012.000000) can0 143#"));
  CHECK(LogTimes::are_absolute("(1700000000.000000) can0 143#"));
  CHECK(LogTimes::are_absolute("(0.000000) can0 143#"));
  CHECK(LogTimes::are_absolute("(123.000000) can0 143#"));
}

TEST_CASE("differences that a pipe brings one by one are found late, and the time never goes back",
          "[unit][bmudump][log_times]") {
  LogTimes times;
  CHECK(taken(times, 0) == 0);
  CHECK(taken(times, 500) == 500);
  CHECK(taken(times, 700) == 700);
  CHECK_FALSE(times.are_added_up());
  CHECK(taken(times, 600) == 1'800);  // all previous ones count
  CHECK(times.are_added_up());
  CHECK(taken(times, 0) == 1'800);
  CHECK(taken(times, 100) == 1'900);
}

TEST_CASE("times in a long order are no differences where the clock is set back", "[unit][bmudump][log_times][clock]") {
  LogTimes times;
  for (int i = 0; i < 200; ++i) CHECK(taken(times, 20'000 * (i + 1)) == 20'000 * (i + 1));
  CHECK(taken(times, 1'000'000) == 1'000'000);
  CHECK_FALSE(times.are_added_up());
  // Another log, with time differences, may begin there.
  CHECK(taken(times, 0) == 0);
  CHECK(taken(times, 500) == 500);
  static_cast<void>(taken(times, 400));
  CHECK(times.are_added_up());
}

TEST_CASE("frames of several buses may be written out of order", "[unit][bmudump][log_times]") {
  LogTimes times;
  CHECK(taken(times, 0) == 0);
  CHECK(taken(times, 500, "can0") == 500);
  CHECK(taken(times, 300, "can1") == 300);
  CHECK(taken(times, 500, "can0") == 500);
  CHECK(taken(times, 400, "can1") == 400);
  CHECK(taken(times, 500, "can1") == 500);
  CHECK(taken(times, 501, "can0") == 501);
  CHECK_FALSE(times.are_added_up());
}

TEST_CASE("a sum of hostile differences stays a time", "[unit][bmudump][log_times]") {
  LogTimes times;
  constexpr std::int64_t longest_us = 999'999'999'999'999'999;
  std::int64_t last_us = 0;
  for (int count = 0; count < 100; ++count) {
    const std::int64_t time_us = taken(times, count % 2 == 0 ? longest_us : longest_us - 1);
    CHECK(time_us >= last_us);
    last_us = time_us;
  }
}

TEST_CASE("a frame without a time has a number, and the time of the frame before it", "[unit][bmudump][log_times]") {
  LogTimes times;
  CHECK_FALSE(times.are_missing());
  times.note(5'000'000);
  for (std::uint32_t number = 1; number < 4; ++number) {
    LogLine line{.kind = LogLineKind::frame, .bus = "can0"};
    times.take(line, LogTimeForm::none);
    CHECK(line.number == number);
    CHECK(line.time_us == 5'000'000);
  }
  CHECK(times.are_missing());
}
