// Estimates of a pack with cells that differ from their file, measured by a sensor with errors: their deviation, and
// whether their uncertainty covers it. The plant is the emulated pack, which has its own equations.
#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "config/pack_config.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/wired_pack.hpp"

using namespace bmu;
using test::WiredPack;

namespace {

CoreConfig pack_file(const char* name) {
  auto pack = load_pack_config(test::in_source("config/packs/") + name);
  REQUIRE(pack.has_value());
  return pack->core;
}

/// Applies an event to every cell of the first module: the script's words after "cell 1.N".
void each_cell(WiredPack& pack, const std::string& words) {
  for (std::uint8_t cell = 1; cell <= pack.config().modules[0].cell_count; ++cell) {
    pack.apply("cell 1." + std::to_string(cell) + " " + words);
  }
}

struct Followed {
  double worst = 0.0;   // of any cell, from the second quarter on
  double inside = 0.0;  // share of samples with the truth within two standard deviations
};

/// Drives with pauses for `duration`, at about `load_A`.
Followed drive(WiredPack& pack, double load_A, Duration duration) {
  Followed followed;
  double looks = 0.0;
  const TimePoint begin = pack.now();
  for (int turn = 0; pack.now() < begin + duration; ++turn) {
    constexpr std::array shares{1.0, 0.25, 1.6, 0.0, 0.6};
    pack.apply("load current_A " + std::to_string(load_A * shares[static_cast<std::size_t>(turn) % shares.size()]));
    pack.run(12s);
    REQUIRE(pack.phase() == Phase::closed);
    for (std::size_t cell = 0; cell < cell_count(pack.config()); ++cell) {
      const SocEstimate estimate = pack.core().estimate().cell_soc(cell);
      REQUIRE(estimate.is_known);
      const double off = std::abs(estimate.soc - pack.simulator().plant().cell(cell).soc);
      looks += 1.0;
      followed.inside += off <= 2.0 * estimate.sigma ? 1.0 : 0.0;
      if (pack.now() - begin > duration / 4) followed.worst = std::max(followed.worst, off);
    }
  }
  followed.inside /= looks;
  return followed;
}

double resistance_mOhm(const WiredPack& pack) {
  return pack.config().cell.series_resistance_Ohm * 1e3;
}

}  // namespace

TEST_CASE("worn cells and a sensor that drifts: bounded error, and the truth where the estimate says",
          "[scenario][estimators][slow][BMS_F.6]") {
  WiredPack pack(pack_file("lipo-6s-24v.json"));
  pack.apply("pack soc_permille 900");
  std::string wear;
  SECTION("as in the file") {}
  SECTION("15 % less capacity") {
    each_cell(pack, "capacity_permille 850");
  }
  SECTION("40 % more resistance") {
    each_cell(pack, "resistance_mOhm " + std::to_string(1.4 * resistance_mOhm(pack)));
  }
  SECTION("a sensor that tells 2 % and 30 mA too much") {
    pack.apply("sensor current gain_permille 1020; sensor current offset_mA 30");
  }
  SECTION("all of it") {
    each_cell(pack, "capacity_permille 850");
    each_cell(pack, "resistance_mOhm " + std::to_string(1.4 * resistance_mOhm(pack)));
    pack.apply("sensor current gain_permille 1020; sensor current offset_mA 30");
  }
  REQUIRE(pack.close());
  const Followed followed = drive(pack, 5.0, 1500s);
  CAPTURE(followed.worst, followed.inside);
  CHECK(followed.worst < 0.05);
  CHECK(followed.inside > 0.9);
  CHECK_FALSE(pack.core().faults().state(FaultId::cell_model_mismatch).is_present());
}

TEST_CASE("on the flat curve of LFP a wrong begin is known as one", "[scenario][estimators][slow][BMS_F.6]") {
  CoreConfig config = pack_file("lfp-96s.json");
  const ModuleConfig first = config.modules[0];
  config.modules = {};
  config.modules.push_back(first);
  config.balancing.is_enabled = false;
  WiredPack pack(config);
  pack.apply("pack soc_permille 700; sensor current gain_permille 1020; sensor current offset_mA 200");
  each_cell(pack, "capacity_permille 850");
  REQUIRE(pack.close());
  const Followed followed = drive(pack, 60.0, 1200s);
  CAPTURE(followed.worst, followed.inside);
  CHECK(followed.worst < 0.3);
  CHECK(followed.inside > 0.9);
}
