// Fault history at its start: an unknown number is 0 or absent, and never a guess.
#include "daemon/core/records/fault_history.hpp"

#include <set>

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
  CHECK_FALSE(frame.mode.has_value());
  CHECK_FALSE(frame.outputs.has_value());
  CHECK_FALSE(frame.inputs.has_value());
  for (const std::optional<std::int32_t>& value :
       {frame.cell_voltage_min_uV, frame.cell_voltage_max_uV, frame.cell_voltage_average_uV,
        frame.cell_temperature_min_dC, frame.cell_temperature_max_dC, frame.cell_temperature_average_dC,
        frame.board_temperature_max_dC, frame.pack_voltage_mV, frame.link_voltage_mV, frame.current_mA,
        frame.soc_permille, frame.insulation_Ohm, frame.cell_voltage_sum_mV, frame.module_voltage_sum_mV,
        frame.board_temperature_min_dC, frame.current_2_mA, frame.discharge_overload_permille,
        frame.charge_overload_permille}) {
    CHECK_FALSE(value.has_value());
  }
}

TEST_CASE("what latches stays so over a restart, what a switched off machine shows, too, only if it was in use",
          "[unit][faults]") {
  std::set<FaultId> only_in_use;
  for (const FaultRow& row : fault_table()) {
    CAPTURE(row.name);
    CHECK(locks(row, true) == (row.latch != Latch::none));
    CHECK((!locks(row, false) || row.latch != Latch::none));
    if (locks(row, true) && !locks(row, false)) only_in_use.insert(row.id);
  }
  CHECK(only_in_use == std::set<FaultId>{FaultId::module_lost, FaultId::cell_not_measured,
                                         FaultId::temperature_not_measured, FaultId::module_disturbed,
                                         FaultId::current_sensor_lost, FaultId::voltage_sensor_lost, FaultId::pdu_lost,
                                         FaultId::insulation_monitor_lost, FaultId::bus_off_storm,
                                         FaultId::module_supply_lost});
}

TEST_CASE("who cleared a fault without saying more is nobody with authority", "[unit][faults]") {
  const ClearRecord clear;
  CHECK(clear.unix_time_ms == 0);
  CHECK(clear.user_id == 0);
  CHECK(clear.authority == Authority::user);
}
