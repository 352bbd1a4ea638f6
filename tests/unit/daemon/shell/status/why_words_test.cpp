// Texts of "why": the last values of a silent sender, past events, and the source of a number.
#include <string>

#include "daemon/core/records/event.hpp"
#include "daemon/shell/status/why_json.hpp"
#include "devices/device_list.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;
using bmu::test::CoreBench;
using bmu::test::small_pack;

namespace {

std::string why_of(const CoreBench& bench) {
  return why_json({.core = bench.core(), .now = bench.now()}).dump(2);
}

bool has(const std::string& text, std::string_view words) {
  return text.find(words) != std::string::npos;
}

}  // namespace

TEST_CASE("why names the command to an IVT-S that somebody else has sent", "[unit][why][F39]") {
  CoreConfig config = small_pack();
  config.sensor.set_up = find_device("ivt_s")->set_up;
  CoreBench bench(config);
  bench.run(1s);
  CHECK_FALSE(has(why_of(bench), "411"));
  bench.observe(FrameReceived{Port::internal, {.id = 0x411, .length = 8, .data = {0x34}}});
  bench.run(100ms);
  REQUIRE(bench.is_active(FaultId::foreign_master));
  const std::string why = why_of(bench);
  INFO(why);
  CHECK(has(why, "411 IVT_COMMAND"));
}

TEST_CASE("of who falls silent why says when the last word came, and how long one may be waited for", "[unit][why]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.run(1s);
  SECTION("the unit") {
    bench.pdu_talks = false;
    REQUIRE(bench.run_until([&] { return bench.is_active(FaultId::pdu_lost); }, 2s));
    bench.run(1s);
    const std::string why = why_of(bench);
    INFO(why);
    CHECK(has(why, "; last received 2"));
    CHECK(has(why, " before opening, limit 200 ms"));
    CHECK_FALSE(has(why, "; sample "));
  }
  SECTION("the sensor") {
    bench.sensor_talks = false;
    REQUIRE(bench.run_until([&] { return bench.is_active(FaultId::current_sensor_lost); }, 2s));
    bench.run(1s);
    const std::string why = why_of(bench);
    INFO(why);
    CHECK(has(why, "last received "));
    CHECK(has(why, " before opening, limit 200 ms"));
  }
  SECTION("a module that answers, and not completely") {
    bench.modules[1].sends_status = false;
    REQUIRE(bench.run_until([&] { return bench.is_active(FaultId::module_lost); }, 2s));
    bench.run(1s);
    const std::string why = why_of(bench);
    INFO(why);
    CHECK(has(why, "partly received "));
    CHECK_FALSE(has(why, "last received "));
  }
  SECTION("a module, of whose limits the least counts") {
    bench.modules[1].talks = false;
    REQUIRE(bench.run_until([&] { return bench.is_active(FaultId::module_lost); }, 2s));
    bench.run(1s);
    const std::string why = why_of(bench);
    INFO(why);
    CHECK(has(why, "last received "));
    CHECK(has(why, " before opening"));
  }
}

TEST_CASE("what has no sample and is believed at once is said without such numbers", "[unit][why]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.observe(PortChanged{Port::internal, false});
  bench.run(1s);
  const std::string why = why_of(bench);
  INFO(why);
  REQUIRE(bench.core().last_opening().fault == FaultId::internal_bus_down);
  CHECK(has(why, "confirmed immediately"));
  CHECK_FALSE(has(why, "; sample "));
  CHECK_FALSE(has(why, "after 0 ms"));
}

TEST_CASE("a value whose cause is gone is one that was last seen, beside that of now", "[unit][why]") {
  CoreBench bench(small_pack());
  REQUIRE(bench.close());
  bench.modules[1].cell_voltage_uV[2] = known(2'800'000);
  REQUIRE(bench.run_until([&] { return !bench.commanded().any_contactor(); }, 1s));
  CHECK_FALSE(has(why_of(bench), "(last cell"));
  bench.modules[1].cell_voltage_uV[2] = known(3'700'000);
  bench.run(10s);
  const std::string why = why_of(bench);
  INFO(why);
  CHECK(has(why, "(last cell 2.3 (no. 7): 2.8000 V, now 3.7000 V"));
}

TEST_CASE("a peak that may have been left out says where its number comes from", "[unit][why]") {
  CoreConfig config = small_pack();
  config.current.discharge_peak_mA = static_cast<std::int32_t>(config.limits.discharge_overcurrent.warn);
  for (const bool is_left_out : {true, false}) {
    if (!is_left_out) --config.current.discharge_peak_mA;
    CoreBench bench(config);
    REQUIRE(bench.close());
    bench.run(5s);
    const std::string why = why_of(bench);
    INFO(why);
    REQUIRE(has(why, "current/discharge_peak_mA: "));
    CHECK(has(why, "(default: limits/discharge_overcurrent/warn_mA)") == is_left_out);
  }
}

TEST_CASE("an event is as severe as what it means", "[unit][events]") {
  CHECK(severity_of({.id = EventId::fault_confirmed, .fault = FaultId::cell_undervoltage}) == Severity::error);
  CHECK(severity_of({.id = EventId::fault_confirmed, .fault = FaultId::charger_contradicts}) == Severity::warning);
  CHECK(severity_of({.id = EventId::fault_confirmed, .fault = FaultId::charger_contradicts, .is_stricter = true}) ==
        Severity::error);
  CHECK(severity_of({.id = EventId::fault_cleared, .fault = FaultId::charger_contradicts}) == Severity::info);
  CHECK(severity_of({.id = EventId::opened, .cause = OpeningCause::request_over}) == Severity::info);
  CHECK(severity_of({.id = EventId::opened, .cause = OpeningCause::shut_down}) == Severity::info);
  for (const OpeningCause cause :
       {OpeningCause::fault, OpeningCause::precharge_retry, OpeningCause::permission, OpeningCause::none}) {
    CHECK(severity_of({.id = EventId::opened, .cause = cause}) == Severity::warning);
  }
  CHECK(severity_of({.id = EventId::close_request_over, .cause = OpeningCause::none}) == Severity::info);
}

TEST_CASE("a charger that runs away is told of with what it gives and what it was asked for",
          "[unit][events][charger]") {
  Event event{.id = EventId::fault_confirmed,
              .fault = FaultId::charger_runaway,
              .reading = {.is_known = true, .value = 1},
              .threshold = 10'000,
              .number = 25'000};
  CHECK(has(to_text(event), ": 25.000 A supplied, 10.000 A requested"));
  event.reading.value = 2;
  event.number = 410'000;
  event.threshold = 400'000;
  CHECK(has(to_text(event), ": 410.000 V supplied, 400.000 V requested"));
}
