// A load that is switched moves cells, pack and current between two samples of them, however these stand to the step:
// a sound pack warns of nothing and stays closed, and a voltage that is wrong opens it all the same.
//
// Swept: the load and its way, how the devices' periods stand to the core's ticks, when the step comes between two
// POLLs, how late the frames of the sensor come, and how often the load is switched: every 30 ms or more rarely, as a
// load that is switched every 20 ms, in step with the averages of the sensor, looks constant to it, and nothing
// explains what the cells do.
#include <chrono>
#include <set>
#include <string>
#include <vector>

#include "config/pack_config.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/wired_pack.hpp"

namespace bmu {
namespace {

using test::Fate;
using test::WiredPack;

constexpr const char* shipped[] = {"charger-48s", "demo-48s",      "fs-20s3p-84v", "i3-96s",          "lfp-96s",
                                   "lipo-6s-24v", "outlander-80s", "shell-eco-6s", "storage-16s-48v", "traction-16x12"};

CoreConfig config_of(const std::string& name) {
  const auto read = load_pack_config(test::in_source("config/packs/" + name + ".json"));
  REQUIRE(read);
  return read->core;
}

CoreConfig with_second_sensor(const std::string& name) {
  CoreConfig config = config_of(name);
  config.sensor.has_second_current = true;
  config.limits.current_sensors_disagree = {
      .warn = 2'000, .open = 5'000, .hysteresis = 1'000, .confirm = 500ms, .clear = 2s};
  return config;
}

std::string load_A(double current_A) {
  return "load current_A " + std::to_string(current_A);
}

/// Adds the names of all faults that warn or are present.
void add_faults(const WiredPack& pack, std::set<std::string>& names) {
  for (std::size_t fault = 0; fault < fault_count; ++fault) {
    const FaultState& state = pack.core().faults().states()[fault];
    if (state.is_warning || state.is_present()) names.insert(std::string(row_of(static_cast<FaultId>(fault)).name));
  }
}

/// Runs and adds what warns or is present at any millisecond.
void watch(WiredPack& pack, Duration duration, std::set<std::string>& names) {
  for (Duration passed{}; passed < duration; passed += 1ms) {
    pack.run(1ms);
    add_faults(pack, names);
  }
}

/// A pack that has closed and warned of nothing since its key was turned. `late`: the message that comes 25 ms later.
WiredPack closed_pack(const CoreConfig& config, int ahead_ms, const MessageSpec* late = nullptr) {
  WiredPack pack(config, std::chrono::milliseconds(ahead_ms));
  pack.on_sent = [late](CanFrame& frame, const WiredPack&) {
    return late != nullptr && frame.id == late->base_id ? Fate{.delay = 25ms} : Fate{};
  };
  pack.apply("pack soc_permille 600");
  pack.run(3s);
  pack.apply("vehicle on");
  std::set<std::string> found;
  watch(pack, 5s, found);
  REQUIRE(pack.phase() == Phase::closed);
  CHECK(found == std::set<std::string>{});
  return pack;
}

struct Step {
  double before_A;
  double after_A;
};

/// What warns or is present within a second behind the step.
std::set<std::string> faults_of(WiredPack pack, const Step& step, int between_ms) {
  std::set<std::string> found;
  pack.apply(load_A(step.before_A));
  pack.run(1500ms + std::chrono::milliseconds(between_ms));
  add_faults(pack, found);
  pack.apply(load_A(step.after_A));
  watch(pack, 1s, found);
  return found;
}

void check_steps(const std::string& name, const CoreConfig& config, const std::vector<const MessageSpec*>& late) {
  const double full_A = config.current.discharge_continuous_mA * 0.9e-3;
  const double back_A = config.current.charge_continuous_mA * -0.5e-3;
  for (const MessageSpec* const message : late) {
    for (int ahead_ms = 0; ahead_ms < 60; ahead_ms += 13) {
      const WiredPack closed = closed_pack(config, ahead_ms, message);
      for (const Step& step : {Step{0, full_A}, Step{full_A, 0}, Step{full_A / 2, back_A}}) {
        for (int between_ms = 0; between_ms < 50; between_ms += 11) {
          INFO(name << ", " << step.before_A << " A, then " << step.after_A << " A, devices " << ahead_ms
                    << " ms ahead, " << between_ms << " ms more, "
                    << (message != nullptr ? message->name : "no message") << " late");
          CHECK(faults_of(closed, step, between_ms) == std::set<std::string>{});
        }
      }
    }
  }
}

/// Switches the load for a while, or until the contactors are told to open. Returns how long that took.
Duration toggle(WiredPack& pack, double full_A, Duration half_period, Duration at_most, std::set<std::string>& found) {
  const TimePoint began_at = pack.now();
  TimePoint next_at = began_at;
  for (bool is_on = true; pack.now() - began_at < at_most && pack.phase() == Phase::closed;) {
    if (pack.now() >= next_at) {
      pack.apply(load_A(is_on ? full_A : 0));
      next_at += half_period;
      is_on = !is_on;
    }
    watch(pack, 1ms, found);
  }
  return pack.now() - began_at;
}

TEST_CASE("a load that is switched warns of nothing", "[property][faults]") {
  check_steps("demo-48s", config_of("demo-48s"), {nullptr});
}

TEST_CASE("a load that is switched warns of nothing where frames of the sensor are late", "[property][faults][slow]") {
  check_steps("demo-48s", config_of("demo-48s"), {&internal_bus::sensor_u1, &internal_bus::sensor_current});
}

TEST_CASE("a load that is switched warns of nothing in any pack that is shipped", "[property][faults][slow]") {
  for (const char* const name : shipped) {
    DYNAMIC_SECTION(name) {
      check_steps(name, config_of(name), {nullptr});
    }
  }
}

TEST_CASE("two current sensors agree while the load is switched", "[property][faults]") {
  const CoreConfig config = with_second_sensor("demo-48s");
  for (int ahead_ms = 0; ahead_ms < 20; ahead_ms += 7) {
    const WiredPack closed = closed_pack(config, ahead_ms);
    for (Duration half_period = 30ms; half_period <= 200ms; half_period += 10ms) {
      INFO("devices " << ahead_ms << " ms ahead, switched every " << to_ms(half_period) << " ms");
      WiredPack pack = closed;
      std::set<std::string> found;
      (void)toggle(pack, 60, half_period, 5s, found);
      CHECK(pack.phase() == Phase::closed);
      CHECK(found == std::set<std::string>{});
    }
  }
}

TEST_CASE("a current sensor that is wrong opens the pack within a second, however the load is switched",
          "[property][faults]") {
  const CoreConfig config = with_second_sensor("demo-48s");
  for (int ahead_ms = 0; ahead_ms < 20; ahead_ms += 7) {
    const WiredPack closed = closed_pack(config, ahead_ms);
    for (const char* const wrong : {"sensor current offset_mA 10000", "sensor current_2 offset_mA -10000"}) {
      for (Duration half_period = 20ms; half_period <= 300ms; half_period += 35ms) {
        INFO(wrong << ", devices " << ahead_ms << " ms ahead, switched every " << to_ms(half_period) << " ms");
        WiredPack pack = closed;
        std::set<std::string> found;
        pack.apply(wrong);
        CHECK(toggle(pack, 60, half_period, 2s, found) <= 1s);
        CHECK(pack.core().last_opening().fault == FaultId::current_sensors_disagree);
      }
    }
  }
}

// Its bus alone holds the sensor's frames up for as long as 36 ms.
TEST_CASE("a load that is switched again and again warns of nothing in a pack of 192 cells, and does not open it",
          "[property][faults][slow]") {
  const CoreConfig config = config_of("traction-16x12");
  for (int ahead_ms = 0; ahead_ms < 90; ahead_ms += 30) {
    const WiredPack closed = closed_pack(config, ahead_ms);
    for (Duration half_period = 30ms; half_period <= 300ms; half_period += 10ms) {
      INFO("devices " << ahead_ms << " ms ahead, switched every " << to_ms(half_period) << " ms");
      WiredPack pack = closed;
      std::set<std::string> found;
      (void)toggle(pack, 65, half_period, 3s, found);
      CHECK(pack.phase() == Phase::closed);
      CHECK(found == std::set<std::string>{});
    }
  }
}

TEST_CASE("a pack voltage that is wrong opens within a second while the load is switched every 230 ms or more rarely",
          "[property][faults][F14][BMU_4][slow]") {
  const CoreConfig config = config_of("traction-16x12");
  for (int ahead_ms = 0; ahead_ms < 90; ahead_ms += 30) {
    const WiredPack closed = closed_pack(config, ahead_ms);
    for (const char* const offset : {"sensor pack_voltage offset_mV 20000", "sensor pack_voltage offset_mV -20000"}) {
      for (Duration half_period = 230ms; half_period <= 500ms; half_period += 30ms) {
        INFO(offset << ", devices " << ahead_ms << " ms ahead, switched every " << to_ms(half_period) << " ms");
        WiredPack pack = closed;
        std::set<std::string> found;
        pack.apply(offset);
        CHECK(toggle(pack, 65, half_period, 2s, found) <= 1s);
        CHECK(pack.core().last_opening().fault == FaultId::pack_voltage_mismatch);
      }
    }
  }
}

TEST_CASE(
    "a current sensor that counts the wrong way round opens a pack whose load is switched, at any pace of polling",
    "[property][faults][F18]") {
  for (const Duration period : {20ms, 22ms, 40ms, 50ms}) {
    CoreConfig config = config_of("demo-48s");
    config.poll.period = config.poll.fast_period = period;
    for (int ahead_ms = 0; ahead_ms < 20; ahead_ms += 3) {
      INFO("polled every " << to_ms(period) << " ms, devices " << ahead_ms << " ms ahead");
      WiredPack pack = closed_pack(config, ahead_ms);
      pack.apply("sensor current inverted on");
      std::set<std::string> found;
      CHECK(toggle(pack, 20, 1s, 10s, found) <= 3s);
      CHECK(pack.core().last_opening().fault == FaultId::current_contradicts_voltage);
    }
  }
}

}  // namespace
}  // namespace bmu
