// Peak-to-peak current since an instant: which samples count at the edges of that time.
#include "daemon/core/measurement/current_window.hpp"

#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

constexpr TimePoint start{10s};

}  // namespace

TEST_CASE("without samples, or with one, nothing has swung", "[unit][current]") {
  CurrentWindow window;
  CHECK(window.swing_mA(start) == 0);
  window.add(-5'000, start);
  CHECK(window.swing_mA(start) == 0);
}

TEST_CASE("a swing is from the lowest to the highest sample, however close they are", "[unit][current]") {
  CurrentWindow window;
  window.add(1'000, start);
  window.add(-2'000, start + 4ms);
  window.add(5'000, start + 10ms - 1ns);
  CHECK(window.swing_mA(start) == 7'000);
  CHECK(window.swing_mA(start + 1h) == 7'000);  // the last known sample counts
}

TEST_CASE("a swing does not overflow", "[unit][current]") {
  CurrentWindow window;
  window.add(INT32_MIN, start);
  window.add(INT32_MAX, start + 10ms);
  CHECK(window.swing_mA(start) == std::int64_t{INT32_MAX} - INT32_MIN);
}

TEST_CASE("the moment before the asked-for time still counts, the one before that does not", "[unit][current]") {
  CurrentWindow window;
  window.add(100'000, start);
  window.add(10'000, start + 10ms);
  window.add(0, start + 20ms);
  CHECK(window.swing_mA(start + 20ms + 1ns) == 0);
  CHECK(window.swing_mA(start + 20ms) == 10'000);
  CHECK(window.swing_mA(start + 10ms + 1ns) == 10'000);
  CHECK(window.swing_mA(start + 10ms) == 100'000);
}

TEST_CASE("samples of 10 ms are kept together", "[unit][current]") {
  CurrentWindow window;
  window.add(100'000, start);
  window.add(0, start + 10ms - 1ns);
  CHECK(window.swing_mA(start + 1ns) == 100'000);
  CurrentWindow apart;
  apart.add(100'000, start);
  apart.add(0, start + 10ms);
  CHECK(apart.swing_mA(start + 10ms + 1ns) == 0);
}

TEST_CASE("the window reaches back 640 ms", "[unit][current]") {
  CurrentWindow window;
  window.add(100'000, start);
  for (int count = 1; count < 64; ++count) window.add(0, start + count * 10ms);
  CHECK(window.swing_mA(start) == 100'000);
  window.add(0, start + 640ms);
  CHECK(window.swing_mA(start) == 0);
}

TEST_CASE("the current at a moment lies between the samples on either side of it", "[unit][current][BMS_F.6]") {
  CurrentWindow window;
  CHECK_FALSE(window.at(start, 40ms).has_value());
  window.add(1'000, start);
  CHECK(window.at(start, 40ms) == 1'000);
  CHECK_FALSE(window.at(start + 1ms, 40ms).has_value());  // the next sample is missing
  CHECK_FALSE(window.at(start - 1ms, 40ms).has_value());
  window.add(3'000, start + 20ms);
  CHECK(window.at(start + 5ms, 40ms) == 1'500);
  CHECK(window.at(start + 10ms, 40ms) == 2'000);
  CHECK(window.at(start + 20ms, 40ms) == 3'000);
  window.add(-1'000, start + 40ms);
  CHECK(window.at(start + 30ms, 40ms) == 1'000);
  CHECK(window.at(start + 5ms, 40ms) == 1'500);  // neighbours, not the latest two
}

TEST_CASE("samples that are too far away say nothing of the moment", "[unit][current]") {
  CurrentWindow window;
  window.add(1'000, start);
  window.add(3'000, start + 60ms);
  CHECK(window.at(start + 30ms, 30ms) == 2'000);
  CHECK_FALSE(window.at(start + 29ms, 30ms).has_value());
  CHECK_FALSE(window.at(start + 31ms, 30ms).has_value());
}

TEST_CASE("a span reaches from the last sample before a time to the first behind it", "[unit][current]") {
  CurrentWindow window;
  const auto width_mA = [&window](TimePoint from, TimePoint to) {
    const CurrentRange found = window.span(from, to);
    return found.is_known ? std::int64_t{found.max_mA} - found.min_mA : -1;
  };
  CHECK(width_mA(start, start) == -1);
  window.add(1'000, start);
  CHECK(width_mA(start, start) == 0);
  CHECK(width_mA(start - 1ns, start) == -1);  // no sample before
  CHECK(width_mA(start, start + 1ns) == -1);  // no sample after
  window.add(3'000, start + 20ms);
  window.add(8'000, start + 40ms);
  CHECK(width_mA(start + 1ms, start + 19ms) == 2'000);
  CHECK(width_mA(start + 1ms, start + 20ms) == 2'000);
  CHECK(width_mA(start + 1ms, start + 20ms + 1ns) == 7'000);
  CHECK(width_mA(start + 20ms, start + 21ms) == 5'000);
  CHECK(width_mA(start + 20ms - 1ns, start + 21ms) == 7'000);
  CHECK(width_mA(start + 1ms, start + 41ms) == -1);
  CHECK(window.span(start + 1ms, start + 19ms).min_mA == 1'000);
}

TEST_CASE("a span does not know what came before the window", "[unit][current]") {
  CurrentWindow window;
  for (int count = 0; count < 65; ++count) window.add(count, start + count * 10ms);
  CHECK_FALSE(window.span(start + 5ms, start + 20ms).is_known);
  CHECK(window.span(start + 10ms, start + 20ms).is_known);
}
