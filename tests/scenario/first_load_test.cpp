// The first load or charge after the closing, with the packs as shipped: it reveals a reversed current sensor, however
// soon it comes and however small it stays, and confirms no fault with a correct one. As stated in
// docs/commissioning.md.
#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <string>

#include "config/pack_config.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/patched_pack.hpp"
#include "tests/support/wired_pack.hpp"

using namespace bmu;
using test::WiredPack;

namespace {

constexpr std::array packs{"demo-48s",       "charger-48s",     "lipo-6s-24v", "shell-eco-6s", "outlander-80s",
                           "traction-16x12", "storage-16s-48v", "i3-96s",      "lfp-96s",      "fs-20s3p-84v"};
constexpr Duration named_within = 500ms;
/// Before and after the time at which the closed pack has been calm for long enough.
constexpr Duration soon_after_closing[] = {150ms, 300ms, 500ms, 700ms, 1s, 1'200ms, 1'500ms, 3s, 8s};

const FaultState& contradiction(const WiredPack& pack) {
  return pack.core().faults().state(FaultId::current_contradicts_voltage);
}

std::string load(double current_A) {
  return "load current_A " + std::to_string(current_A);
}

/// A pack that has just closed: its key was turned 1.5 s after the start, after `events`.
WiredPack closed_pack(const CoreConfig& config, const std::string& events, std::int32_t cell_noise_uV = 0) {
  WiredPack pack(config, {}, test::slowest_bus, WiredPack::start, cell_noise_uV);
  pack.apply("pack soc_permille 600" + events);
  REQUIRE(pack.close());
  return pack;
}
WiredPack closed_pack(const std::string& name, const std::string& events, std::int32_t cell_noise_uV = 0) {
  const auto config = load_pack_config(test::in_source("config/packs/" + name + ".json"));
  REQUIRE(config.has_value());
  return closed_pack(config->core, events, cell_noise_uV);
}

/// Every kind of current source of the core, in place of the demonstration's sensor.
struct SensorKind {
  const char* name;
  const char* keys;
};
constexpr SensorKind sensor_kinds[] = {
    {"results as they come", R"("little_endian": false)"},
    {"results in little-endian", R"("little_endian": true)"},
    {"IVT-S that is verified", R"("protocol": "ivt_s")"},
    {"IVT-S that is configured", R"("protocol": "ivt_s", "set_up": "configure")"},
    {"LEM CAB", R"("current_protocol": "lem_cab")"},
    {"sensor of an Outlander", R"("current_protocol": "outlander_current")"},
    {"two sensors", R"("has_second_current": true)"},
    {"two sensors of two makers", R"("has_second_current": true, "second_protocol": "lem_cab")"},
};
CoreConfig with_sensor(const SensorKind& kind, bool is_inverted) {
  const std::string sign = is_inverted ? "true" : "false";
  return test::patched_pack(R"({"sensor": {"little_endian": null, "invert_current": )" + sign + ", " + kind.keys +
                            "}}");
}

/// Time from a step of the current to the fault of a reversed sensor.
std::optional<Duration> time_to_name(WiredPack pack, Duration after_closing, double current_A) {
  pack.run(after_closing);
  pack.apply(load(current_A));
  const TimePoint stepped_at = pack.now();
  const bool is_named = pack.run_until([](const WiredPack& now) { return contradiction(now).is_present(); }, 5s);
  return is_named ? std::optional(pack.now() - stepped_at) : std::nullopt;
}

void check_named(const std::string& name, const std::string& events, std::initializer_list<double> currents_A,
                 std::span<const Duration> afters) {
  const WiredPack reversed = closed_pack(name, "; sensor current inverted on" + events);
  for (const double current_A : currents_A) {
    for (const Duration after : afters) {
      CAPTURE(name, events, current_A, to_ms(after));
      CHECK(time_to_name(reversed, after, current_A).value_or(5s) <= named_within);
    }
  }
}

}  // namespace

TEST_CASE("a sensor the wrong way round is named by the first 5 A, however soon after the closing they flow",
          "[scenario][estimators][F18]") {
  constexpr Duration afters[] = {150ms, 1s, 1'500ms};
  for (const char* const name : {"i3-96s", "outlander-80s"}) check_named(name, "", {5.1, -5.1, 15.0}, afters);
}

TEST_CASE("of every kind of current sensor the first load names the one that is the wrong way round",
          "[scenario][estimators][sensors][F18]") {
  for (const SensorKind& kind : sensor_kinds) {
    for (const bool is_inverted : {false, true}) {
      CAPTURE(kind.name, is_inverted);
      const CoreConfig config = with_sensor(kind, is_inverted);
      const std::string wrong = "; sensor current inverted on";
      const std::string both = config.sensor.has_second_current ? "; sensor current_2 inverted on" : "";
      const WiredPack reversed = closed_pack(config, wrong + both);
      for (const double current_A : {15.0, -15.0}) {
        CAPTURE(current_A);
        CHECK(time_to_name(reversed, 1s, current_A).value_or(5s) <= named_within);
      }
      // With correct direction nothing contradicts, and a current out of the pack is positive.
      WiredPack right = closed_pack(config, "");
      right.run(1s);
      right.apply(load(15.0));
      right.run(3s);
      CHECK(contradiction(right).count == 0);
      CHECK(right.core().pack().current_mA.is_valid());
      CHECK(right.core().pack().current_mA.value > 14'000);
      // A single reversed one of two contradicts the other.
      if (!config.sensor.has_second_current) continue;
      WiredPack single = closed_pack(config, "; sensor current_2 inverted on");
      single.run(1s);
      single.apply(load(15.0));
      CHECK(single.run_until(
          [](const WiredPack& now) {
            return now.core().faults().state(FaultId::current_sensors_disagree).is_present();
          },
          2s));
    }
  }
}

TEST_CASE("of each pack as shipped a sensor the wrong way round is named by the first 5 A",
          "[scenario][estimators][F18][slow]") {
  for (const char* const name : packs) check_named(name, "", {5.1, -5.1, 8.0, -15.0, 19.0}, soon_after_closing);
}

TEST_CASE("of warm cells, which have less resistance, it takes 7 A", "[scenario][estimators][F18][slow]") {
  for (const char* const name : packs) {
    check_named(name, "; pack temperature_dC 440", {7.0, -7.0}, soon_after_closing);
  }
}

TEST_CASE("less than 5 A names no sensor: its offset may be a part of them", "[scenario][estimators]") {
  for (const char* const name : {"i3-96s", "lfp-96s", "outlander-80s"}) {
    const WiredPack reversed = closed_pack(name, "; sensor current inverted on");
    CAPTURE(name);
    CHECK_FALSE(time_to_name(reversed, 1s, 4.8).has_value());
  }
}

TEST_CASE("a sensor that is right is not suspected, whatever flows first after the closing",
          "[scenario][estimators][slow]") {
  constexpr std::int32_t noise_uV = 2'000;
  for (const char* const name : packs) {
    const WiredPack closed = closed_pack(name, "", noise_uV);
    for (const double current_A : {5.1, -5.1, 15.0}) {
      for (const Duration after : {150ms, 700ms, 1'500ms}) {
        CAPTURE(name, current_A, to_ms(after));
        WiredPack pack = closed;
        pack.run(after);
        for (const double now_A : {current_A, 0.0, -current_A / 2.0, current_A}) {
          pack.apply(load(now_A));
          pack.run(15s);
        }
        CHECK(contradiction(pack).count == 0);
        CHECK(pack.phase() == Phase::closed);
      }
    }
  }
}
