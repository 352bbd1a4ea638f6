// What is remembered of faults begins empty: a number that nobody told is 0 or not there, and never a guess.
#include "daemon/core/fault_history.hpp"

#include "tests/support/catch.hpp"

using namespace bmu;

TEST_CASE("a fault that never was has no count, no times and no lock", "[unit][faults]") {
  const FaultRecord record;
  CHECK(record.count == 0);
  CHECK(record.first_unix_time_ms == 0);
  CHECK(record.last_unix_time_ms == 0);
  CHECK_FALSE(record.is_locked);
  CHECK_FALSE(record.cleared.has_value());
  CHECK_FALSE(record.frame.has_value());
}

TEST_CASE("a pack of which nothing was known is open, at no time, and allowed nothing", "[unit][faults]") {
  const FreezeFrame frame;
  CHECK(frame.unix_time_ms == 0);
  CHECK(frame.value == 0);
  CHECK(frame.threshold == 0);
  CHECK(frame.phase == Phase::open);
  CHECK(frame.discharge_limit_mA == 0);
  CHECK(frame.charge_limit_mA == 0);
  for (const std::optional<std::int32_t>& value :
       {frame.cell_voltage_min_uV, frame.cell_voltage_max_uV, frame.cell_voltage_average_uV,
        frame.cell_temperature_min_dC, frame.cell_temperature_max_dC, frame.cell_temperature_average_dC,
        frame.board_temperature_max_dC, frame.pack_voltage_mV, frame.link_voltage_mV, frame.current_mA,
        frame.soc_permille, frame.insulation_Ohm}) {
    CHECK_FALSE(value.has_value());
  }
}

TEST_CASE("who cleared a fault without saying more is nobody with authority", "[unit][faults]") {
  const ClearRecord clear;
  CHECK(clear.unix_time_ms == 0);
  CHECK(clear.user_id == 0);
  CHECK(clear.authority == Authority::user);
}
