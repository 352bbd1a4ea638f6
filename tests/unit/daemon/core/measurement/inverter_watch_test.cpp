// Presence of the inverter, another battery on its bus, and the results in the fault rows and the output gate.
#include "daemon/core/measurement/inverter_watch.hpp"

#include <initializer_list>

#include "daemon/core/contactors/output_gate.hpp"
#include "daemon/core/faults/fault_readers.hpp"
#include "devices/device_list.hpp"
#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

constexpr TimePoint closed{100s};

InverterConfig with(std::string_view name) {
  return {.driver = find_device(name)->inverter};
}

struct Watched {
  InverterConfig config;
  InverterWatch watch;

  explicit Watched(const InverterConfig& given = with("pylontech")) : config(given) { watch.init(config); }
  void hear(TimePoint at, const InverterReport& report = {}) {
    for (const CanFrame& frame : config.driver->words(report)) REQUIRE(watch.observe(frame, at));
  }
};

bool holds(const Reading& reading) {
  return reading.is_known && reading.value != 0;
}

}  // namespace

TEST_CASE("without an inverter nothing is heard and nothing is missed", "[unit][inverter]") {
  InverterWatch watch;
  CHECK_FALSE(watch.is_there());
  CHECK_FALSE(watch.observe(data_frame(0x305, 8), closed));
  CHECK_FALSE(watch.is_silent(closed + 1h, closed));
  CHECK_FALSE(watch.has_foreign_battery(closed));
}

TEST_CASE("an inverter that lives on the pack has its time to its first word", "[unit][inverter]") {
  Watched watched;
  const InverterWatch& watch = watched.watch;
  CHECK_FALSE(watch.is_silent(closed + 60s, closed));
  CHECK(watch.is_silent(closed + 60s + 1ms, closed));
  CHECK_FALSE(watch.is_silent(closed + 1h, {}));  // an open pack
  watched.hear(closed + 61s);
  CHECK_FALSE(watch.is_silent(closed + 66s, closed));
  CHECK(watch.is_silent(closed + 66s + 1ms, closed));
}

TEST_CASE("from its first word on it has the time from word to word", "[unit][inverter]") {
  Watched watched;
  const InverterWatch& watch = watched.watch;
  watched.hear(closed + 2s);
  CHECK(watch.is_talking(closed + 7s));
  CHECK_FALSE(watch.is_silent(closed + 7s, closed));
  CHECK_FALSE(watch.is_talking(closed + 7s + 1ms));
  CHECK(watch.is_silent(closed + 7s + 1ms, closed));
}

TEST_CASE("one that talked when the pack closed has begun, one that was long gone has not", "[unit][inverter]") {
  Watched talked;
  talked.hear(closed - 5s);
  CHECK(talked.watch.is_silent(closed + 1ms, closed));
  Watched gone;
  gone.hear(closed - 5s - 1ms);
  CHECK_FALSE(gone.watch.is_silent(closed + 60s, closed));
  CHECK(gone.watch.is_silent(closed + 60s + 1ms, closed));
}

TEST_CASE("one whose keep-alive nobody listens for is never silent", "[unit][inverter]") {
  InverterConfig config = with("pylontech");
  config.silence_max = {};
  Watched watched(config);
  CHECK_FALSE(watched.watch.is_silent(closed + 1h, closed));
  watched.hear(closed);
  CHECK(watched.watch.is_talking(closed + 5s));
  CHECK_FALSE(watched.watch.is_talking(closed + 5s + 1ms));
  CHECK_FALSE(watched.watch.is_silent(closed + 1h, closed));
}

TEST_CASE("frames are counted, and those of a wrong length change nothing", "[unit][inverter]") {
  Watched watched(with("sma"));
  watched.hear(closed, {.voltage_mV = known(53'200), .has_failed = true});
  CHECK(watched.watch.frames_taken() == 2);
  CHECK(watched.watch.report().voltage_mV == known(53'200));
  CHECK(watched.watch.observe(data_frame(0x305, 7), closed + 5s));
  CHECK(watched.watch.frames_refused() == 1);
  CHECK(watched.watch.heard_at() == closed);
  CHECK_FALSE(watched.watch.observe(data_frame(0x620, 8), closed));
  CHECK(watched.watch.has_trouble(closed + 5s));
  CHECK_FALSE(watched.watch.has_trouble(closed + 5s + 1ms));
  watched.watch.forget_values();
  CHECK_FALSE(watched.watch.has_trouble(closed));
  CHECK_FALSE(watched.watch.is_talking(closed));
}

TEST_CASE("a state of SMA's 306h that is not documented is counted, and changes nothing", "[unit][inverter]") {
  Watched watched(with("sma"));
  CanFrame state = data_frame(0x306, 8);
  const auto says = [&](std::uint8_t number) {
    state.data = {98, 0, 0, number, 0, 0, 0, 0};
    REQUIRE(watched.watch.observe(state, closed));
    return watched.watch.report();
  };
  CHECK(says(4).has_failed);
  CHECK(says(4).values_out_of_range == 0);
  for (const std::uint8_t undocumented : std::initializer_list<std::uint8_t>{2, 5, 0xFF})
    CHECK(says(undocumented).has_failed);
  CHECK(watched.watch.report().values_out_of_range == 3);
  CHECK_FALSE(says(1).has_failed);
  CHECK(says(3).has_warning);
  CHECK(says(2).has_warning);
  CHECK_FALSE(says(0).has_warning);
  CHECK(watched.watch.report().values_out_of_range == 4);
  state.data[0] = 101;  // per cent of health
  REQUIRE(watched.watch.observe(state, closed));
  CHECK(watched.watch.report().values_out_of_range == 5);
  watched.watch.forget_values();
  CHECK(watched.watch.report().values_out_of_range == 5);
}

TEST_CASE("who else tells the inverter of a battery is remembered for a while", "[unit][inverter]") {
  Watched watched;
  CHECK(watched.watch.observe(data_frame(0x351, 8), closed));
  CHECK(watched.watch.has_foreign_battery(closed + InverterWatch::foreign_memory));
  CHECK_FALSE(watched.watch.has_foreign_battery(closed + InverterWatch::foreign_memory + 1ns));
  CHECK(watched.watch.observe(data_frame(0x35E, 1), closed + 10s));  // of any length
  CHECK(watched.watch.foreign_at() == closed + 10s);
}

TEST_CASE("the faults' rows hold as the watch says, and as the pack file wants it", "[unit][faults][inverter]") {
  for (const SilentInverter when_silent : {SilentInverter::warn, SilentInverter::stop, SilentInverter::open}) {
    InverterConfig config = with("sma");
    config.when_silent = when_silent;
    Watched watched(config);
    PackState pack;
    FaultInputs in{.now = closed + 1s, .pack = &pack, .inverter = &watched.watch};
    in.flags.closed_since = closed;
    CHECK_FALSE(holds(fault_readers::inverter_silent(in)));
    CHECK_FALSE(holds(fault_readers::inverter_lost(in)));
    CHECK_FALSE(holds(fault_readers::inverter_trouble(in)));
    CHECK_FALSE(holds(fault_readers::foreign_battery(in)));
    watched.hear(closed, {.has_failed = true});
    CHECK(holds(fault_readers::inverter_trouble(in)));
    CHECK(watched.watch.observe(data_frame(0x351, 8), closed));
    CHECK(holds(fault_readers::foreign_battery(in)));
    in.now = closed + 6s;
    CHECK(holds(fault_readers::inverter_silent(in)) == (when_silent != SilentInverter::open));
    CHECK(holds(fault_readers::inverter_lost(in)) == (when_silent == SilentInverter::open));
  }
}

TEST_CASE("without an inverter its rows hold nothing", "[unit][faults][inverter]") {
  PackState pack;
  FaultInputs none{.now = closed, .pack = &pack};
  none.flags.closed_since = closed - 1h;
  const InverterWatch nobody;
  FaultInputs silent = none;
  silent.inverter = &nobody;
  for (Reading (*read)(const FaultInputs&) : {fault_readers::inverter_silent, fault_readers::inverter_lost,
                                              fault_readers::inverter_trouble, fault_readers::foreign_battery}) {
    CHECK_FALSE(holds(read(none)));
    CHECK_FALSE(holds(read(silent)));
  }
}

TEST_CASE("the gate lets no word out that lets more flow than was decided", "[unit][gate][inverter]") {
  const InverterDriver& pylon = *find_device("pylontech")->inverter;
  const InverterDriver& sma = *find_device("sma")->inverter;
  const BatteryReport decided{.charge_voltage_limit_mV = 56'000,
                              .discharge_voltage_limit_mV = 44'800,
                              .charge_limit_mA = 50'000,
                              .discharge_limit_mA = 100'000,
                              .may_charge = true,
                              .may_discharge = true};
  const GateRules rules{.inverter = &sma,
                        .inverter_charge_mA = 50'000,
                        .inverter_discharge_mA = 100'000,
                        .inverter_charge_voltage_mV = 56'000,
                        .inverter_discharge_voltage_mV = 44'800};
  const auto judge = [&](const InverterDriver& driver, std::size_t index, const BatteryReport& told, GateRules by) {
    by.inverter = &driver;
    return judge_output(Port::inverter, *driver.frame(index, told, {}), by);
  };
  for (const InverterDriver* driver : {&sma, &pylon}) {
    CHECK(judge(*driver, 0, decided, rules) == GateVerdict::pass);
    for (std::int32_t BatteryReport::*more : {&BatteryReport::charge_voltage_limit_mV, &BatteryReport::charge_limit_mA,
                                              &BatteryReport::discharge_limit_mA}) {
      BatteryReport told = decided;
      told.*more += 100;
      CHECK(judge(*driver, 0, told, rules) == GateVerdict::not_permitted);
    }
  }
  BatteryReport deeper = decided;
  deeper.discharge_voltage_limit_mV -= 100;
  CHECK(judge(sma, 0, deeper, rules) == GateVerdict::not_permitted);
  CHECK(judge(pylon, 1, decided, rules) == GateVerdict::pass);
  GateRules no_charge = rules;
  no_charge.inverter_charge_mA = 0;
  CHECK(judge(pylon, 1, decided, no_charge) == GateVerdict::not_permitted);
  CHECK(judge(pylon, 1, {.may_discharge = true}, no_charge) == GateVerdict::pass);
  CHECK(judge(pylon, 1, {.asks_for_charge = true}, no_charge) == GateVerdict::not_permitted);
  GateRules no_discharge = rules;
  no_discharge.inverter_discharge_mA = 0;
  CHECK(judge(pylon, 1, {.may_discharge = true}, no_discharge) == GateVerdict::not_permitted);
  CHECK(judge(pylon, 1, {.may_charge = true}, no_discharge) == GateVerdict::pass);
  no_discharge.inverter_discharge_mA = 1;
  CHECK(judge(pylon, 1, {.may_discharge = true}, no_discharge) == GateVerdict::pass);
  CHECK(judge(pylon, 0, {.discharge_voltage_limit_mV = 44'800}, {}) == GateVerdict::pass);
}

TEST_CASE("the gate lets no wish for a charge out where none may flow in, or nobody knows how full the pack is",
          "[unit][gate][inverter]") {
  const InverterDriver& pylon = *find_device("pylontech")->inverter;
  for (bool BatteryReport::*wish : {&BatteryReport::asks_for_charge, &BatteryReport::asks_for_full_charge}) {
    BatteryReport told;
    told.*wish = true;
    const CanFrame requests = *pylon.frame(1, told, {});
    const auto judge = [&](std::int32_t charge_mA, bool is_soc_known) {
      return judge_output(Port::inverter, requests,
                          {.inverter = &pylon, .inverter_charge_mA = charge_mA, .is_soc_known = is_soc_known});
    };
    CHECK(judge(1, true) == GateVerdict::pass);
    CHECK(judge(0, true) == GateVerdict::not_permitted);
    CHECK(judge(1, false) == GateVerdict::not_permitted);
    CHECK(judge(0, false) == GateVerdict::not_permitted);
  }
}

TEST_CASE("the gate knows what is the inverter's, in its right form", "[unit][gate][inverter]") {
  const InverterDriver& sma = *find_device("sma")->inverter;
  const CanFrame limits = *sma.frame(0, {}, {});
  CHECK(judge_output(Port::inverter, limits, {}) == GateVerdict::not_ours);
  const GateRules rules{.inverter = &sma};
  CHECK(judge_output(Port::inverter, limits, rules) == GateVerdict::pass);
  CHECK(judge_output(Port::vehicle, limits, rules) == GateVerdict::not_ours);
  CHECK(judge_output(Port::inverter, data_frame(0x620, 8), rules) == GateVerdict::not_ours);
  CHECK(judge_output(Port::inverter, data_frame(0x305, 8), rules) == GateVerdict::not_ours);
  CHECK(judge_output(Port::inverter, data_frame(0x351, 3), rules) == GateVerdict::malformed);
}
