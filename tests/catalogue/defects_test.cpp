// What the catalogue asks for, what the daemon is built for, and what it does not do: none of these is run by itself.
#include "protocol/tables/internal_bus.hpp"
#include "tests/catalogue/catalogue.hpp"
#include "tests/catalogue/frames.hpp"
#include "tests/support/catch.hpp"

namespace bmu::test {
namespace {

/// Three of every ten frames of the last module, evenly.
Act damaging_three_in_ten() {
  return [](WiredPack& pack) {
    pack.on_sent = [count = 0](CanFrame& frame, const WiredPack& now) mutable {
      if (is_of_last_module(frame, now) && ++count * 3 % 10 < 3) frame.data[2] ^= 0x10U;
      return Fate{};
    };
  };
}

}  // namespace

DEFECT_FAULT(28, "three of ten frames of a module are damaged", 400ms,
             {{.what = "three of ten frames of a module damaged",
               .inject = damaging_three_in_ten(),
               .repair = heal,
               .fault = "module_lost",
               .configured = seen::in_module_silence}})

DEFECT_FAULT(83, "a contactor does not close, and the closing stops in 300 ms", 300ms,
             {{.what = "main positive does not close: within 300 ms",
               .inject = {},
               .repair = script("contactor main_positive ok"),
               .fault = "contactor_feedback",
               .configured = seen::in_a_contact_that_stays,
               .in_phase = Phase::main_positive,
               .prepare = script("contactor main_positive stuck_open"),
               .is_seen_open = false}})

DEFECT_FAULT(86, "the precharge never gets there", 2s,
             {{.what = "the precharge resistor is burnt out, time-out as by default",
               .inject = {},
               .repair = script("precharge resistance_Ohm 100"),
               .fault = "precharge_failed",
               .configured = seen::in_the_precharge_time_out,
               .in_phase = Phase::precharge,
               .prepare = script("precharge resistance_Ohm 1000000000"),
               .is_seen_open = false}})

TEST_CASE("F92: a key that is played with wears no contacts: nothing closes for 10 s", "[catalogue][F92][.defect]") {
  WiredPack pack = closed_pack(packs().front());
  const std::uint64_t closed_before = pack.phases_entered(Phase::main_negative);
  for (int turn = 0; turn < 300; ++turn) {
    pack.apply(turn % 2 == 0 ? "vehicle off" : "vehicle on");
    pack.run(100ms);
  }
  CHECK(pack.phases_entered(Phase::main_negative) - closed_before <= 3);  // in 30 s
}

}  // namespace bmu::test
