// Packs of the reference designs: each value of a design equals the value in the shipped pack file.
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "config/pack_config.hpp"
#include "daemon/core/cell/cell_model.hpp"
#include "daemon/core/plausibility/overload_counter.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/changed_pack.hpp"

namespace bmu {
namespace {

CoreConfig shipped(const std::string& name) {
  const auto pack = load_pack_config(packs_directory / (name + ".json"));
  INFO((pack ? "" : all_text(pack.error())));
  REQUIRE(pack);
  return pack->core;
}

/// Open-circuit voltage of the pack's cell at a SOC that its table contains.
std::int32_t ocv_mV(const CoreConfig& pack, std::int32_t soc_permille) {
  for (const OcvPoint& point : pack.cell.ocv) {
    if (point.soc_permille == soc_permille) return point.ocv_uV / 1'000;
  }
  FAIL("the table has no point at " << soc_permille << " permille");
  return 0;
}

/// Constant current, positive out of the pack, and its duration.
struct Stretch {
  std::int32_t current_mA;
  Duration span;
};

/// Used share of the pack's peak budget after these stretches, for the direction with the larger one; 1000 opens.
std::int64_t overload_permille(const CoreConfig& pack, const std::vector<Stretch>& stretches) {
  OverloadCounter counter;
  counter.init(pack.current);
  TimePoint at{1s};
  std::int64_t most = 0;
  for (const Stretch& stretch : stretches) {
    for (const TimePoint end = at + stretch.span; at <= end; at += 100ms) {
      counter.observe({stretch.current_mA, at, Validity::valid});
      most = std::max({most, counter.discharge_used_permille(), counter.charge_used_permille()});
    }
  }
  return most;
}

/// Maximum error of the current sensors of the designs.
constexpr std::int32_t sensor_error_mA = 100;

}  // namespace

TEST_CASE("packs of used parts verify the current sensor, and none stores anything in one", "[unit][config][sensors]") {
  std::vector<std::string> verifying;
  for (const auto& file : std::filesystem::directory_iterator(packs_directory)) {
    const std::string name = file.path().stem().string();
    INFO(name);
    const SensorConfig sensor = shipped(name).sensor;
    CHECK_FALSE(sensor.is_configured);
    CHECK_FALSE(sensor.is_stored);
    if (sensor.set_up != nullptr) verifying.push_back(name);
  }
  std::sort(verifying.begin(), verifying.end());
  CHECK(verifying == std::vector<std::string>{"i3-96s", "lfp-96s", "outlander-80s"});
}

TEST_CASE("the racing pack has the numbers of its design", "[unit][config][FS_8][FS_3][POW_1]") {
  const CoreConfig pack = shipped("fs-20s3p-84v");
  REQUIRE(pack.modules.size() == 4);
  for (const ModuleConfig& module : pack.modules) CHECK(module.cell_count == 5);
  CHECK(pack.cell.capacity_uAs == 81 * uAs_per_Ah);
  CHECK(pack.limits.cell_undervoltage.open == 2'800'000);
  CHECK(pack.limits.cell_overvoltage.open == 4'200'000);
  CHECK(pack.limits.cell_overtemperature.open == 550);
  CHECK(pack.current.discharge_continuous_mA == 155'000);
  CHECK(pack.current.discharge_peak_mA == 350'000);
  CHECK(pack.current.discharge_peak_for == 10s);
  CHECK(pack.current.charge_continuous_mA == 81'000);
  CHECK(pack.insulation.open_Ohm_per_V == 500);
  CHECK(pack.pack_limits.power_max_W == 80'000);
  CHECK(pack.pack_limits.voltage_max_V == 600);
}

TEST_CASE("the efficiency car's pack has the numbers of its design", "[unit][config][RR_1]") {
  const CoreConfig pack = shipped("shell-eco-6s");
  CHECK(cell_count(pack) == 6);
  CHECK(pack.cell.capacity_uAs == 10 * uAs_per_Ah);
  CHECK(ocv_mV(pack, 250) == 3'700);
  CHECK(ocv_mV(pack, 1'000) == 4'200);
  CHECK(pack.limits.cell_undervoltage.open == 3'700'000);
  CHECK(pack.limits.cell_overvoltage.warn > 4'200'000);  // a full cell does not warn
  CHECK(pack.limits.cell_overvoltage.open == 4'225'000);
  CHECK(pack.limits.discharge_overcurrent.open == 50'000);
  CHECK(pack.limits.cell_undertemperature.open == -200);
  CHECK(pack.limits.cell_overtemperature.open == 600);
}

TEST_CASE("the efficiency car's pack requires its modules to report their front ends' faults", "[unit][config][RR_7]") {
  const CoreConfig pack = shipped("shell-eco-6s");
  REQUIRE(pack.modules.size() == 1);
  CHECK(pack.modules[0].must_report_front_end);
}

TEST_CASE("the efficiency car's pack carries all that is less than its limit of 50 A, for ever",
          "[unit][config][RR_1]") {
  const CoreConfig pack = shipped("shell-eco-6s");
  for (const std::int32_t current_mA : {48'200, 49'000, 49'499, 49'999}) {
    CAPTURE(current_mA);
    CHECK(overload_permille(pack, {{current_mA, 1h}}) == 0);
  }
  CHECK(overload_permille(pack, {{-10'000 - sensor_error_mA, 1h}}) == 0);
  // The current permitted to the vehicle plus the sensor error stays below the warning, which is below the limit.
  CHECK(pack.current.discharge_continuous_mA == 49'000);
  CHECK(pack.current.discharge_peak_mA == 49'000);
  CHECK(pack.current.discharge_continuous_mA + sensor_error_mA < pack.limits.discharge_overcurrent.warn);
}

TEST_CASE("the competition pack has the numbers of its design", "[unit][config][BMS_NF.7]") {
  const CoreConfig pack = shipped("lipo-6s-24v");
  CHECK(cell_count(pack) == 6);
  CHECK(pack.cell.capacity_uAs == 33 * uAs_per_Ah / 10);
  CHECK(pack.current.discharge_continuous_mA == 25'000);
  CHECK(pack.current.discharge_peak_mA == 50'000);
  CHECK(pack.current.discharge_peak_for >= 10s);
  CHECK(pack.current.charge_continuous_mA == 15'000);
  CHECK(pack.current.charge_peak_mA == 15'000);  // requested from a charger, without a temporarily higher peak
  CHECK(pack.limits.charge_overcurrent.open == 19'000);
  CHECK(pack.contactors.break_current_max_mA == 75'000);  // rated breaking current of its switch
  CHECK(pack.limits.discharge_overcurrent.open < 75'000);
}

TEST_CASE(
    "the competition pack takes 15 A from its charger, and carries 25 A and then 50 A for 10 s, as its sensor shows "
    "them",
    "[unit][config][BMS_NF.7][PB_F.2][PB_F.3]") {
  const CoreConfig pack = shipped("lipo-6s-24v");
  for (const std::int32_t error_mA : {-sensor_error_mA, 0, sensor_error_mA}) {
    CAPTURE(error_mA);
    CHECK(overload_permille(pack, {{-15'000 + error_mA, 1h}}) == 0);
    // 8 min at 25 A empty the pack.
    CHECK(overload_permille(pack, {{25'000 + error_mA, 470s}}) < 200);
    CHECK(overload_permille(pack, {{25'000 + error_mA, 60s}, {50'000 + error_mA, 10s}}) < 1'000);
    CHECK(overload_permille(pack, {{50'000 + error_mA, 12s}}) >= 1'000);
  }
}

TEST_CASE("packs of six LiPo cells have 22 to 26 V from a quarter of the charge to full", "[unit][config][PB_NF.1]") {
  for (const std::string name : {"lipo-6s-24v", "shell-eco-6s"}) {
    const CoreConfig pack = shipped(name);
    const auto quarter = std::find_if(pack.cell.ocv.begin(), pack.cell.ocv.end(),
                                      [](const OcvPoint& point) { return point.soc_permille >= 250; });
    REQUIRE(quarter != pack.cell.ocv.end());
    CAPTURE(name);
    CHECK(6 * quarter->ocv_uV >= 22'000'000);
    CHECK(6 * pack.cell.ocv.back().ocv_uV <= 26'000'000);
  }
}

}  // namespace bmu
