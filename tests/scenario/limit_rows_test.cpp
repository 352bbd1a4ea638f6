// Every row of the fault table with a limit, from its cause in the pack to its end: measured through the frames of
// emulated modules, sensor and PDU, confirmed, and permanently gone when its cause has ended and it was cleared.
#include <algorithm>
#include <array>
#include <string>

#include "protocol/tables/internal_bus.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"
#include "tests/support/wired_pack.hpp"

using namespace bmu;
using test::WiredPack;

namespace {

/// A pack with everything monitored that can be, and cells that respond to a current.
CoreConfig watchful_pack() {
  CoreConfig config = test::small_pack();
  config.cell.voltage_max_uV = 4'250'000;
  config.cell.series_resistance_Ohm = 0.001;
  LimitsConfig& limits = config.limits;
  limits.cell_deep_discharge = {.warn = 2'700'000, .open = 2'500'000, .hysteresis = 100'000};
  limits.cell_imbalance = {.warn = 200'000, .open = 400'000, .hysteresis = 50'000, .confirm = 300ms};
  limits.charge_overtemperature = {.warn = 420, .open = 450, .hysteresis = 20, .confirm = 100ms};
  limits.charge_undertemperature = {.warn = 50, .open = 0, .hysteresis = 10, .confirm = 100ms};
  limits.temperature_rise = LimitsConfig{}.temperature_rise;
  limits.temperature_spread = LimitsConfig{}.temperature_spread;
  limits.current_sensors_disagree = {.warn = 2'500, .open = 5'000, .hysteresis = 1'000, .confirm = 500ms};
  limits.insulation_low = {.warn = 700'000, .open = 500'000, .hysteresis = 25'000, .confirm = 500ms};
  config.sensor.has_second_current = true;
  config.insulation.monitoring = InsulationMonitoring::measured;
  config.current.discharge_peak_mA = 90'000;
  config.current.discharge_peak_for = 2s;
  config.current.charge_peak_mA = 28'000;
  config.current.charge_peak_for = 2s;
  return config;
}

void that_drives_on(CoreConfig& config) {
  config.insulation.opens_while_driving = false;
}

struct LimitRow {
  FaultId id;
  std::string_view cause;
  std::string_view end;
  std::string_view before{};  // while it closes
  void (*fit)(CoreConfig&) = nullptr;
};

constexpr std::string_view all_cells_poor =
    "cell 1.1 resistance_mOhm 3; cell 1.2 resistance_mOhm 3; cell 1.3 resistance_mOhm 3; cell 1.4 resistance_mOhm 3; "
    "cell 2.1 resistance_mOhm 3; cell 2.2 resistance_mOhm 3; cell 2.3 resistance_mOhm 3; cell 2.4 resistance_mOhm 3";
constexpr std::string_view all_cells_good =
    "cell 1.1 resistance_mOhm auto; cell 1.2 resistance_mOhm auto; cell 1.3 resistance_mOhm auto; "
    "cell 1.4 resistance_mOhm auto; cell 2.1 resistance_mOhm auto; cell 2.2 resistance_mOhm auto; "
    "cell 2.3 resistance_mOhm auto; cell 2.4 resistance_mOhm auto";

constexpr std::array rows{
    LimitRow{FaultId::cell_undervoltage, "cell $C voltage_mV 2700", "cell $C voltage_mV auto"},
    LimitRow{FaultId::cell_overvoltage, "cell $C voltage_mV 4300", "cell $C voltage_mV auto"},
    LimitRow{FaultId::cell_deep_discharge, "cell $C voltage_mV 2400", "cell $C voltage_mV auto"},
    LimitRow{FaultId::cell_imbalance, "cell $C voltage_mV 3200", "cell $C voltage_mV auto"},
    LimitRow{FaultId::cell_resistance, "cell $C resistance_mOhm 4", "cell $C resistance_mOhm auto"},
    LimitRow{FaultId::pack_resistance, all_cells_poor, all_cells_good},
    LimitRow{FaultId::cell_overtemperature, "cell $C temperature_dC 650", "cell $C temperature_dC 250"},
    LimitRow{FaultId::cell_undertemperature, "pack temperature_dC -250; pack ambient_dC -250",
             "pack temperature_dC 250; pack ambient_dC 250"},
    LimitRow{FaultId::charge_overtemperature, "cell $C temperature_dC 500", "cell $C temperature_dC 250"},
    LimitRow{FaultId::charge_undertemperature, "pack temperature_dC -50; pack ambient_dC -50",
             "pack temperature_dC 250; pack ambient_dC 250"},
    LimitRow{FaultId::board_overtemperature, "module $N board_temperature_dC 1050",
             "module $N board_temperature_dC 250"},
    LimitRow{FaultId::board_undertemperature, "module $N board_temperature_dC -450",
             "module $N board_temperature_dC 250"},
    LimitRow{FaultId::temperature_rise, "cell $C temperature_dC ..450 over 5", "cell $C temperature_dC 450"},
    LimitRow{FaultId::temperature_spread, "cell $C temperature_dC 580", "cell $C temperature_dC 250"},
    LimitRow{FaultId::discharge_overcurrent, "load current_A 150", "load current_A 0"},
    LimitRow{FaultId::charge_overcurrent, "load current_A -45", "load current_A 0"},
    LimitRow{FaultId::discharge_overload, "load current_A 95", "load current_A 0"},
    LimitRow{FaultId::charge_overload, "load current_A -28.5", "load current_A 0"},
    LimitRow{FaultId::pack_voltage_mismatch, "sensor pack_voltage offset_mV 1500", "sensor pack_voltage offset_mV 0"},
    LimitRow{FaultId::module_voltage_mismatch, "cell $C offset_mV 400", "cell $C offset_mV 0"},
    LimitRow{FaultId::stuck_values, "cell $C stuck on", "cell $C stuck off", "load profile drive"},
    LimitRow{FaultId::current_sensors_disagree, "sensor current offset_mA 10000", "sensor current offset_mA 0"},
    LimitRow{FaultId::insulation_low, "insulation resistance_kOhm 450", "insulation resistance_kOhm 1200"},
    LimitRow{FaultId::insulation_low_driving, "insulation resistance_kOhm 450", "insulation resistance_kOhm 1200", "",
             that_drives_on},
};

/// Switches the load on and off, for rows that evaluate the response of the cells.
void pulse(WiredPack& pack, int times) {
  for (int count = 0; count < times; ++count) {
    pack.apply(count % 2 == 0 ? "load current_A 30" : "load current_A 0");
    pack.run(450ms);
  }
}

bool needs_pulses(FaultId id) {
  return id == FaultId::cell_resistance || id == FaultId::pack_resistance;
}

}  // namespace

TEST_CASE("every limit of the fault table is reached and left again through real frames", "[scenario][faults][F6]") {
  for (const FaultRow& row : fault_table()) {
    if (!row.has_limit()) continue;
    DYNAMIC_SECTION(row.name) {
      const auto* const found =
          std::find_if(rows.begin(), rows.end(), [&row](const LimitRow& one) { return one.id == row.id; });
      REQUIRE(found != rows.end());  // a new row needs a cause here
      CoreConfig config = watchful_pack();
      if (found->fit != nullptr) found->fit(config);
      WiredPack pack(config);
      pack.run(2500ms);  // the insulation monitor's first value
      if (!found->before.empty()) pack.apply(found->before);
      REQUIRE(pack.close());
      pack.run(500ms);
      const FaultState& state = pack.core().faults().state(row.id);
      REQUIRE(state.stage == FaultStage::good);
      pack.apply(found->cause);
      if (needs_pulses(row.id)) pulse(pack, 12);
      REQUIRE(pack.run_until([&state](const WiredPack&) { return state.is_present(); }, 30s));
      pack.run(1s);
      pack.apply(found->end);
      if (needs_pulses(row.id)) pulse(pack, 60);
      pack.run(20s);
      pack.observe(CommandGiven{.command = Command::clear_faults, .authority = Authority::service});
      pack.run(500ms);
      CHECK_FALSE(state.is_present());
      CHECK_FALSE(state.is_warning);
      CHECK(state.count == 1);
    }
  }
}
