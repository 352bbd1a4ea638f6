// Reports of chargers, how long they are valid, and when a charger counts as silent.
#include "daemon/core/measurement/charger_table.hpp"

#include <optional>

#include "devices/device_list.hpp"
#include "mmu/devices/can_charger.hpp"
#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

constexpr TimePoint start{100s};
const ChargerReport good{.voltage_mV = known(300'000), .current_mA = known(8'000), .temperature_dC = known(350)};

/// Brusa charger; its frames with one identifier can be omitted.
struct Brusa {
  static constexpr std::uint32_t values_id = 0x611;
  static constexpr std::uint32_t temperature_id = 0x613;
  static constexpr std::uint32_t errors_id = 0x614;

  ChargerTable table;
  TimePoint now = start;
  std::optional<std::uint32_t> missing;

  Brusa() { table.init({.driver = find_device("brusa_nlg5")->charger}); }
  void hear(const ChargerReport& report) {
    for (const CanFrame& frame : table.driver().reports(0, report)) {
      if (frame.id != missing) REQUIRE(table.observe(frame, now));
    }
  }
  void hear_for(Duration span, const ChargerReport& report = good) {
    for (const TimePoint end = now + span; now < end; now += 100ms) hear(report);
  }
  [[nodiscard]] bool talks() const { return table.is_talking(0, now); }
};

}  // namespace

TEST_CASE("a Brusa talks only while it reports its errors, too, and in their own time", "[unit][charger]") {
  Brusa brusa;
  brusa.missing = Brusa::errors_id;
  brusa.hear_for(5s);
  CHECK_FALSE(brusa.talks());  // its errors are unknown
  brusa.missing.reset();
  brusa.hear(good);
  CHECK(brusa.talks());
  CHECK(brusa.table.unit(0).talks_since == brusa.now);
  brusa.missing = Brusa::errors_id;
  brusa.hear_for(2600ms);
  CHECK(brusa.talks());
  brusa.hear_for(200ms);
  CHECK_FALSE(brusa.talks());
  CHECK(brusa.table.talking_count(brusa.now) == 0);
  // It is not used for charging; its current is reported nevertheless.
  CHECK(brusa.table.current_mA(brusa.now).value == 8'000);
  CHECK(brusa.table.current_mA(brusa.now).taken_at == brusa.now - 100ms);
  CHECK(brusa.table.voltage_mV(brusa.now).value == 300'000);
}

TEST_CASE("a Brusa's state says at once that there is an error, its errors then which", "[unit][charger]") {
  Brusa brusa;
  brusa.hear_for(1s);
  REQUIRE(brusa.table.troubles(brusa.now, true).bits == 0);
  ChargerReport broken = good;
  broken.troubles = bit_of(ChargerTrouble::hardware);
  brusa.missing = Brusa::errors_id;
  brusa.hear(broken);
  CHECK(brusa.table.troubles(brusa.now, true).bits == bit_of(ChargerTrouble::unnamed));
  brusa.missing.reset();
  brusa.hear(broken);
  CHECK(brusa.table.troubles(brusa.now, true).bits == bit_of(ChargerTrouble::hardware));
  brusa.hear(broken);
  CHECK(brusa.table.troubles(brusa.now, true).bits == bit_of(ChargerTrouble::hardware));
  brusa.hear(good);
  CHECK(brusa.table.troubles(brusa.now, true).bits == 0);
}

TEST_CASE("reports whose values are no numbers are silence once they last", "[unit][charger]") {
  Brusa brusa;
  brusa.hear_for(1s);
  REQUIRE(brusa.talks());
  // No source documents a charger of more than 1500 V: a report of 6553.5 V is invalid.
  const CanFrame wild{.id = Brusa::values_id, .length = 8, .data = {0, 0, 0, 0, 0xFF, 0xFF, 0x03, 0x20}};
  REQUIRE(brusa.table.observe(wild, brusa.now));
  CHECK(brusa.talks());
  CHECK(brusa.table.unit(0).values_out_of_range == 1);
  brusa.missing = Brusa::values_id;
  for (int report = 0; report < 5; ++report) {
    brusa.hear_for(100ms);
    REQUIRE(brusa.table.observe(wild, brusa.now));
  }
  CHECK_FALSE(brusa.talks());
  brusa.missing.reset();
  brusa.hear(good);
  CHECK(brusa.talks());
}

TEST_CASE("a temperature that is not told again is not known before long", "[unit][charger]") {
  Brusa brusa;
  CHECK_FALSE(brusa.table.temperature_dC(0, brusa.now).is_valid());
  brusa.hear_for(1s);
  CHECK(brusa.table.temperature_dC(0, brusa.now) == known(350));
  brusa.missing = Brusa::temperature_id;
  brusa.hear_for(2500ms);
  CHECK(brusa.table.temperature_dC(0, brusa.now) == known(350));
  brusa.hear_for(300ms);
  CHECK_FALSE(brusa.table.temperature_dC(0, brusa.now).is_valid());
  CHECK(brusa.talks());
}

TEST_CASE("an emulated Brusa sends its temperatures and errors once a second, the rest ten times",
          "[unit][mmu][charger]") {
  CanChargers chargers(find_device("brusa_nlg5")->charger, 1, start);
  int values = 0;
  int errors = 0;
  int temperatures = 0;
  for (TimePoint now = start; now < start + 10s; now += 10ms) {
    for (const CanFrame& frame : chargers.report(now, 300.0, 0.0)) {
      values += frame.id == Brusa::values_id ? 1 : 0;
      errors += frame.id == Brusa::errors_id ? 1 : 0;
      temperatures += frame.id == Brusa::temperature_id ? 1 : 0;
    }
  }
  CHECK(values == 100);
  CHECK(errors == 10);
  CHECK(temperatures == 10);
}
