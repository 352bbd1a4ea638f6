// Rows of the ratings of a pack: limits, currents, and maximum ages of signals.
#include <array>

#include "config/fields/pack_fields.hpp"

namespace bmu {
namespace {

struct LimitKeys {
  std::string_view warn;
  std::string_view limit;
  std::string_view open;
  std::string_view hysteresis;
};
constexpr LimitKeys keys_mV{"warn_mV", "limit_mV", "open_mV", "hysteresis_mV"};
constexpr LimitKeys keys_mA{"warn_mA", "limit_mA", "open_mA", "hysteresis_mA"};
constexpr LimitKeys keys_dC{"warn_dC", "limit_dC", "open_dC", "hysteresis_dC"};
constexpr LimitKeys keys_mK_per_s{"warn_mK_per_s", "limit_mK_per_s", "open_mK_per_s", "hysteresis_mK_per_s"};
constexpr LimitKeys keys_permille{"warn_permille", "limit_permille", "open_permille", "hysteresis_permille"};
constexpr LimitKeys keys_ms{"warn_ms", "limit_ms", "open_ms", "hysteresis_ms"};

constexpr std::string_view limit_meaning = "start of current derating; default: the warning threshold";

/// The middle tier, which has no default of its own.
template <std::int64_t Scale>
constexpr Field<LimitConfig> limit_tier(std::string_view key, double min, double max) {
  return {{.key = key, .min = min, .max = max, .meaning = limit_meaning},
          nullptr,
          [](LimitConfig& limit, const FieldValue& value) {
            limit.limit = static_cast<std::int32_t>(std::llround(std::get<double>(value) * static_cast<double>(Scale)));
          }};
}

/// An optional limit needs all its keys once it is present, like any other.
template <std::int64_t Scale>
constexpr std::array<Field<LimitConfig>, 5> limit_table(LimitKeys keys, double min, double max, double hysteresis_max) {
  return {
      required(number<&LimitConfig::warn, Scale>(
          {.key = keys.warn, .min = min, .max = max, .meaning = "warning threshold"})),
      required(number<&LimitConfig::open, Scale>(
          {.key = keys.open, .min = min, .max = max, .meaning = "fault threshold (inclusive)"})),
      required(number<&LimitConfig::hysteresis, Scale>({.key = keys.hysteresis,
                                                        .min = 1,
                                                        .max = hysteresis_max,
                                                        .meaning = "hysteresis for leaving the threshold"})),
      required(number<&LimitConfig::confirm>(
          {.key = "confirm_ms",
           .min = 0,
           .max = 1'000,
           .meaning = "debounce time until the fault is confirmed, at least two samples"})),
      required(number<&LimitConfig::clear>(
          {.key = "clear_ms", .min = 100, .max = 600'000, .meaning = "healing time until the cause counts as gone"})),
  };
}

/// With the middle tier, for limits that lower the allowed current before they open.
template <std::int64_t Scale>
constexpr std::array<Field<LimitConfig>, 6> derating_table(LimitKeys keys, double min, double max,
                                                           double hysteresis_max) {
  const auto plain = limit_table<Scale>(keys, min, max, hysteresis_max);
  return {plain[0], limit_tier<Scale>(keys.limit, min, max), plain[1], plain[2], plain[3], plain[4]};
}
constexpr auto voltage_limit_table = derating_table<1'000>(keys_mV, ocv_min_mV, ocv_max_mV, 1'000);
constexpr auto deep_limit_table = limit_table<1'000>(keys_mV, ocv_min_mV, ocv_max_mV, 1'000);
constexpr auto imbalance_limit_table = derating_table<1'000>(keys_mV, 10, ocv_max_mV, 1'000);
constexpr auto temperature_limit_table = derating_table<1>(keys_dC, -400, 1'200, 300);
constexpr auto cold_board_limit_table = limit_table<1>(keys_dC, -600, 300, 300);
constexpr auto spread_limit_table = derating_table<1>(keys_dC, 10, 1'000, 300);
constexpr auto rise_limit_table = limit_table<1>(keys_mK_per_s, 50, 50'000, 10'000);
constexpr auto current_limit_table = limit_table<1>(keys_mA, 10, pack_current_max_mA, 200'000);
constexpr auto mismatch_limit_table = limit_table<1>(keys_mV, 10, 100'000, 50'000);
constexpr auto stuck_limit_table = limit_table<1>(keys_ms, 500, static_cast<double>(to_ms(stuck_time_max)), 10'000);

constexpr auto resistance_limit_table = limit_table<1>(keys_permille, 1'050, 10'000, 5'000);
// At 900 the allowed current has no peak left: opening must come after that.
constexpr auto overload_limit_table = limit_table<1>(keys_permille, 100, 1'000, 500);
constexpr auto overcurrent_limit_table = derating_table<1>(keys_mA, 10, pack_current_max_mA, 200'000);

/// A time that may be shorter than the default, and longer only if the reaction stays within its budget.
template <auto Member>
constexpr auto confirm_time(std::string_view key, double max, std::string_view meaning) {
  return number<Member>({.key = key, .min = 0, .max = max, .meaning = meaning});
}
constexpr std::array confirm_table{
    confirm_time<&ConfirmTimes::discharge_not_allowed>("discharge_not_allowed_ms", 100,
                                                       "discharge current while discharging is inhibited"),
    confirm_time<&ConfirmTimes::charge_not_allowed>("charge_not_allowed_ms", 100,
                                                    "charge current while charging is inhibited"),
    confirm_time<&ConfirmTimes::current_while_open>("current_while_open_ms", 100, "current with all contactors open"),
    confirm_time<&ConfirmTimes::current_contradicts_voltage>(
        "current_contradicts_voltage_ms", 500,
        "cell voltages that respond to a current change in the wrong direction, or change without one"),
    confirm_time<&ConfirmTimes::cell_not_measured>("cell_not_measured_ms", 150, "invalid cell voltage"),
    confirm_time<&ConfirmTimes::temperature_not_measured>("temperature_not_measured_ms", 100, "missing temperature"),
    confirm_time<&ConfirmTimes::open_wire>("open_wire_ms", 150, "open sense wire"),
    confirm_time<&ConfirmTimes::module_reports_fault>("module_reports_fault_ms", 150,
                                                      "cell fault or failed self-test reported by a module"),
    confirm_time<&ConfirmTimes::module_reports_undervoltage>("module_reports_undervoltage_ms", 150,
                                                             "empty cell reported by a module"),
    confirm_time<&ConfirmTimes::module_warning>("module_warning_ms", 10'000, "warning reported by a module"),
    confirm_time<&ConfirmTimes::insulation_fault>("insulation_fault_ms", 1'000, "insulation monitor not OK"),
    confirm_time<&ConfirmTimes::insulation_monitor_lost>(
        "insulation_monitor_lost_ms", 1'750,
        "insulation monitor not measuring; a monitor on a bus after 500 ms at the latest"),
    confirm_time<&ConfirmTimes::link_not_following>("link_not_following_ms", 200,
                                                    "DC link voltage differs from pack voltage with contactors closed"),
    confirm_time<&ConfirmTimes::link_not_discharging>("link_not_discharging_ms", 1'000,
                                                      "DC link still at pack voltage with contactors open"),
};

constexpr std::array current_table{
    required(number<&CurrentLimitConfig::discharge_continuous_mA>({.key = "discharge_continuous_mA",
                                                                   .min = 1,
                                                                   .max = pack_current_max_mA,
                                                                   .meaning = "continuous discharge current"})),
    number<&CurrentLimitConfig::discharge_peak_mA>(
        {.key = "discharge_peak_mA",
         .min = 0,
         .max = pack_current_max_mA,
         .meaning = "peak discharge current; 0: the warning of `discharge_overcurrent`"}),
    number<&CurrentLimitConfig::discharge_peak_for>({.key = "discharge_peak_for_ms",
                                                     .min = 100,
                                                     .max = 120'000,
                                                     .meaning = "maximum duration of the peak, starting from rest"}),
    required(number<&CurrentLimitConfig::charge_continuous_mA>(
        {.key = "charge_continuous_mA",
         .min = 1,
         .max = pack_current_max_mA,
         .meaning = "continuous charge current, as a positive number"})),
    number<&CurrentLimitConfig::charge_peak_mA>(
        {.key = "charge_peak_mA",
         .min = 0,
         .max = pack_current_max_mA,
         .meaning = "peak charge current; 0: the warning of `charge_overcurrent`"}),
    number<&CurrentLimitConfig::charge_peak_for>({.key = "charge_peak_for_ms",
                                                  .min = 100,
                                                  .max = 120'000,
                                                  .meaning = "maximum duration of the peak, starting from rest"}),
    number<&CurrentLimitConfig::limp_home_discharge_mA>(
        {.key = "limp_home_discharge_mA",
         .min = 0,
         .max = pack_current_max_mA,
         .meaning = "minimum discharge current that derating leaves, until a threshold is reached, an undervoltage is "
                    "predicted or a fault forbids it; 0: none"}),
};

// A bound chosen by this program: above it a wrong digit is more likely than such a pack.
constexpr double pack_power_max_W = 2'000'000;
constexpr std::array pack_limit_table{
    number<&PackLimitsConfig::power_max_W>(
        {.key = "power_max_W",
         .min = 0,
         .max = pack_power_max_W,
         .meaning = "maximum power in both directions: limits the current at the measured pack voltage, to zero while "
                    "that is unknown; 0: not limited"}),
    number<&PackLimitsConfig::voltage_max_V>(
        {.key = "voltage_max_V",
         .min = 0,
         .max = 2'000,
         .meaning = "maximum voltage of the pack with all cells at `open_mV` of `cell_overvoltage`; a higher one is "
                    "refused; 0: not limited"}),
};

constexpr FieldInfo bound_info(std::string_view key, std::string_view meaning) {
  return {.key = key, .min = 0, .max = pack_current_max_mA, .meaning = meaning};
}
constexpr std::array bound_table{
    number<&CurrentBounds::discharge_continuous_mA>(
        bound_info("discharge_continuous_mA", "continuous discharge current; 0: not limited")),
    number<&CurrentBounds::discharge_peak_mA>(
        bound_info("discharge_peak_mA", "the same for the duration of the pack's peak; 0: the continuous one")),
    number<&CurrentBounds::charge_continuous_mA>(
        bound_info("charge_continuous_mA", "continuous charge current, as a positive number; 0: not limited")),
    number<&CurrentBounds::charge_peak_mA>(
        bound_info("charge_peak_mA", "the same for the duration of the pack's peak; 0: the continuous one")),
};

constexpr std::array part_table{
    required(text<&PartConfig::name>({.key = "name",
                                      .min = 1,
                                      .max = std::tuple_size_v<decltype(PartConfig::name)>,
                                      .meaning = "name shown when this component limits the current, e.g. `main fuse`",
                                      .is_well_formed = is_printable_ascii,
                                      .form = "1 to 24 printable ASCII characters"})),
};

constexpr double ramp_max_A_per_s = 1'000'000;
constexpr FieldInfo ramp_info(std::string_view key, std::string_view meaning) {
  return {.key = key, .min = 0, .max = ramp_max_A_per_s, .meaning = meaning};
}
constexpr std::array ramp_table{
    real<&LimitRampConfig::discharge_fall_mA_per_s, 1'000>(
        ramp_info("discharge_fall_A_per_s", "decrease of the discharge limit; 0: all of it in a quarter of a second")),
    real<&LimitRampConfig::discharge_rise_mA_per_s, 1'000>(
        ramp_info("discharge_rise_A_per_s", "increase of the discharge limit; 0: all of it in ten seconds")),
    real<&LimitRampConfig::charge_fall_mA_per_s, 1'000>(
        ramp_info("charge_fall_A_per_s", "decrease of the charge limit; 0: all of it in a quarter of a second")),
    real<&LimitRampConfig::charge_rise_mA_per_s, 1'000>(
        ramp_info("charge_rise_A_per_s", "increase of the charge limit; 0: all of it in ten seconds")),
};

constexpr std::string_view because_module = "required for the 300 ms reaction time to a silent module";
constexpr std::string_view because_sensor = "required for the 300 ms reaction time to a silent sensor or PDU";
constexpr double module_age_max = static_cast<double>(to_ms(module_silence_max - tick_allowance));
constexpr double sensor_age_max = static_cast<double>(to_ms(sensor_silence_max - tick_allowance));
constexpr double temperature_age_max =
    static_cast<double>(to_ms(temperature_reaction_max - temperature_lost_confirm - tick_allowance));

constexpr std::array age_table{
    number<&AgeConfig::cell_voltage>({.key = "cell_voltage_ms",
                                      .min = 50,
                                      .max = module_age_max,
                                      .meaning = "cell voltages",
                                      .because = because_module}),
    number<&AgeConfig::temperature>({.key = "temperature_ms",
                                     .min = 50,
                                     .max = temperature_age_max,
                                     .meaning = "cell temperatures",
                                     .because = "a missing temperature must open the contactors within 950 ms"}),
    number<&AgeConfig::module_status>({.key = "module_status_ms",
                                       .min = 50,
                                       .max = module_age_max,
                                       .meaning = "module status",
                                       .because = because_module}),
    number<&AgeConfig::pack_current>({.key = "pack_current_ms",
                                      .min = 50,
                                      .max = sensor_age_max,
                                      .meaning = "pack current",
                                      .because = because_sensor}),
    number<&AgeConfig::pack_voltage>({.key = "pack_voltage_ms",
                                      .min = 50,
                                      .max = sensor_age_max,
                                      .meaning = "pack and DC link voltage",
                                      .because = because_sensor}),
    number<&AgeConfig::pdu_status>({.key = "pdu_status_ms",
                                    .min = 50,
                                    .max = sensor_age_max,
                                    .meaning = "contactor feedback and inputs",
                                    .because = because_sensor}),
};

constexpr std::array limit_row_table{
    LimitRow{"cell_undervoltage", &LimitsConfig::cell_undervoltage, false, true, voltage_limit_table, "mV", 1'000,
             "cell_voltage_ms", &AgeConfig::cell_voltage, electrical_reaction_max, "The lowest cell."},
    LimitRow{"cell_overvoltage", &LimitsConfig::cell_overvoltage, true, true, voltage_limit_table, "mV", 1'000,
             "cell_voltage_ms", &AgeConfig::cell_voltage, electrical_reaction_max, "The highest cell."},
    LimitRow{"cell_deep_discharge", &LimitsConfig::cell_deep_discharge, false, false, deep_limit_table, "mV", 1'000,
             "cell_voltage_ms", &AgeConfig::cell_voltage, electrical_reaction_max,
             "The lowest cell, below which the pack must be inspected before it is charged again. Left out: the cell's "
             "absolute minimum."},
    LimitRow{"cell_imbalance", &LimitsConfig::cell_imbalance, true, false, imbalance_limit_table, "mV", 1'000,
             "cell_voltage_ms", &AgeConfig::cell_voltage, plausibility_reaction_max,
             "Cell voltage spread. Left out: a fifth of the window between `cell_undervoltage` and `cell_overvoltage` "
             "warns, half of it opens."},
    LimitRow{"cell_overtemperature", &LimitsConfig::cell_overtemperature, true, true, temperature_limit_table, "dC", 1,
             "temperature_ms", &AgeConfig::temperature, temperature_reaction_max, "The hottest sensor."},
    LimitRow{"cell_undertemperature", &LimitsConfig::cell_undertemperature, false, true, temperature_limit_table, "dC",
             1, "temperature_ms", &AgeConfig::temperature, temperature_reaction_max, "The coldest sensor."},
    LimitRow{"charge_overtemperature", &LimitsConfig::charge_overtemperature, true, false, temperature_limit_table,
             "dC", 1, "temperature_ms", &AgeConfig::temperature, temperature_reaction_max,
             "The hottest sensor, for charging. Left out: as `cell_overtemperature`."},
    LimitRow{"charge_undertemperature", &LimitsConfig::charge_undertemperature, false, false, temperature_limit_table,
             "dC", 1, "temperature_ms", &AgeConfig::temperature, temperature_reaction_max,
             "The coldest sensor, for charging. Left out: as `cell_undertemperature`, but not below 0 C."},
    LimitRow{"board_overtemperature", &LimitsConfig::board_overtemperature, true, false, temperature_limit_table, "dC",
             1, "temperature_ms", &AgeConfig::temperature, temperature_reaction_max,
             "The hottest board of a module. Left out: 85 and 100 C."},
    LimitRow{"board_undertemperature", &LimitsConfig::board_undertemperature, false, false, cold_board_limit_table,
             "dC", 1, "temperature_ms", &AgeConfig::temperature, temperature_reaction_max,
             "The coldest board of a module. Left out: -35 and -40 C."},
    LimitRow{"temperature_rise", &LimitsConfig::temperature_rise, true, false, rise_limit_table, "mK_per_s", 1,
             "temperature_ms", &AgeConfig::temperature, temperature_reaction_max,
             "The sensor that warms up fastest, over two seconds. Left out: 0.5 and 1 K/s."},
    LimitRow{"temperature_spread", &LimitsConfig::temperature_spread, true, false, spread_limit_table, "dC", 1,
             "temperature_ms", &AgeConfig::temperature, plausibility_reaction_max,
             "Hottest less coldest sensor. Left out: 15 and 30 K."},
    LimitRow{"discharge_overcurrent", &LimitsConfig::discharge_overcurrent, true, true, overcurrent_limit_table, "mA",
             1, "pack_current_ms", &AgeConfig::pack_current, electrical_reaction_max,
             "Discharge current. Without `limit_mA` it does not derate the permitted current before it opens."},
    LimitRow{"charge_overcurrent", &LimitsConfig::charge_overcurrent, true, true, overcurrent_limit_table, "mA", 1,
             "pack_current_ms", &AgeConfig::pack_current, electrical_reaction_max,
             "Charge current, as a positive number. Without `limit_mA` as above."},
    LimitRow{"pack_voltage_mismatch", &LimitsConfig::pack_voltage_mismatch, true, true, mismatch_limit_table, "mV", 1,
             "pack_voltage_ms", &AgeConfig::pack_voltage, plausibility_reaction_max,
             "Difference between the sum of the cells and the pack voltage."},
    LimitRow{"module_voltage_mismatch", &LimitsConfig::module_voltage_mismatch, true, false, mismatch_limit_table, "mV",
             1, "cell_voltage_ms", &AgeConfig::cell_voltage, plausibility_reaction_max,
             "Difference between a module's voltage and the sum of its cells. Left out: 100 and 300 mV."},
    LimitRow{"current_sensors_disagree", &LimitsConfig::current_sensors_disagree, true, false, current_limit_table,
             "mA", 1, "pack_current_ms", &AgeConfig::pack_current, plausibility_reaction_max,
             "Difference between the two current sensors. Left out: 1 A and 5 % of the continuous current."},
    LimitRow{"stuck_values", &LimitsConfig::stuck_values, true, false, stuck_limit_table, "ms", 1, "cell_voltage_ms",
             &AgeConfig::cell_voltage, stuck_reaction_max,
             "How long a cell's voltage stands still, to the last digit, although current or charge must move it. Left "
             "out: 3 and 8 s."},
    LimitRow{"cell_resistance",
             &LimitsConfig::cell_resistance,
             true,
             false,
             resistance_limit_table,
             "permille",
             1,
             "",
             nullptr,
             {},
             "A cell's resistance, of the average of all. Only warns. Left out: 1500, and from more than twice the "
             "average on trouble code 1."},
    LimitRow{"pack_resistance",
             &LimitsConfig::pack_resistance,
             true,
             false,
             resistance_limit_table,
             "permille",
             1,
             "",
             nullptr,
             {},
             "The average resistance, of what the cell file says. Only warns. Left out: 1500, and from twice that on "
             "trouble code 2."},
    LimitRow{"discharge_overload",
             &LimitsConfig::discharge_overload,
             true,
             false,
             overload_limit_table,
             "permille",
             1,
             "",
             nullptr,
             {},
             "How much of `discharge_peak_mA` is used up. Left out: 800 and 1000, which is all."},
    LimitRow{"charge_overload",
             &LimitsConfig::charge_overload,
             true,
             false,
             overload_limit_table,
             "permille",
             1,
             "",
             nullptr,
             {},
             "How much of `charge_peak_mA` is used up. Left out: 800 and 1000, which is all."},
};

constexpr std::array age_row_table{
    AgeRow{"cell_voltage_ms", &AgeConfig::cell_voltage, [](const CoreConfig& core) { return core.poll.period; },
           "the poll period", internal_bus::cell_sampling_period, true},
    AgeRow{"temperature_ms", &AgeConfig::temperature,
           [](const CoreConfig& core) { return core.poll.period * core.poll.temperature_every; },
           "the poll period times temperature_every", internal_bus::temperature_sampling_period},
    AgeRow{"module_status_ms", &AgeConfig::module_status, [](const CoreConfig& core) { return core.poll.period; },
           "the poll period"},
    AgeRow{"pack_current_ms",
           &AgeConfig::pack_current,
           [](const CoreConfig&) { return internal_bus::sensor_current.period; },
           "the sensor's period",
           {},
           true},
    AgeRow{"pack_voltage_ms",
           &AgeConfig::pack_voltage,
           [](const CoreConfig&) { return internal_bus::sensor_u1.period; },
           "the sensor's period",
           {},
           true},
    AgeRow{"pdu_status_ms", &AgeConfig::pdu_status, [](const CoreConfig&) { return internal_bus::pdu_status.period; },
           "the period of PDU_STATUS"},
};

}  // namespace

std::span<const LimitRow> limit_rows() {
  return limit_row_table;
}
std::span<const AgeRow> age_rows() {
  return age_row_table;
}
std::span<const Field<ConfirmTimes>> confirm_fields() {
  return confirm_table;
}
std::span<const Field<CurrentLimitConfig>> current_fields() {
  return current_table;
}
std::span<const Field<PartConfig>> part_fields() {
  return part_table;
}
std::span<const Field<CurrentBounds>> bound_fields() {
  return bound_table;
}
std::span<const Field<PackLimitsConfig>> pack_limit_fields() {
  return pack_limit_table;
}
std::span<const Field<LimitRampConfig>> ramp_fields() {
  return ramp_table;
}
std::span<const Field<AgeConfig>> age_fields() {
  return age_table;
}

}  // namespace bmu
