// Estimates of a closed pack with sensors that are wrong, frozen or silent: no value jumps, the uncertainty of
// unmeasured values grows, and the fault is named.
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "config/pack_config.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/wired_pack.hpp"

using namespace bmu;
using test::WiredPack;

namespace {

CoreConfig pack_file() {
  auto pack = load_pack_config(test::in_source("config/packs/lipo-6s-24v.json"));
  REQUIRE(pack.has_value());
  return pack->core;
}

/// Observations of a drive: the faults, and the changes of the published SOC.
struct Watched {
  std::vector<std::string> faults;
  double steepest_per_s = 0.0;  // of the published state of charge
  bool was_known = true;
  double sigma_most = 0.0;
  bool was_number = true;

  [[nodiscard]] bool has(const char* fault) const {
    return std::find(faults.begin(), faults.end(), fault) != faults.end();
  }
};

void look(Watched& watched, const WiredPack& pack) {
  for (const FaultRow& row : fault_table()) {
    const std::string name(row.name);
    if (pack.core().faults().state(row.id).is_present() && !watched.has(name.c_str())) watched.faults.push_back(name);
  }
  const PackEstimate& estimate = pack.core().estimate();
  watched.was_known = watched.was_known && estimate.pack().is_known;
  watched.sigma_most = std::max(watched.sigma_most, estimate.pack().sigma);
  for (std::size_t cell = 0; cell < estimate.size(); ++cell) {
    const SocEstimate soc = estimate.cell_soc(cell);
    watched.was_number = watched.was_number && soc.soc >= 0.0 && soc.soc <= 1.0 && soc.sigma > 0.0 && soc.sigma <= 1.0;
  }
}

/// Applies loads of three seconds each, whether the pack has opened or not.
Watched drive(WiredPack& pack, Duration duration) {
  Watched watched;
  constexpr std::array loads_A{8.0, 1.0, 5.0, 0.0};
  double before = pack.core().estimate().told_soc();
  const TimePoint begin = pack.now();
  for (int turn = 0; pack.now() < begin + duration; ++turn) {
    pack.apply("load current_A " + std::to_string(loads_A[static_cast<std::size_t>(turn) % loads_A.size()]));
    for (int second = 0; second < 3; ++second) {
      pack.run(1s);
      look(watched, pack);
      const double told = pack.core().estimate().told_soc();
      watched.steepest_per_s = std::max(watched.steepest_per_s, std::abs(told - before));
      before = told;
    }
  }
  return watched;
}

WiredPack driven_pack() {
  WiredPack pack(pack_file());
  pack.apply("pack soc_permille 700");
  REQUIRE(pack.close());
  static_cast<void>(drive(pack, 60s));
  REQUIRE(pack.phase() == Phase::closed);
  return pack;
}

/// Valid all the time, a number with its uncertainty for each cell, and no jump of the published SOC.
bool is_sound(const Watched& watched) {
  constexpr double told_most_per_s = 0.022;  // 2 % per second in the first five minutes of a session, and the current
  UNSCOPED_INFO("known " << watched.was_known << ", numbers " << watched.was_number << ", at most "
                         << watched.steepest_per_s << " a second");
  return watched.was_known && watched.was_number && watched.steepest_per_s < told_most_per_s;
}

}  // namespace

TEST_CASE("a current sensor the wrong way round is named, and the estimates stay sound",
          "[scenario][estimators][BMS_F.6][F18]") {
  WiredPack pack = driven_pack();
  pack.apply("sensor current inverted on");
  const Watched watched = drive(pack, 60s);
  CAPTURE(watched.faults);
  CHECK(watched.has("current_contradicts_voltage"));
  CHECK(pack.phase() == Phase::open);
  CHECK(is_sound(watched));
}

TEST_CASE("a current sensor that stands still is named", "[scenario][estimators][BMS_F.6][F12]") {
  WiredPack pack = driven_pack();
  pack.apply("sensor current stuck on");
  const Watched watched = drive(pack, 60s);
  CAPTURE(watched.faults);
  CHECK((watched.has("current_contradicts_voltage") || watched.has("stuck_values")));
  CHECK(is_sound(watched));
}

TEST_CASE("a current sensor that says nothing opens, and the doubt grows by what may flow",
          "[scenario][estimators][BMS_F.6]") {
  WiredPack pack = driven_pack();
  const double before = pack.core().estimate().pack().sigma;
  pack.apply("sensor current silent");
  const Watched watched = drive(pack, 600s);
  CHECK(watched.has("current_sensor_lost"));
  CHECK(pack.phase() == Phase::open);
  CHECK(is_sound(watched));
  CHECK(watched.sigma_most > before);
}

TEST_CASE("cells without a temperature open the pack, and are estimated on", "[scenario][estimators][BMS_F.6]") {
  WiredPack pack = driven_pack();
  for (int sensor = 1; sensor <= pack.config().modules[0].temperature_sensor_count; ++sensor) {
    pack.apply("thermistor 1." + std::to_string(sensor) + " state open");
  }
  const Watched watched = drive(pack, 60s);
  CAPTURE(watched.faults);
  CHECK((watched.has("temperature_not_measured") || watched.has("module_reports_fault")));
  CHECK(pack.phase() == Phase::open);
  CHECK(is_sound(watched));
}

TEST_CASE("a module that falls silent leaves its cells to counting", "[scenario][estimators][BMS_F.6]") {
  WiredPack pack = driven_pack();
  pack.apply("module 1 silent");
  const Watched watched = drive(pack, 60s);
  CHECK(watched.has("module_lost"));
  CHECK(pack.phase() == Phase::open);
  CHECK(is_sound(watched));
}
