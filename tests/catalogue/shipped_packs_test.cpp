// Rows 86 to 88 on every shipped pack, with its file as it is: gaps in its numbers do not show on the two packs that
// the catalogue measures.
#include <algorithm>
#include <filesystem>

#include "config/pack_config.hpp"
#include "tests/catalogue/catalogue.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"

namespace bmu::test {
namespace {

struct Shipped {
  std::string name;
  CoreConfig config;
};

std::vector<Shipped> shipped_packs() {
  std::vector<Shipped> packs;
  for (const auto& entry : std::filesystem::directory_iterator(test::in_source("config/packs"))) {
    const auto pack = load_pack_config(entry.path());
    REQUIRE(pack);
    packs.push_back({entry.path().filename(), pack->core});
  }
  REQUIRE(packs.size() >= 6);
  return packs;
}

/// A pack at 70 %, warm, with its key turned; run until it is closed or its attempts are over.
WiredPack switched_on(const Shipped& shipped, std::string_view prepare) {
  WiredPack pack(shipped.config);
  pack.apply("pack soc_permille 700");
  if (!prepare.empty()) pack.apply(prepare);
  pack.run(6s);
  pack.apply("vehicle on");
  const auto is_over = [](const WiredPack& now) {
    return now.phase() == Phase::closed || is_present(now, "precharge_failed") ||
           is_present(now, "precharge_too_fast") || is_present(now, "precharge_overcurrent");
  };
  (void)pack.run_until(is_over, 60s);
  return pack;
}

/// One of the faults is present at the end; none given: any.
void check_never_closes(std::string_view prepare, std::vector<std::string_view> faults) {
  for (const Shipped& shipped : shipped_packs()) {
    const WiredPack pack = switched_on(shipped, prepare);
    INFO(shipped.name << ", precharge took " << to_ms(pack.core().last_precharge().took) << " ms");
    CHECK(pack.phase() == Phase::open);
    CHECK(pack.phases_entered(Phase::main_positive) == 0);
    CHECK(pack.core().last_precharge().has_run);
    CHECK_FALSE(pack.core().last_precharge().was_successful);
    if (faults.empty()) continue;
    CHECK(std::any_of(faults.begin(), faults.end(), [&](std::string_view fault) { return is_present(pack, fault); }));
  }
}

}  // namespace

TEST_CASE("every shipped pack closes, and its precharge takes at least twice what is too fast",
          "[catalogue][F87][shipped]") {
  for (const Shipped& shipped : shipped_packs()) {
    const WiredPack pack = switched_on(shipped, "");
    INFO(shipped.name << ", precharge took " << to_ms(pack.core().last_precharge().took) << " ms");
    CHECK(pack.phase() == Phase::closed);
    CHECK(pack.core().last_precharge().took >= 2 * shipped.config.contactors.precharge_min);
    CHECK(2 * pack.core().last_precharge().took <= shipped.config.contactors.precharge_timeout);
  }
}

TEST_CASE("F86: no shipped pack closes with a burnt-out precharge resistor", "[catalogue][F86][shipped][slow]") {
  check_never_closes("precharge resistance_Ohm 1000000000", {"precharge_failed"});
}

TEST_CASE("F87: no shipped pack closes with a shorted precharge resistor", "[catalogue][F87][shipped]") {
  check_never_closes("precharge resistance_Ohm 0.1", {"precharge_too_fast", "precharge_overcurrent"});
}

TEST_CASE("F88: no shipped pack closes onto a shorted link", "[catalogue][F88][shipped][slow]") {
  check_never_closes("link bleed_Ohm 0.1", {});
  check_never_closes("link bleed_Ohm 0.1; precharge resistance_Ohm 10", {});
}

}  // namespace bmu::test
