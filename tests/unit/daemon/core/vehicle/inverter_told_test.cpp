// Limits that the core sends to an inverter: the comparison by the output gate, and a report that is not sent.
#include <algorithm>
#include <optional>

#include "devices/device_list.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;

namespace {

CoreConfig pack_with_inverter() {
  CoreConfig config = test::small_pack();
  // Half a minute of the peak is available at first: an inverter must not use the present limit of the pack.
  config.current.charge_peak_mA = 25'000;
  config.current.discharge_peak_mA = 95'000;
  config.inverter = {.driver = find_device("pylontech")->inverter,
                     .when_silent = SilentInverter::stop,
                     .charge_voltage_max_mV = 33'000,
                     .discharge_voltage_min_mV = 24'000,
                     .discharge_max_mA = 30'000};
  return config;
}

/// Pack and an inverter that sends a message each second, in the middle between two rounds, so that a report sent when
/// it falls silent is not a regular one.
struct Bench {
  test::CoreBench core_bench;
  const InverterDriver& driver = *find_device("pylontech")->inverter;
  bool talks = true;

  explicit Bench(const CoreConfig& config = pack_with_inverter()) : core_bench(config) {
    core_bench.each_ms = [this] {
      const bool is_due = to_ms(core_bench.now().time_since_epoch()) % 1'000 == 600;
      if (!is_due || !talks) return;
      for (const CanFrame& frame : driver.words({})) core_bench.observe(FrameReceived{Port::vehicle, frame});
    };
    set_port(true);
  }
  Bench(const Bench&) = delete;
  Bench& operator=(const Bench&) = delete;

  void set_port(bool is_up) { core_bench.observe(PortChanged{Port::inverter, is_up}); }
  [[nodiscard]] const Core& core() const { return core_bench.core(); }
  /// Result of the output gate for a frame of this report.
  [[nodiscard]] GateVerdict judge(std::size_t index, const BatteryReport& report) const {
    return judge_output(Port::inverter, *driver.frame(index, report, {}), core().gate_rules());
  }
  /// Result for limits with the usual voltages.
  [[nodiscard]] GateVerdict judge(std::int32_t charge_mA, std::int32_t discharge_mA) const {
    return judge(0, {.charge_voltage_limit_mV = 33'000,
                     .discharge_voltage_limit_mV = 24'000,
                     .charge_limit_mA = charge_mA,
                     .discharge_limit_mA = discharge_mA});
  }
  /// Number of limit frames since the `from`-th frame.
  [[nodiscard]] std::ptrdiff_t limits_told_since(std::size_t from) const {
    const auto& sent = core_bench.sent();
    return std::count_if(sent.begin() + static_cast<std::ptrdiff_t>(from), sent.end(), is_limits);
  }
  static bool is_limits(const OutgoingFrame& sent) { return sent.port == Port::inverter && sent.frame.id == 0x351; }

  /// Closes the pack, and keeps the inverter silent until the tick before zero limits are sent; they are not sent yet.
  void run_to_silence() {
    REQUIRE(core_bench.close());
    core_bench.run(3s);
    talks = false;
    REQUIRE(core_bench.run_until([this] { return !core().is_inverter_silent() && is_about_to_be_silent(); }, 10s));
  }
  [[nodiscard]] bool is_about_to_be_silent() const {
    return core_bench.now() - core().inverter().heard_at() >= 4'990ms;
  }
};

}  // namespace

TEST_CASE("the gate bounds what the inverter is told by what is decided for it, not by what the pack may now",
          "[unit][gate][inverter]") {
  Bench bench;
  CHECK(bench.judge(0, 0) == GateVerdict::pass);
  CHECK(bench.judge(100, 0) == GateVerdict::not_permitted);  // not closed yet
  REQUIRE(bench.core_bench.close());
  bench.core_bench.run(2s);
  REQUIRE(bench.core().limits().charge.limit_mA == 25'000);
  REQUIRE(bench.core().limits().discharge.limit_mA == 95'000);
  CHECK(bench.judge(20'000, 30'000) == GateVerdict::pass);
  CHECK(bench.judge(20'100, 30'000) == GateVerdict::not_permitted);  // continuous limit
  CHECK(bench.judge(20'000, 30'100) == GateVerdict::not_permitted);  // limit of the pack file
  CHECK(bench.judge(1, {.may_charge = true, .may_discharge = true}) == GateVerdict::pass);
  CHECK(bench.core().gate_refusals() == 0);
  SECTION("an inverter that is not heard") {
    bench.talks = false;
    bench.core_bench.run(6'500ms);
    REQUIRE(bench.core().sequence().phase == Phase::closed);
    REQUIRE(bench.core().limits().charge.limit_mA > 0);
  }
  SECTION("a daemon that ends") {
    bench.core_bench.current_mA = 50'000;
    bench.core_bench.run(50ms);
    bench.core_bench.give(Command::shut_down);
  }
  CHECK(bench.judge(0, 0) == GateVerdict::pass);
  CHECK(bench.judge(100, 0) == GateVerdict::not_permitted);
  CHECK(bench.judge(0, 100) == GateVerdict::not_permitted);
  CHECK(bench.judge(1, {.may_charge = true}) == GateVerdict::not_permitted);
  CHECK(bench.judge(1, {.may_discharge = true}) == GateVerdict::not_permitted);
  CHECK(bench.core().gate_refusals() == 0);
}

TEST_CASE("the gate lets a wish for a charge out when the state of charge is known", "[unit][gate][inverter]") {
  Bench bench;
  REQUIRE(bench.core_bench.close());
  REQUIRE(bench.core_bench.run_until([&] { return bench.core().soc_permille().has_value(); }, 60s));
  CHECK(bench.core().gate_rules().is_soc_known);
  CHECK(bench.judge(1, {.asks_for_charge = true, .asks_for_full_charge = true}) == GateVerdict::pass);
  Bench blind;
  REQUIRE_FALSE(blind.core().soc_permille().has_value());
  CHECK_FALSE(blind.core().gate_rules().is_soc_known);
}

TEST_CASE("a limit that fell while its port was away is told when the port is back, not a round later",
          "[unit][core][inverter]") {
  Bench bench;
  bench.run_to_silence();
  bench.set_port(false);
  bench.core_bench.run(50ms);
  REQUIRE(bench.core().is_inverter_silent());
  const std::size_t before = bench.core_bench.sent().size();
  bench.set_port(true);
  bench.core_bench.run(220ms);
  CHECK(bench.limits_told_since(before) == 1);
}

TEST_CASE("a limit that fell and that the bus did not take is told again at once", "[unit][core][inverter]") {
  const bool is_lost = GENERATE(true, false);
  Bench bench;
  bench.run_to_silence();
  const std::size_t before = bench.core_bench.sent().size();
  REQUIRE(bench.core_bench.run_until([&] { return bench.limits_told_since(before) == 1; }, 100ms));
  REQUIRE(bench.core().is_inverter_silent());
  const OutgoingFrame told = *std::find_if(bench.core_bench.sent().begin() + static_cast<std::ptrdiff_t>(before),
                                           bench.core_bench.sent().end(), Bench::is_limits);
  if (is_lost) bench.core_bench.observe(SendFailed{told.port, told.frame});
  bench.core_bench.run(220ms);
  CHECK(bench.limits_told_since(before) == (is_lost ? 2 : 1));
}
