// The layer that opens without the daemon: the modules' alarm outputs in the enable loop of the PDU. The daemon is
// frozen, while a sender repeats its last command, as a daemon would with a hanging decision and a running control
// loop.
#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "config/pack_config.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"
#include "tools/common/virtual_run.hpp"

namespace bmu {
namespace {

/// Sends the last CONTACTOR_COMMAND of a core every 50 ms, with a counter that goes on and a correct checksum.
class LiveSender : public CoreTap {
 public:
  void observed(const Observation& /*observation*/) override {}
  void decided(TimePoint /*at*/, const Decisions& decisions) override {
    for (const OutgoingFrame& sent : decisions.frames) {
      if (sent.frame.id == internal_bus::contactor_command.base_id) last_ = sent.frame;
    }
  }
  void tick(VirtualRun& run) {
    REQUIRE(last_);
    if (run.now() < next_at_) return;
    next_at_ = run.now() + internal_bus::contactor_command.period;
    seal(internal_bus::contactor_command, static_cast<std::uint8_t>(last_->data[6] + 1), *last_);
    run.simulator().observe(*last_, run.now());
  }

 private:
  std::optional<CanFrame> last_;
  TimePoint next_at_{};
};

/// A closed pack with a daemon that is frozen from then on, and with its last command repeated.
class FrozenDaemon {
 public:
  FrozenDaemon(const std::string& pack, std::string_view script)
      : config_(load(pack)),
        run_(config_, simulator_config(config_),
             *parse_scenario("0 pack soc_permille 700\n1.5 vehicle on\n" + std::string(script))) {
    run_.set_tap(&sender_);
    while (run_.elapsed() < 5s) run_.step();
    REQUIRE(run_.core().sequence().phase == Phase::closed);
    run_.stop();
  }
  void run(Duration duration) {
    for (const TimePoint end = run_.now() + duration; run_.now() < end;) {
      sender_.tick(run_);
      run_.step();
    }
  }
  void apply(const std::string& event) { REQUIRE(run_.simulator().apply(event)); }
  [[nodiscard]] const Pdu& pdu() const { return run_.simulator().pdu(); }
  [[nodiscard]] bool is_closed() const {
    const ContactorFlags feedback = run_.simulator().world().plant.feedback();
    return feedback[0] && feedback[1];
  }
  [[nodiscard]] bool is_open() const {
    const ContactorFlags feedback = run_.simulator().world().plant.feedback();
    return !feedback[0] && !feedback[1] && !feedback[2] && !feedback[3];
  }

 private:
  static CoreConfig load(const std::string& name) {
    const auto pack = load_pack_config(test::in_source("config/packs/" + name + ".json"));
    REQUIRE(pack);
    return pack->core;
  }

  CoreConfig config_;
  LiveSender sender_;
  VirtualRun run_;
};

constexpr std::string_view with_loop = "0 pdu alarm_loop on";
constexpr Duration module_takes = 3'300ms;  // 31 checks of 100 ms, an average, a tick and the contacts

TEST_CASE("a frozen daemon with a live sender cannot keep an overcharged pack closed", "[scenario][SEC_1][BMS_F.3]") {
  for (const char* const pack : {"lipo-6s-24v", "shell-eco-6s", "demo-48s"}) {
    CAPTURE(pack);
    FrozenDaemon frozen(pack, with_loop);
    frozen.run(5s);
    REQUIRE(frozen.is_closed());
    REQUIRE(frozen.pdu().counts().timeouts == 0);  // the second layer, the command timeout, has not acted
    frozen.apply("cell 1.2 voltage_mV 4600");
    frozen.run(module_takes);
    CHECK(frozen.is_open());
    CHECK(frozen.pdu().counts().alarms == 1);
    CHECK(frozen.pdu().counts().timeouts == 0);
    frozen.apply("cell 1.2 voltage_mV auto");
    frozen.run(10s);
    CHECK(frozen.is_open());
    CHECK(frozen.pdu().counts().alarms == 1);
  }
}

TEST_CASE("without the alarm loop the same pack stays closed", "[scenario][SEC_1]") {
  FrozenDaemon frozen("lipo-6s-24v", "");
  frozen.apply("cell 1.2 voltage_mV 4600");
  frozen.run(10s);
  CHECK(frozen.is_closed());
  CHECK(frozen.pdu().counts().alarms == 0);
}

TEST_CASE("a frozen daemon with a live sender cannot keep a pack with a hot cell closed", "[scenario][SEC_1]") {
  FrozenDaemon frozen("lipo-6s-24v", with_loop);
  frozen.apply("cell 1.1 temperature_dC 900");
  frozen.run(2s);
  CHECK(frozen.is_open());
  CHECK(frozen.pdu().counts().alarms == 1);
}

TEST_CASE("thermal shutdown of a front end opens the alarm loop", "[scenario][SEC_1]") {
  FrozenDaemon frozen("shell-eco-6s", with_loop);
  frozen.apply("module 1 front_end_thermal_shutdown on");
  frozen.run(100ms);
  CHECK(frozen.is_open());
}

TEST_CASE("a module without any supply opens the alarm loop", "[scenario][SEC_1]") {
  FrozenDaemon frozen("demo-48s", with_loop);
  for (int cell = 1; cell <= 12; ++cell) frozen.apply("cell 1." + std::to_string(cell) + " voltage_mV 300");
  frozen.run(200ms);
  CHECK(frozen.is_closed());  // on its external supply
  frozen.apply("module 1 external_supply_mV 0");
  frozen.run(200ms);
  CHECK(frozen.is_open());
}

TEST_CASE("a front end that is disconnected opens the alarm loop", "[scenario][SEC_1][BMS_F.3]") {
  FrozenDaemon frozen("lipo-6s-24v", with_loop);
  frozen.apply("module 1 crc_errors on");
  frozen.run(400ms);
  CHECK(frozen.is_open());
  CHECK(frozen.pdu().counts().alarms == 1);
}

TEST_CASE("an empty cell does not open the alarm loop, so that the pack can be charged", "[scenario][SEC_1]") {
  FrozenDaemon frozen("lipo-6s-24v", with_loop);
  frozen.apply("cell 1.2 voltage_mV 2000");
  frozen.run(10s);
  CHECK(frozen.is_closed());
  CHECK(frozen.pdu().counts().alarms == 0);
}

TEST_CASE("a module that starts again does not close what its alarm has opened", "[scenario][SEC_1]") {
  FrozenDaemon frozen("lipo-6s-24v", with_loop);
  frozen.apply("cell 1.2 voltage_mV 4600");
  frozen.run(module_takes);
  REQUIRE(frozen.is_open());
  frozen.apply("cell 1.2 voltage_mV auto");
  frozen.apply("module 1 restart");
  frozen.run(10s);
  CHECK(frozen.is_open());
}

TEST_CASE("a daemon that decides names the open alarm loop, and closes again once it is cleared", "[scenario][SEC_1]") {
  const auto pack = load_pack_config(test::in_source("config/packs/lipo-6s-24v.json"));
  REQUIRE(pack);
  // The module's own limit is lower than the pack file's: only the module finds the cell too hot.
  SimulatorConfig world = simulator_config(pack->core);
  world.modules[0].alarm_temperature_dC = 400;
  VirtualRun run(pack->core, world,
                 *parse_scenario("0 pdu alarm_loop on\n0 pack soc_permille 700\n1.5 vehicle on\n"
                                 "5 cell 1.1 temperature_dC 250..420 over 35\n"  // slower than a cell that fails
                                 "44 cell 1.1 temperature_dC 420..250 over 40\n86 master clear\n88 vehicle off\n"
                                 "89 vehicle on",
                                 core_vocabulary()));
  const auto run_to = [&run](Duration end) {
    while (run.elapsed() < end) run.step();
  };
  run_to(5s);
  REQUIRE(run.core().sequence().phase == Phase::closed);
  run_to(42s);
  CHECK(run.core().sequence().phase == Phase::open);
  CHECK(run.core().faults().state(FaultId::alarm_loop_open).is_present());
  run_to(60s);
  CHECK(run.core().faults().state(FaultId::alarm_loop_open).is_present());
  CHECK_FALSE(run.simulator().pdu().outputs().contactors[0]);
  run_to(88s);
  CHECK_FALSE(run.core().faults().state(FaultId::alarm_loop_open).is_present());
  run_to(95s);
  CHECK(run.core().sequence().phase == Phase::closed);
}

}  // namespace
}  // namespace bmu
