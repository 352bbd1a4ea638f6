// Closing with voltage measurements that stop, with the packs as shipped: a voltage measured before main positive had
// its time to close proves nothing about it, and closes no pack.
#include <array>
#include <string>
#include <string_view>

#include "config/pack_config.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/wired_pack.hpp"

using namespace bmu;
using test::WiredPack;

namespace {

constexpr std::array packs{"demo-48s",       "charger-48s",     "lipo-6s-24v", "shell-eco-6s", "outlander-80s",
                           "traction-16x12", "storage-16s-48v", "i3-96s",      "lfp-96s",      "fs-20s3p-84v"};
/// Time before main positive is commanded. After the last sample that permits it the closing goes on for some time.
constexpr std::array silent_before{0ms, 1ms, 20ms, 50ms};

bool is_at_main_positive(const WiredPack& pack) {
  return pack.phase() == Phase::main_positive;
}

/// A pack that has just received its close request.
WiredPack ready_pack(const std::string& name) {
  const auto config = load_pack_config(test::in_source("config/packs/" + name + ".json"));
  REQUIRE(config);
  WiredPack pack(config->core);
  pack.apply("pack soc_permille 600");
  pack.run(1'500ms);
  pack.apply("vehicle on");
  return pack;
}

}  // namespace

TEST_CASE("no voltages from before main positive close a pack", "[scenario][contactors][I4][F86]") {
  for (const char* const name : packs) {
    const WiredPack ready = ready_pack(name);
    WiredPack undisturbed = ready;
    REQUIRE(undisturbed.run_until(is_at_main_positive, 10s));
    const Duration closing = undisturbed.now() - ready.now();
    REQUIRE(undisturbed.run_until([](const WiredPack& it) { return it.phase() == Phase::closed; }, 1s));
    for (const std::string_view voltage : {"pack_voltage", "link_voltage"}) {
      for (const Duration before : silent_before) {
        CAPTURE(name, voltage, to_ms(before));
        WiredPack pack = ready;
        pack.run(closing - before);
        pack.apply("sensor " + std::string(voltage) + " silent");
        const bool goes_on = pack.run_until(is_at_main_positive, before + 1ms);
        CHECK((goes_on || before > 0ms));
        CHECK(pack.run_until([](const WiredPack& it) { return it.phase() == Phase::open; }, 4s));
        CHECK(pack.phases_entered(Phase::closed) == 0);
      }
    }
  }
}
