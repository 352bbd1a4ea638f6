// A charger on a bus of its own: its commands and reports are on that bus and on no other.
#include <string>

#include "daemon/core/core_tap.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/patched_pack.hpp"
#include "tools/common/virtual_run.hpp"

using namespace bmu;

namespace {

CoreConfig pack_with(const std::string& protocol) {
  return test::patched_pack(
      R"({"buses": {"internal": "unix:modules", "vehicle": "unix:vehicle", "charger": "unix:wall"},
    "interfaces": {"charger_kbit_per_s": )" +
      std::string(protocol == "elcon_tc" ? "250" : "500") +
      R"(}, "contactors": {"precharge_overcurrent_mA": 6000, "precharge_energy_J": 5000},
    "charger": {"current_max_mA": 8000, "protocol": ")" +
      protocol + "\"}}");
}

/// Counts the charger's reports, and the commands to it, by port.
class BusWatch : public CoreTap {
 public:
  explicit BusWatch(const ChargerDriver& driver) : driver_(&driver) {}

  void observed(const Observation& observation) override {
    const auto* const received = std::get_if<FrameReceived>(&observation.what);
    if (received == nullptr) return;
    std::array<ChargerReport, charger_units_max> ignored{};
    if (driver_->take(received->frame, ignored).word == ChargerWord::none) return;
    ++(received->port == Port::charger ? told_there : told_elsewhere);
  }
  void decided(TimePoint /*at*/, const Decisions& decisions) override {
    for (const OutgoingFrame& out : decisions.frames) {
      if (driver_->order_of(out.frame)) ++(out.port == Port::charger ? commanded_there : commanded_elsewhere);
    }
  }

  int told_there = 0;
  int told_elsewhere = 0;
  int commanded_there = 0;
  int commanded_elsewhere = 0;

 private:
  const ChargerDriver* driver_;
};

struct OwnBus {
  CoreConfig config;
  VirtualRun run;
  BusWatch watch;

  explicit OwnBus(const std::string& protocol)
      : config(pack_with(protocol)), run(config, simulator_config(config), {}), watch(*config.charger.driver) {
    run.set_tap(&watch);
  }
  OwnBus(const OwnBus&) = delete;
  OwnBus& operator=(const OwnBus&) = delete;
  ~OwnBus() { run.set_tap(nullptr); }

  void run_for(Duration span) {
    for (const TimePoint end = run.now() + span; run.now() < end;) run.step();
  }
  void apply(const char* event) { REQUIRE(run.simulator().apply(event)); }
  [[nodiscard]] double flows_A() const { return run.simulator().plant().charger_A(); }
  void charge() {
    run_for(3s);
    apply("charger current_A 20");
    apply("charger connected");
    run_for(20s);
    REQUIRE(run.core().sequence().phase == Phase::closed);
    REQUIRE(flows_A() > 7.9);
  }
};

}  // namespace

TEST_CASE("a charger on a bus of its own charges, stops when it is unplugged, and opens the pack when it is lost",
          "[scenario][charge][BMU_11]") {
  const std::string protocol = GENERATE("elcon_tc", "brusa_nlg5");
  CAPTURE(protocol);
  OwnBus own(protocol);
  const Core& core = own.run.core();
  own.charge();
  CHECK(core.charge_control().stage() == ChargeStage::charging);
  SECTION("unplugged") {
    own.apply("charger disconnected");
    own.run_for(1s);
    CHECK(core.charge_control().stage() == ChargeStage::off);
    CHECK(core.last_opening().cause == OpeningCause::request_over);
  }
  SECTION("without mains") {
    own.apply("charger mains off");
    own.run_for(core.chargers().silence_max() + 200ms);
    CHECK(core.last_opening().fault == FaultId::charger_silent);
  }
  CHECK(core.sequence().phase == Phase::open);
  CHECK(own.flows_A() == 0.0);
  CHECK(own.watch.told_there > 15);
  CHECK(own.watch.told_elsewhere == 0);
  CHECK(own.watch.commanded_there > 30);
  CHECK(own.watch.commanded_elsewhere == 0);
}

TEST_CASE("a charger hears commands on its own bus alone", "[scenario][simulator][charge]") {
  const CoreConfig config = pack_with("elcon_tc");
  const TimePoint start{1s};
  Simulator simulator(simulator_config(config), {}, start);
  const CanFrame command =
      config.charger.driver->command(0, {.is_enabled = true, .voltage_mV = 200'000, .current_mA = 5'000});
  // It reports the trouble "no command" 5 s after the last.
  const auto hears_none = [&](Duration span) {
    bool is_without = false;
    std::array<ChargerReport, charger_units_max> reports{};
    for (const TimePoint end = simulator.now() + span; simulator.now() < end;) {
      for (const SentFrame& sent : simulator.advance(simulator.now() + 1ms)) {
        CHECK(config.charger.driver->take(sent.frame, reports).word == ChargerWord::none);
      }
      for (const SentFrame& sent : simulator.sent_by_charger()) {
        REQUIRE(config.charger.driver->take(sent.frame, reports).word == ChargerWord::values);
        is_without = reports[0].troubles == bit_of(ChargerTrouble::no_command);
      }
    }
    return is_without;
  };
  CHECK_FALSE(hears_none(4s));
  simulator.observe(command, simulator.now());
  simulator.observe_elsewhere(Port::vehicle, command, simulator.now());
  CHECK(hears_none(3s));
  simulator.observe_elsewhere(Port::charger, command, simulator.now());
  CHECK_FALSE(hears_none(4s));
}
