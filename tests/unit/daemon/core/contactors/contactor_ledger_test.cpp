// Wear counters of the contactors.
#include "daemon/core/contactors/contactor_ledger.hpp"

#include <algorithm>

#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;

namespace {

constexpr Measured<std::int32_t> measured_mA(std::int32_t value) {
  return {value, TimePoint{1s}, Validity::valid};
}
constexpr auto index_of(ContactorId id) {
  return static_cast<std::size_t>(id);
}

}  // namespace

TEST_CASE("each contactor has its own closings and openings, and what does not change is not counted",
          "[unit][contactors]") {
  ContactorLedger ledger;
  CHECK_FALSE(ledger.command({}, measured_mA(0)));
  CHECK(ledger.command({.main_negative = true}, measured_mA(0)));
  CHECK(ledger.command({.main_negative = true, .precharge = true}, measured_mA(0)));
  CHECK_FALSE(ledger.command({.main_negative = true, .precharge = true, .fan = true}, measured_mA(0)));
  CHECK(ledger.command({.main_positive = true, .main_negative = true, .charge = true}, measured_mA(0)));
  CHECK(ledger.command({}, measured_mA(0)));
  for (const ContactorWear& wear : ledger.entries()) CHECK(wear == ContactorWear{.closings = 1, .openings = 1});
}

TEST_CASE("contactors are numbered from 1 on, in their order", "[unit][contactors]") {
  for (std::uint8_t index = 0; index < contactor_id_count; ++index) {
    CHECK(contactor_number(static_cast<ContactorId>(index)) == index + 1);
  }
}

TEST_CASE("before it switches a contactor has no wear", "[unit][contactors]") {
  const ContactorWear wear;
  CHECK(wear.closings == 0);
  CHECK(wear.openings == 0);
  CHECK(wear.openings_under_load == 0);
  CHECK(wear.current_broken_max_mA == 0);
  CHECK(wear.current_broken_sum_mA == 0);
}

TEST_CASE("an opening is under load from more than a small current on, either way, and when nobody knows",
          "[unit][contactors]") {
  struct Row {
    Measured<std::int32_t> current_mA;
    std::uint32_t under_load;
    std::int32_t broken_mA;
  };
  for (const Row& row : {Row{measured_mA(1'000), 0, 0}, Row{measured_mA(1'001), 1, 1'001},
                         Row{measured_mA(-1'000), 0, 0}, Row{measured_mA(-1'001), 1, 1'001}, Row{{}, 1, 0},
                         Row{{50'000, TimePoint{1s}, Validity::out_of_range}, 1, 0}}) {
    ContactorLedger ledger;
    (void)ledger.command({.main_positive = true}, measured_mA(0));
    (void)ledger.command({}, row.current_mA);
    const ContactorWear& wear = ledger.entries()[index_of(ContactorId::main_positive)];
    CHECK(wear.openings_under_load == row.under_load);
    CHECK(wear.current_broken_max_mA == row.broken_mA);
    CHECK(wear.current_broken_sum_mA == row.broken_mA);
  }
}

TEST_CASE("the largest current broken stays, their sum grows, and a former life is added to", "[unit][contactors]") {
  ContactorLedger ledger;
  ContactorLedgerEntries before{};
  before[index_of(ContactorId::charge)] = {.closings = 7,
                                           .openings = 7,
                                           .openings_under_load = 1,
                                           .current_broken_max_mA = 30'000,
                                           .current_broken_sum_mA = 30'000};
  ledger.restore(before);
  for (const std::int32_t current_mA : {20'000, -50'000, 10'000}) {
    CHECK(ledger.command({.charge = true}, measured_mA(current_mA)));
    CHECK(ledger.command({}, measured_mA(current_mA)));
  }
  CHECK(ledger.entries()[index_of(ContactorId::charge)] == ContactorWear{.closings = 10,
                                                                         .openings = 10,
                                                                         .openings_under_load = 4,
                                                                         .current_broken_max_mA = 50'000,
                                                                         .current_broken_sum_mA = 110'000});
  CHECK(ledger.entries()[index_of(ContactorId::main_positive)] == ContactorWear{});
}

TEST_CASE("a closing and an opening under load are in what outlives the process", "[unit][core][contactors]") {
  test::CoreBench bench(test::small_pack());
  const std::uint32_t generation = bench.core().persistent_generation();
  REQUIRE(bench.close());
  CHECK(bench.core().persistent_generation() > generation);
  bench.current_mA = 20'000;
  bench.run(100ms);
  bench.inputs.estop_1_released = false;
  bench.run(100ms);
  const ContactorLedgerEntries& wear = bench.core().persistent().contactors;
  for (const ContactorId id : {ContactorId::main_positive, ContactorId::main_negative}) {
    CHECK(wear[index_of(id)].closings == 1);
    CHECK(wear[index_of(id)].openings_under_load == 1);
    CHECK(wear[index_of(id)].current_broken_max_mA == 20'000);
  }
  CHECK(wear[index_of(ContactorId::precharge)].openings == 1);
  CHECK(wear[index_of(ContactorId::precharge)].openings_under_load == 0);
  CHECK(wear[index_of(ContactorId::charge)] == ContactorWear{});
}

TEST_CASE("what is broken flows when the first main contactor is commanded open, not when the other follows",
          "[unit][contactors]") {
  ContactorLedger ledger;
  CHECK_FALSE(ledger.broken_mA().is_valid());
  const ContactorOutputs closed{.main_positive = true, .main_negative = true};
  (void)ledger.command({.main_negative = true, .precharge = true}, measured_mA(0));
  (void)ledger.command(closed, measured_mA(500));  // the precharge contactor opens: it breaks no pack current
  CHECK_FALSE(ledger.broken_mA().is_valid());
  (void)ledger.command({.main_negative = true}, measured_mA(25'000));
  (void)ledger.command({}, measured_mA(3));
  CHECK(ledger.broken_mA().value == 25'000);
  (void)ledger.command(closed, measured_mA(0));
  CHECK(ledger.broken_mA().value == 25'000);  // of the last opening
  (void)ledger.command({.main_positive = true}, measured_mA(-7'000));
  (void)ledger.command({}, measured_mA(0));
  CHECK(ledger.broken_mA().value == -7'000);
}

TEST_CASE("the last opening and the wear agree on the current that was broken", "[unit][contactors][why]") {
  test::CoreBench bench(test::small_pack());
  REQUIRE(bench.close());
  bench.current_mA = 25'000;
  bench.run(1s);
  bench.inputs.vehicle_on = false;
  // The load current ends with the first contactor.
  bench.each_ms = [&bench] {
    if (!bench.contacts().main_positive || !bench.contacts().main_negative) bench.current_mA = 3;
  };
  REQUIRE(bench.run_until([&] { return !bench.commanded().any_contactor(); }, 10s));
  const OpeningRecord& opening = bench.core().last_opening();
  CHECK(opening.cause == OpeningCause::request_over);
  CHECK(opening.from == Phase::breaking);
  CHECK(opening.current_mA.is_valid());
  CHECK(opening.current_mA.value == 25'000);
  std::int32_t broken_mA = 0;
  for (const ContactorWear& wear : bench.core().persistent().contactors) {
    broken_mA = std::max(broken_mA, wear.current_broken_max_mA);
  }
  CHECK(broken_mA == 25'000);
}
