// IR155 with pulses captured on a GPIO line of this host: the effect of each reading, of stale ones and of missing
// ones.
#include "daemon/core/measurement/insulation_table.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;

namespace {

using ir155::State;

InsulationTable table_of_pulses() {
  InsulationTable table;
  table.init({.monitoring = InsulationMonitoring::measured, .has_pulse_line = true});
  return table;
}

CoreConfig pulse_pack() {
  CoreConfig config = test::small_pack();
  config.insulation.monitoring = InsulationMonitoring::measured;
  config.insulation.has_pulse_line = true;
  config.lines = {.are_used = true, .has_insulation_ok = true};
  config.limits.insulation_low = {.warn = 100'000, .open = 50'000, .hysteresis = 10'000, .confirm = 500ms, .clear = 2s};
  return config;
}

/// Bench with a captured monitor, a whole period every 100 ms; the PDU reports its own monitor as not OK.
struct PulseBench {
  test::CoreBench bench;
  ir155::Reading says{State::normal, known(900'000)};
  bool has_pulses = true;
  bool is_line_ok = true;
  int ms = 0;

  PulseBench() : bench(pulse_pack()) {
    bench.inputs.insulation_monitor_ok = false;
    bench.inputs.insulation_state = InsulationState::device_error;
    bench.each_ms = [this] {
      if (++ms % 10 == 0) bench.observe(LinesSeen{{.insulation_ok = is_line_ok}});
      if (ms % 100 == 50 && has_pulses) bench.observe(PulsesSeen{ir155::encode(says)});
    };
  }
  [[nodiscard]] const PduState& inputs() const { return bench.core().sensors().pdu.value; }
  [[nodiscard]] bool is_closed() const { return bench.core().sequence().phase == Phase::closed; }
};

}  // namespace

TEST_CASE("each state of the pulses is that of the monitor, with a value where it measures",
          "[unit][insulation][FS_3]") {
  struct Case {
    State pulses;
    InsulationState state;
    bool has_value;
    bool is_ok;
  };
  constexpr Case cases[] = {{State::normal, InsulationState::normal, true, true},
                            {State::undervoltage, InsulationState::undervoltage, true, true},
                            {State::speed_start_good, InsulationState::speed_start, false, true},
                            {State::speed_start_bad, InsulationState::speed_start, false, false},
                            {State::device_error, InsulationState::device_error, false, true},
                            {State::earth_fault, InsulationState::earth_fault, false, true},
                            {State::no_signal_low, InsulationState::no_signal, false, true},
                            {State::no_signal_high, InsulationState::no_signal, false, true},
                            {State::undefined, InsulationState::undefined, false, true}};
  constexpr TimePoint now{100s};
  for (const Case& one : cases) {
    INFO(to_text(one.pulses));
    InsulationTable table = table_of_pulses();
    ir155::Pwm pwm = ir155::encode({one.pulses, known(300'000)});
    pwm.since_edge = 3ms;
    table.observe(pwm, now);
    const InsulationWord word = table.word(now + 7ms);
    CHECK(word.state == one.state);
    CHECK(word.is_ok == one.is_ok);
    CHECK(word.resistance_Ohm.is_valid() == one.has_value);
    CHECK(word.taken_at == (one.has_value ? now - 3ms : TimePoint{}));  // when the period ended
    CHECK(table.is_talking(now + 7ms) == (one.state != InsulationState::no_signal));
    CHECK_FALSE(table.is_untested(now));
  }
}

TEST_CASE("more than the monitor can tell is a word, too", "[unit][insulation]") {
  InsulationTable table = table_of_pulses();
  table.observe(ir155::encode({State::normal, not_known(Validity::above_range)}), TimePoint{1s});
  const InsulationWord word = table.word(TimePoint{1s});
  CHECK(word.state == InsulationState::normal);
  CHECK(word.resistance_Ohm.validity == Validity::above_range);
  CHECK(word.taken_at == TimePoint{1s});
}

TEST_CASE("pulses that nobody tells any more are silence after 200 ms, whoever is to blame",
          "[unit][insulation][FS_3]") {
  InsulationTable table = table_of_pulses();
  CHECK(table.word(TimePoint{1ms}).state == InsulationState::no_signal);  // no pulse yet
  ir155::Pwm pwm = ir155::encode({State::normal, known(300'000)});
  pwm.since_edge = 50ms;
  constexpr TimePoint told{100s};
  table.observe(pwm, told);
  CHECK(table.word(told + 150ms).state == InsulationState::normal);
  CHECK(table.word(told + 150ms + 1ns).state == InsulationState::no_signal);
  CHECK_FALSE(table.word(told + 150ms + 1ns).resistance_Ohm.is_valid());
  // The loss of a bus does not affect a GPIO line.
  table.forget_values();
  CHECK(table.word(told + 150ms).state == InsulationState::normal);
}

TEST_CASE("frames are nobody's where pulses are captured", "[unit][insulation]") {
  InsulationTable table = table_of_pulses();
  CHECK(table.is_there());
  CHECK(table.protocol() == "ir155");
  CHECK_FALSE(table.observe(CanFrame{.id = 0x37, .length = 6}, TimePoint{1s}));
}

TEST_CASE("a pack closes by the pulses and the line, whatever the unit says of its own",
          "[unit][core][insulation][FS_3]") {
  PulseBench pulses;
  pulses.bench.run(1s);
  REQUIRE(pulses.bench.close());
  CHECK(pulses.inputs().insulation_state == InsulationState::normal);
  CHECK(pulses.inputs().insulation_monitor_ok);
  // A duty cycle of 514 permille.
  CHECK(pulses.inputs().insulation_resistance_Ohm.value == Approx(900'000).margin(4'000));
  pulses.bench.run(2s);
  CHECK(pulses.is_closed());
}

TEST_CASE("pulses that stop open a closed pack within two seconds", "[unit][core][insulation][FS_3]") {
  PulseBench pulses;
  pulses.bench.run(1s);
  REQUIRE(pulses.bench.close());
  pulses.has_pulses = false;
  pulses.bench.run(1'400ms);
  CHECK(pulses.is_closed());
  pulses.bench.run(600ms);
  CHECK(pulses.bench.is_active(FaultId::insulation_monitor_lost));
  CHECK_FALSE(pulses.is_closed());
}

TEST_CASE("without pulses nothing closes, nor by those that mean nothing", "[unit][core][insulation][FS_3]") {
  const State state = GENERATE(State::no_signal_high, State::undefined, State::device_error, State::earth_fault,
                               State::speed_start_good);
  PulseBench pulses;
  pulses.says = {state, not_known()};
  pulses.bench.run(1s);
  CHECK_FALSE(pulses.bench.close());
}

TEST_CASE("a period or two that are missing open nothing", "[unit][core][insulation]") {
  PulseBench pulses;
  pulses.bench.run(1s);
  REQUIRE(pulses.bench.close());
  for (int round = 0; round < 5; ++round) {
    pulses.has_pulses = false;
    pulses.bench.run(400ms);
    pulses.has_pulses = true;
    pulses.bench.run(1s);
  }
  CHECK(pulses.is_closed());
}

TEST_CASE("a low resistance opens, and so does the line alone", "[unit][core][insulation][FS_3]") {
  PulseBench pulses;
  pulses.bench.run(1s);
  REQUIRE(pulses.bench.close());
  const bool is_line = GENERATE(false, true);
  if (is_line) {
    pulses.is_line_ok = false;
  } else {
    pulses.says = {State::normal, known(20'000)};
  }
  pulses.bench.run(1'500ms);
  CHECK(pulses.bench.is_active(FaultId::insulation_low) == !is_line);
  CHECK(pulses.bench.is_active(FaultId::insulation_fault) == is_line);
  CHECK_FALSE(pulses.is_closed());
}
