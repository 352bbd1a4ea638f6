// From edges to the signal of the insulation monitor: of every state, with jitter, with lost edges, and without any.
#include "protocol/ir155_capture.hpp"

#include <cstdlib>
#include <string_view>

#include "tests/support/catch.hpp"

namespace bmu::ir155 {
namespace {

constexpr TimePoint start{1'000s};

/// Signal on a wire, period after period.
struct Wire {
  Capture capture;
  TimePoint now = start;

  Wire() { capture.begin(false); }
  void edge(bool is_rising, bool is_after_loss = false) {
    capture.observe({.at = now, .is_rising = is_rising, .is_after_loss = is_after_loss});
  }
  /// One period, high for `high` and low for the remainder of `whole`; the rising edge at its end is that of the next
  /// one.
  void period(Duration high, Duration whole) {
    edge(true);
    now += high;
    edge(false);
    now += whole - high;
  }
  [[nodiscard]] Pwm pwm() const { return capture.pwm(now); }
  [[nodiscard]] State state() const { return decode(pwm()).state; }
};

}  // namespace

TEST_CASE("each state's signal is that state again, from its first whole period on", "[unit][protocol][ir155][FS_3]") {
  for (const Row& row : rows) {
    const Pwm sent = encode({row.state, known(100'000)});
    INFO(to_text(row.state));
    Wire wire;
    CHECK(wire.state() == State::no_signal_low);
    const Duration whole{1'000'000'000'000 / sent.frequency_mHz};
    const Duration high = whole * sent.duty_permille / 1'000;
    wire.period(high, whole);
    CHECK(wire.state() == State::no_signal_low);  // no period is over
    wire.edge(true);
    CHECK(wire.pwm().frequency_mHz == sent.frequency_mHz);
    CHECK(wire.pwm().duty_permille == sent.duty_permille);
    CHECK(wire.pwm().since_edge == 0ns);
    CHECK(decode(wire.pwm()) == decode(sent));
  }
}

TEST_CASE("a tenth of a millisecond of jitter changes no state, and a resistance by little",
          "[unit][protocol][ir155][FS_3]") {
  for (const Row& row : rows) {
    const Pwm sent = encode({row.state, known(200'000)});
    const std::int64_t whole_us = 1'000'000'000 / sent.frequency_mHz;
    const std::int64_t high_us = whole_us * sent.duty_permille / 1'000;
    Wire wire;
    std::uint32_t seed = 1;
    const auto jitter = [&seed] {
      seed = seed * 1'664'525U + 1'013'904'223U;
      return std::chrono::microseconds{static_cast<std::int64_t>(seed >> 16) % 201 - 100};
    };
    TimePoint rise = start;
    for (int count = 0; count < 200; ++count) {
      wire.now = rise + jitter();
      wire.edge(true);
      if (count > 0) {
        INFO(to_text(row.state) << ", period " << count);
        const Reading reading = decode(wire.pwm());
        REQUIRE(reading.state == row.state);
        if (row.is_measuring) REQUIRE(std::llabs(reading.resistance_Ohm.value - 200'000) < 15'000);
      }
      wire.now = rise + std::chrono::microseconds{high_us} + jitter();
      wire.edge(false);
      rise += std::chrono::microseconds{whole_us};
    }
  }
}

TEST_CASE("one lost edge spoils its period only, and is borne", "[unit][protocol][ir155]") {
  const bool is_told = GENERATE(false, true);
  const bool is_rise = GENERATE(false, true);
  CAPTURE(is_told, is_rise);
  Wire wire;
  for (int count = 0; count < 5; ++count) wire.period(25ms, 100ms);
  wire.edge(true);
  const Pwm before = wire.pwm();
  REQUIRE(before.duty_permille == 250);
  if (is_rise) {
    wire.now += 25ms;
    wire.edge(false);
    wire.now += 75ms;  // the rise is missing
    wire.now += 25ms;
    wire.edge(false, is_told);
  } else {
    wire.now += 100ms;  // the fall is missing
    wire.edge(true, is_told);
    CHECK(wire.pwm().since_edge == 100ms);
    wire.now += 25ms;
    wire.edge(false);
  }
  CHECK(wire.pwm().duty_permille == 250);  // the last complete period
  CHECK(wire.pwm().since_edge == 125ms);
  CHECK(wire.state() == State::normal);
  wire.now += 75ms;
  CHECK(wire.state() == State::normal);  // 200 ms old
  for (int count = 0; count < 2; ++count) wire.period(25ms, 100ms);
  CHECK(wire.pwm().frequency_mHz == 10'000);
  CHECK(wire.pwm().since_edge == 100ms);
}

TEST_CASE("edges that were lost are no longer period, wherever in it they were", "[unit][protocol][ir155]") {
  Wire wire;
  for (int count = 0; count < 3; ++count) wire.period(10ms, 100ms);
  wire.edge(true);
  // A falling and the next rising edge are missing: the visible period would be 160 ms with 110 ms high.
  wire.now += 110ms;
  wire.edge(false, true);
  wire.now += 50ms;
  wire.edge(true);
  CHECK(wire.pwm().duty_permille == 100);
  CHECK(wire.pwm().since_edge == 160ms);
}

TEST_CASE("without edges there is no signal: after 200 ms, low or high as the last edge left it",
          "[unit][protocol][ir155][FS_3]") {
  const bool is_high = GENERATE(false, true);
  Wire wire;
  for (int count = 0; count < 3; ++count) wire.period(30ms, 100ms);
  wire.edge(true);
  const TimePoint last = wire.now;
  if (!is_high) {
    wire.now += 30ms;
    wire.edge(false);
  }
  wire.now = last + 200ms;
  CHECK(wire.state() == State::normal);
  wire.now += 1ns;
  CHECK(wire.pwm().since_edge == 200'001us);  // rounded up
  CHECK(wire.state() == (is_high ? State::no_signal_high : State::no_signal_low));
}

TEST_CASE("a line on which nothing ever happened has the level it began with, and 0 Hz", "[unit][protocol][ir155]") {
  for (const bool is_high : {false, true}) {
    Capture capture;
    capture.begin(is_high);
    const Pwm pwm = capture.pwm(start);
    CHECK(pwm.frequency_mHz == 0);
    CHECK(decode(pwm).state == (is_high ? State::no_signal_high : State::no_signal_low));
  }
}

TEST_CASE("chatter and edges of one kind do not keep an old period alive", "[unit][protocol][ir155]") {
  Wire wire;
  for (int count = 0; count < 3; ++count) wire.period(50ms, 100ms);
  wire.edge(true);
  const bool is_one_kind = GENERATE(false, true);
  for (int ms = 0; ms < 300; ++ms) {
    wire.now += 1ms;
    wire.edge(!is_one_kind && ms % 2 != 0);
  }
  CHECK(wire.state() == (is_one_kind ? State::no_signal_low : State::undefined));
}

TEST_CASE("a period longer than silence is none, and one of 200 ms is", "[unit][protocol][ir155]") {
  Wire wire;
  for (int count = 0; count < 3; ++count) wire.period(100ms, 200ms);
  wire.edge(true);
  CHECK(wire.pwm().frequency_mHz == 5'000);
  CHECK(wire.state() == State::undefined);
  Wire slower;
  for (int count = 0; count < 3; ++count) slower.period(100ms, 200ms + 1ns);
  slower.edge(true);
  CHECK(slower.pwm().frequency_mHz == 0);
  CHECK(slower.state() == State::no_signal_high);
}

TEST_CASE("times that go back or stand still are no period", "[unit][protocol][ir155]") {
  Wire wire;
  wire.edge(true);
  wire.edge(false);
  wire.edge(true);  // all at the same time
  CHECK(wire.pwm().frequency_mHz == 0);
  wire.now -= 10ms;
  wire.edge(false);
  wire.now -= 10ms;
  wire.edge(true);
  CHECK(wire.pwm().frequency_mHz == 0);
  CHECK(wire.pwm().since_edge == 0ns);
}

TEST_CASE("a capture that begins anew knows nothing of before", "[unit][protocol][ir155]") {
  Wire wire;
  for (int count = 0; count < 3; ++count) wire.period(50ms, 100ms);
  wire.edge(true);
  wire.now += 50ms;
  wire.capture.begin(true);
  CHECK(wire.pwm().frequency_mHz == 0);
  wire.edge(false);
  wire.now += 50ms;
  wire.edge(true);
  CHECK(wire.pwm().frequency_mHz == 0);
}

}  // namespace bmu::ir155
