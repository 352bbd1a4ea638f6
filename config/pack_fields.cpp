#include "config/pack_fields.hpp"

#include <algorithm>
#include <array>
#include <type_traits>

#include "config/cell_dynamics_reader.hpp"
#include "config/charge_plateau_reader.hpp"
#include "daemon/core/balancing_plan.hpp"
#include "daemon/core/contactor_sequence.hpp"
#include "protocol/number_text.hpp"

namespace bmu {
namespace {

bool is_one_of(char c, std::string_view characters) {
  return characters.find(c) != std::string_view::npos;
}

bool is_printable_ascii(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return c >= ' ' && c <= '~'; });
}

constexpr int base_id_max = 0x7FF - static_cast<int>(std::size(vehicle_bus::rows)) + 1;

std::optional<int> hex_value(std::string_view text) {
  const auto value = number_of_text<int>(text, 16);
  return value && *value >= 0 ? value : std::nullopt;
}

bool is_base_id(std::string_view text) {
  const auto value = hex_value(text);
  return value && text.size() <= 3 && *value <= base_id_max && text.front() != '-';
}

// --- the rows -------------------------------------------------------------------------------------------------------

constexpr std::array bus_table{
    required(text<&BusNames::internal>({.key = "internal",
                                        .min = 1,
                                        .max = 64,
                                        .meaning = "modules, power distribution unit and current sensor",
                                        .is_well_formed = is_bus_name,
                                        .form = bus_form})),
    required(text<&BusNames::vehicle>({.key = "vehicle",
                                       .min = 1,
                                       .max = 64,
                                       .meaning = "the vehicle; may be the same as `internal`",
                                       .is_well_formed = is_bus_name,
                                       .form = bus_form})),
    number<&BusNames::internal_kbit_per_s>(
        {.key = "internal_kbit_per_s",
         .min = 125,
         .max = 1'000,
         .meaning =
             "bit rate of `internal`: what the answers of all modules are reckoned with; the interface is set to it "
             "elsewhere, or by `interfaces`, and compared with it",
         .because = "as the modules know no other"}),
};

constexpr std::array pack_table{
    required(text<&PackConfig::name>(
        {.key = "name", .min = 1, .max = 64, .meaning = "name of the pack, for people: status, log, picture"})),
    // Editors look for this key to find pack.schema.json; it means nothing here.
    Field<PackConfig>{{.key = "$schema",
                       .min = 0,
                       .max = 1024,
                       .meaning = "for editors: where `pack.schema.json` is",
                       .type = FieldType::text},
                      nullptr,
                      [](PackConfig&, const FieldValue&) {}},
};

constexpr std::array module_table{
    number<&ModuleEntry::node>({.key = "node", .min = 1, .max = node_max, .meaning = "node number of one module"}),
    required(number<&ModuleEntry::cell_count>({.key = "cells",
                                               .min = 1,
                                               .max = internal_bus::cells_per_module_max,
                                               .meaning = "cells (or parallel blocks) in series"})),
    required(number<&ModuleEntry::temperature_sensor_count>(
        {.key = "temperature_sensors",
         .min = 0,
         .max = internal_bus::cell_temperatures_per_module_max,
         .meaning = "sensors at cells, as many as the module says it has; at least one in the whole pack"})),
    // Without a default of its own: which module is expected is then remembered.
    Field<ModuleEntry>{{.key = "serial_number",
                        .min = 0,
                        .max = serial_number_max,
                        .meaning = "which module has this node; left out: the one first seen there"},
                       nullptr,
                       [](ModuleEntry& entry, const FieldValue& value) {
                         entry.serial_number = static_cast<std::uint32_t>(std::get<double>(value));
                       }},
};

constexpr std::array cell_name_table{
    required(text<&CellFile::name>({.key = "name", .min = 1, .max = 64, .meaning = "name of the cell type"})),
    text<&CellFile::origin>({.key = "origin", .min = 0, .max = 1024, .meaning = "where the numbers come from"}),
};

constexpr std::array cell_model_table{
    required(real<&CellModel::capacity_uAs, uAs_per_Ah>(
        {.key = "capacity_Ah", .min = 0.01, .max = 10'000, .meaning = "of a parallel block: of the whole block"})),
    required(real<&CellModel::series_resistance_Ohm, 1, 1'000>({.key = "series_resistance_mOhm",
                                                                .min = 0.001,
                                                                .max = 10'000,
                                                                .meaning = "what a current step shows at once"})),
    required(real<&CellModel::rc_resistance_Ohm, 1, 1'000>(
        {.key = "rc_resistance_mOhm", .min = 0, .max = 10'000, .meaning = "what it shows later, when settled"})),
    required(real<&CellModel::rc_time_constant_s>(
        {.key = "rc_time_constant_s", .min = 0.1, .max = 10'000, .meaning = "how fast it settles"})),
    real<&CellModel::slow_rc_resistance_Ohm, 1, 1'000>(
        {.key = "slow_rc_resistance_mOhm",
         .min = 0,
         .max = 10'000,
         .meaning = "what it shows much later: diffusion; 0: not known"}),
    real<&CellModel::slow_rc_time_constant_s>({.key = "slow_rc_time_constant_s",
                                               .min = 1,
                                               .max = 100'000,
                                               .meaning = "how fast that settles: slower than rc_time_constant_s"}),
    real<&CellModel::resistance_activation_K>(
        {.key = "resistance_activation_K",
         .min = 0,
         .max = 10'000,
         .meaning = "all resistances are those at 25 C times exp(this * (1/T - 1/298.15 K)); 0: the same when cold"}),
    real<&CellModel::hysteresis_V, 1, 1'000>(
        {.key = "hysteresis_mV",
         .min = 0,
         .max = 200,
         .meaning = "half of what lies between the open-circuit voltages after charging and after discharging"}),
    real<&CellModel::hysteresis_charge_permille>(
        {.key = "hysteresis_charge_permille",
         .min = 1,
         .max = 1'000,
         .meaning = "of the capacity: so much has to flow back for two thirds of the way from one to the other"}),
    real<&CellModel::self_discharge_permille_per_month>(
        {.key = "self_discharge_permille_per_month",
         .min = 0,
         .max = 1'000,
         .meaning = "of the capacity, in 30 days at 25 C; twice as much every 10 K"}),
    required(real<&CellModel::heat_capacity_J_per_K>(
        {.key = "heat_capacity_J_per_K", .min = 0.1, .max = 1'000'000, .meaning = "about 1 J/K for each gram"})),
    required(real<&CellModel::heat_transfer_W_per_K>(
        {.key = "heat_transfer_W_per_K", .min = 0, .max = 1'000, .meaning = "to the surrounding air, as built in"})),
    required(number<&CellModel::voltage_min_uV, 1'000>(
        {.key = "voltage_min_mV", .min = ocv_min_mV, .max = ocv_max_mV, .meaning = "the maker's absolute minimum"})),
    required(number<&CellModel::voltage_max_uV, 1'000>(
        {.key = "voltage_max_mV", .min = ocv_min_mV, .max = ocv_max_mV, .meaning = "the maker's absolute maximum"})),
    required(number<&CellModel::temperature_min_dC>(
        {.key = "temperature_min_dC", .min = -600, .max = 1'500, .meaning = "the maker's absolute minimum"})),
    required(number<&CellModel::temperature_max_dC>(
        {.key = "temperature_max_dC", .min = -600, .max = 1'500, .meaning = "the maker's absolute maximum"})),
};

// A bound of ours: above it a slip of a digit is more likely than such a pack.
constexpr double current_max_mA = 1'500'000;

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

constexpr std::string_view limit_meaning = "from here the allowed current falls; not given: from the warning on";

/// The middle tier. It has no default of its own.
template <std::int64_t Scale>
constexpr Field<LimitConfig> limit_tier(std::string_view key, double min, double max) {
  return {{.key = key, .min = min, .max = max, .meaning = limit_meaning},
          nullptr,
          [](LimitConfig& limit, const FieldValue& value) {
            limit.limit = static_cast<std::int32_t>(std::llround(std::get<double>(value) * static_cast<double>(Scale)));
          }};
}

/// A limit that may be left out needs all its keys once it is there, like any other.
template <std::int64_t Scale>
constexpr std::array<Field<LimitConfig>, 5> limit_table(LimitKeys keys, double min, double max, double hysteresis_max) {
  return {
      required(number<&LimitConfig::warn, Scale>({.key = keys.warn, .min = min, .max = max, .meaning = "reported"})),
      required(number<&LimitConfig::open, Scale>(
          {.key = keys.open, .min = min, .max = max, .meaning = "the fault; reaching it is enough"})),
      required(number<&LimitConfig::hysteresis, Scale>({.key = keys.hysteresis,
                                                        .min = 1,
                                                        .max = hysteresis_max,
                                                        .meaning = "how far back behind it counts as good again"})),
      required(
          number<&LimitConfig::confirm>({.key = "confirm_ms",
                                         .min = 0,
                                         .max = 1'000,
                                         .meaning = "how long, over at least two samples, before it is believed"})),
      required(number<&LimitConfig::clear>(
          {.key = "clear_ms", .min = 100, .max = 600'000, .meaning = "how long good before it counts as gone"})),
  };
}

/// With the middle tier: those that lower the allowed current before they open.
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
constexpr auto current_limit_table = limit_table<1>(keys_mA, 10, current_max_mA, 200'000);
constexpr auto mismatch_limit_table = limit_table<1>(keys_mV, 10, 100'000, 50'000);
constexpr auto stuck_limit_table = limit_table<1>(keys_ms, 500, static_cast<double>(to_ms(stuck_time_max)), 10'000);

constexpr auto resistance_limit_table = limit_table<1>(keys_permille, 1'050, 10'000, 5'000);
// Where the peak is gone from the allowed current is 900: opening comes behind it.
constexpr auto overload_limit_table = limit_table<1>(keys_permille, 100, 1'000, 500);
constexpr auto overcurrent_limit_table = derating_table<1>(keys_mA, 10, current_max_mA, 200'000);

/// A time that may be shorter than the default, and longer only where the reaction stays within its budget.
template <auto Member>
constexpr auto confirm_time(std::string_view key, double max, std::string_view meaning) {
  return number<Member>({.key = key, .min = 0, .max = max, .meaning = meaning});
}
constexpr std::array confirm_table{
    confirm_time<&ConfirmTimes::discharge_not_allowed>("discharge_not_allowed_ms", 100,
                                                       "current out of the pack while that is forbidden"),
    confirm_time<&ConfirmTimes::charge_not_allowed>("charge_not_allowed_ms", 100,
                                                    "current into the pack while that is forbidden"),
    confirm_time<&ConfirmTimes::current_while_open>("current_while_open_ms", 100,
                                                    "current although everything is open"),
    confirm_time<&ConfirmTimes::current_contradicts_voltage>(
        "current_contradicts_voltage_ms", 500, "cells that answer a step of the current the wrong way round"),
    confirm_time<&ConfirmTimes::cell_not_measured>("cell_not_measured_ms", 150, "a cell that a module does not know"),
    confirm_time<&ConfirmTimes::temperature_not_measured>("temperature_not_measured_ms", 100,
                                                          "a temperature that is missing"),
    confirm_time<&ConfirmTimes::open_wire>("open_wire_ms", 150, "an open sense wire"),
    confirm_time<&ConfirmTimes::module_reports_fault>("module_reports_fault_ms", 150,
                                                      "a failed cell or self-test that a module reports"),
    confirm_time<&ConfirmTimes::module_reports_undervoltage>("module_reports_undervoltage_ms", 150,
                                                             "an empty cell that a module reports"),
    confirm_time<&ConfirmTimes::module_warning>("module_warning_ms", 10'000, "what a module warns of"),
    confirm_time<&ConfirmTimes::insulation_fault>("insulation_fault_ms", 1'000, "a monitor that does not say OK"),
    confirm_time<&ConfirmTimes::insulation_monitor_lost>("insulation_monitor_lost_ms", 1'750,
                                                         "a monitor that does not measure"),
    confirm_time<&ConfirmTimes::link_not_following>("link_not_following_ms", 200,
                                                    "a link that is not the pack although the contactors are closed"),
    confirm_time<&ConfirmTimes::link_not_discharging>("link_not_discharging_ms", 1'000,
                                                      "a link that stays with the pack although they are open"),
};

constexpr std::array current_table{
    required(number<&CurrentLimitConfig::discharge_continuous_mA>(
        {.key = "discharge_continuous_mA", .min = 1, .max = current_max_mA, .meaning = "out of the pack, for ever"})),
    number<&CurrentLimitConfig::discharge_peak_mA>(
        {.key = "discharge_peak_mA",
         .min = 0,
         .max = current_max_mA,
         .meaning = "out of the pack, for a while; 0: the warning of `discharge_overcurrent`"}),
    number<&CurrentLimitConfig::discharge_peak_for>(
        {.key = "discharge_peak_for_ms", .min = 100, .max = 120'000, .meaning = "how long that may last from rest"}),
    required(number<&CurrentLimitConfig::charge_continuous_mA>({.key = "charge_continuous_mA",
                                                                .min = 1,
                                                                .max = current_max_mA,
                                                                .meaning = "into the pack, as a positive number"})),
    number<&CurrentLimitConfig::charge_peak_mA>(
        {.key = "charge_peak_mA",
         .min = 0,
         .max = current_max_mA,
         .meaning = "into the pack, for a while; 0: the warning of `charge_overcurrent`"}),
    number<&CurrentLimitConfig::charge_peak_for>(
        {.key = "charge_peak_for_ms", .min = 100, .max = 120'000, .meaning = "how long that may last from rest"}),
    number<&CurrentLimitConfig::limp_home_discharge_mA>(
        {.key = "limp_home_discharge_mA",
         .min = 0,
         .max = current_max_mA,
         .meaning = "so much may be drawn although tables and lines would allow less, until a threshold is reached, a "
                    "voltage would fall too low, or a fault forbids it; 0: no such floor"}),
};

constexpr FieldInfo bound_info(std::string_view key, std::string_view meaning) {
  return {.key = key, .min = 0, .max = current_max_mA, .meaning = meaning};
}
constexpr std::array bound_table{
    number<&CurrentBounds::discharge_continuous_mA>(
        bound_info("discharge_continuous_mA", "out of the pack, for ever; 0: nothing is said of it")),
    number<&CurrentBounds::discharge_peak_mA>(
        bound_info("discharge_peak_mA", "the same for as long as the pack's peak; 0: the continuous one")),
    number<&CurrentBounds::charge_continuous_mA>(
        bound_info("charge_continuous_mA", "into the pack, as a positive number; 0: nothing is said of it")),
    number<&CurrentBounds::charge_peak_mA>(
        bound_info("charge_peak_mA", "the same for as long as the pack's peak; 0: the continuous one")),
};

constexpr std::array part_table{
    required(text<&PartConfig::name>({.key = "name",
                                      .min = 1,
                                      .max = std::tuple_size_v<decltype(PartConfig::name)>,
                                      .meaning = "what it is called where it binds: `main fuse`",
                                      .is_well_formed = is_printable_ascii,
                                      .form = "1 to 24 printable ASCII characters"})),
};

constexpr double ramp_max_A_per_s = 1'000'000;
constexpr FieldInfo ramp_info(std::string_view key, std::string_view meaning) {
  return {.key = key, .min = 0, .max = ramp_max_A_per_s, .meaning = meaning};
}
constexpr std::array ramp_table{
    real<&LimitRampConfig::discharge_fall_mA_per_s, 1'000>(
        ramp_info("discharge_fall_A_per_s", "of what may be drawn; 0: all of it in a quarter of a second")),
    real<&LimitRampConfig::discharge_rise_mA_per_s, 1'000>(
        ramp_info("discharge_rise_A_per_s", "of what may be drawn; 0: all of it in ten seconds")),
    real<&LimitRampConfig::charge_fall_mA_per_s, 1'000>(
        ramp_info("charge_fall_A_per_s", "of what may be charged; 0: all of it in a quarter of a second")),
    real<&LimitRampConfig::charge_rise_mA_per_s, 1'000>(
        ramp_info("charge_rise_A_per_s", "of what may be charged; 0: all of it in ten seconds")),
};

constexpr std::string_view because_module = "so that a silent module opens the pack within 300 ms";
constexpr std::string_view because_sensor = "so that a silent sensor or unit opens the pack within 300 ms";
constexpr double module_age_max = static_cast<double>(to_ms(module_silence_max - tick_allowance));
constexpr double sensor_age_max = static_cast<double>(to_ms(sensor_silence_max - tick_allowance));
constexpr double temperature_age_max =
    static_cast<double>(to_ms(temperature_reaction_max - temperature_lost_confirm - tick_allowance));
// The contact's word may be lost once on its way.
constexpr double feedback_timeout_max =
    static_cast<double>(to_ms(feedback_reaction_max - internal_bus::pdu_status.period - tick_allowance));

constexpr std::array age_table{
    number<&AgeConfig::cell_voltage>({.key = "cell_voltage_ms",
                                      .min = 50,
                                      .max = module_age_max,
                                      .meaning = "cell voltages",
                                      .because = because_module}),
    number<&AgeConfig::temperature>(
        {.key = "temperature_ms",
         .min = 50,
         .max = temperature_age_max,
         .meaning = "cell temperatures",
         .because = "so that a temperature that is no longer told opens the pack within 950 ms"}),
    number<&AgeConfig::module_status>({.key = "module_status_ms",
                                       .min = 50,
                                       .max = module_age_max,
                                       .meaning = "what modules say about themselves",
                                       .because = because_module}),
    number<&AgeConfig::pack_current>({.key = "pack_current_ms",
                                      .min = 50,
                                      .max = sensor_age_max,
                                      .meaning = "pack current",
                                      .because = because_sensor}),
    number<&AgeConfig::pack_voltage>({.key = "pack_voltage_ms",
                                      .min = 50,
                                      .max = sensor_age_max,
                                      .meaning = "pack and link voltage",
                                      .because = because_sensor}),
    number<&AgeConfig::pdu_status>({.key = "pdu_status_ms",
                                    .min = 50,
                                    .max = sensor_age_max,
                                    .meaning = "contactor feedback and inputs",
                                    .because = because_sensor}),
};

/// A pace that has no default of its own.
template <Duration PollConfig::*Member>
constexpr Field<PollConfig> poll_period(std::string_view key, double min, double max, std::string_view meaning) {
  return {
      {.key = key, .min = min, .max = max, .meaning = meaning}, nullptr, [](PollConfig& poll, const FieldValue& value) {
        poll.*Member = std::chrono::milliseconds(static_cast<std::int64_t>(std::get<double>(value)));
      }};
}

constexpr std::array poll_table{
    number<&PollConfig::period>({.key = "period_ms",
                                 .min = to_ms(poll_period_min),
                                 .max = to_ms(poll_period_max),
                                 .meaning = "from one poll to the next"}),
    number<&PollConfig::temperature_every>(
        {.key = "temperature_every", .min = 1, .max = 10, .meaning = "temperatures once in so many periods"}),
    poll_period<&PollConfig::fast_period>("fast_period_ms", to_ms(poll_period_min), to_ms(poll_period_max),
                                          "the same near a limit, and while the current changes quickly; left out: "
                                          "half of it, or as much more as the bus needs"),
    poll_period<&PollConfig::parked_period>("parked_period_ms", to_ms(poll_period_min), to_ms(parked_period_max),
                                            "the same while the pack is open and nobody wants it; left out: 500"),
};

constexpr std::array contactor_table{
    number<&ContactorConfig::settle>(
        {.key = "settle_ms", .min = 20, .max = 1'000, .meaning = "after one contactor, before the next"}),
    number<&ContactorConfig::feedback_timeout>({.key = "feedback_timeout_ms",
                                                .min = 50,
                                                .max = feedback_timeout_max,
                                                .meaning = "until the auxiliary contact must have followed",
                                                .because = "so that a contact that does not follow opens the pack "
                                                           "within 300 ms"}),
    number<&ContactorConfig::precharge_timeout>(
        {.key = "precharge_timeout_ms",
         .min = 100,
         .max = 10'000,
         .meaning = "until the link must have followed",
         .because = "as a resistor that takes longer is the wrong one for its link"}),
    number<&ContactorConfig::precharge_done_permille>(
        {.key = "precharge_done_permille",
         .min = 900,
         .max = 1'000,
         .meaning = "link voltage, as a share of the pack voltage",
         .because = "as below that the main contactor would close into a surge, and above 1000 never"}),
    number<&ContactorConfig::precharge_current_max_mA>(
        {.key = "precharge_current_max_mA",
         .min = 1,
         .max = 5'000,
         .meaning = "and the current has fallen to this",
         .because = "as more than that is a load or a short behind the resistor"}),
    required(number<&ContactorConfig::precharge_min>(
        {.key = "precharge_min_ms",
         .min = 80,
         .max = 1'000,
         .meaning = "a link that follows sooner, from empty, is no link: the resistor is shorted, or nothing is there",
         .because = "as the link voltage comes every 60 ms, and once at least between the contact and this"})),
    number<&ContactorConfig::precharge_overcurrent_mA>(
        {.key = "precharge_overcurrent_mA",
         .min = 0,
         .max = current_max_mA,
         .meaning = "more than this during precharge is a short; 0: not watched"}),
    number<&ContactorConfig::precharge_tries>(
        {.key = "precharge_tries", .min = 1, .max = 3, .meaning = "that were too slow, before it is a fault"}),
    number<&ContactorConfig::precharge_cool_down>(
        {.key = "precharge_cool_down_ms",
         .min = 2'000,
         .max = 600'000,
         .meaning = "between two tries; the resistor gives off all its heat"}),
    number<&ContactorConfig::precharge_resistance_Ohm>({.key = "precharge_resistance_Ohm",
                                                        .min = 0,
                                                        .max = 1'000'000,
                                                        .meaning = "of the resistor, for its heat; 0: not watched"}),
    number<&ContactorConfig::precharge_energy_J>({.key = "precharge_energy_J",
                                                  .min = 0,
                                                  .max = 1'000'000,
                                                  .meaning = "what the resistor bears at once; 0: not watched"}),
    number<&ContactorConfig::charge_only_discharge_mA>(
        {.key = "charge_only_discharge_mA",
         .min = 100,
         .max = small_current_mA,
         .meaning = "more than this out of an empty pack that is closed for charging only opens it",
         .because = "as sensors are no more accurate than the one, and more than the other empties a small pack"}),
    number<&ContactorConfig::zero_current_grace>(
        {.key = "zero_current_grace_ms",
         .min = 0,
         .max = 210,
         .meaning = "how long the current may take to zero before it is broken",
         .because = "so that with the gap behind it nobody waits longer than 250 ms for an open pack"}),
    number<&ContactorConfig::break_gap>({.key = "break_gap_ms",
                                         .min = 10,
                                         .max = 40,
                                         .meaning = "from the contactor that breaks the current to the others"}),
    number<&ContactorConfig::link_decay>(
        {.key = "link_decay_ms",
         .min = 1'000,
         .max = 60'000,
         .meaning = "after opening, before a link that still follows the pack means a welded contactor"}),
    boolean<&ContactorConfig::has_charge_contactor>(
        {.key = "has_charge_contactor", .meaning = "one of its own, between the link and the charger"}),
    boolean<&ContactorConfig::has_pdu>(
        {.key = "pdu",
         .meaning =
             "a power distribution unit on the internal bus; without it contactors and inputs are `gpio` lines"}),
};

constexpr std::string_view monitoring_form = "\"ok_line\" or \"measured\"";
bool is_monitoring(std::string_view text) {
  return text == "ok_line" || text == "measured";
}

constexpr std::array insulation_table{
    Field<InsulationConfig>{
        {.key = "monitoring",
         .min = 1,
         .max = 16,
         .meaning = "`ok_line`: its OK line alone; `measured`: its resistance and state, too",
         .is_well_formed = is_monitoring,
         .form = monitoring_form,
         .type = FieldType::text},
        [](const InsulationConfig& insulation) -> FieldValue {
          return std::string(insulation.monitoring == InsulationMonitoring::measured ? "measured" : "ok_line");
        },
        [](InsulationConfig& insulation, const FieldValue& value) {
          const bool is_measured = std::get<std::string>(value) == "measured";
          insulation.monitoring = is_measured ? InsulationMonitoring::measured : InsulationMonitoring::ok_line;
        }},
    number<&InsulationConfig::warn_Ohm_per_V>(
        {.key = "warn_Ohm_per_V", .min = 100, .max = 100'000, .meaning = "reported; of each volt of the full pack"}),
    number<&InsulationConfig::open_Ohm_per_V>(
        {.key = "open_Ohm_per_V", .min = 100, .max = 100'000, .meaning = "the fault; of each volt of the full pack"}),
    number<&InsulationConfig::open_min_Ohm>(
        {.key = "open_min_Ohm", .min = 0, .max = 10'000'000, .meaning = "the fault, however low the pack's voltage"}),
    number<&InsulationConfig::confirm>({.key = "confirm_ms",
                                        .min = 0,
                                        .max = 900,
                                        .meaning = "how long before it is believed",
                                        .because = "so that what the monitor says opens the pack within 1 s"}),
    boolean<&InsulationConfig::opens_while_driving>(
        {.key = "opens_while_driving", .meaning = "false: while driving a low resistance only warns"}),
};

constexpr std::array history_table{
    number<&HistoryConfig::keep_days>({.key = "keep_days",
                                       .min = 1,
                                       .max = 3'650,
                                       .meaning = "older rows are removed; so are more than fit into so many days"}),
    number<&HistoryConfig::size_max_MB>({.key = "size_max_MB",
                                         .min = 20,
                                         .max = 100'000,
                                         .meaning = "of the database, with the log beside it; then the oldest rows go",
                                         .because = "10 h of the largest pack have to fit"}),
    number<&HistoryConfig::period_s>(
        {.key = "period_s", .min = 1, .max = 600, .meaning = "a row is the average over so long"}),
};

constexpr std::array rest_table{
    number<&RestConfig::after>({.key = "after_ms",
                                .min = 1'000,
                                .max = 86'400'000,
                                .meaning = "of an open pack with the fault and nobody there"}),
    number<&RestConfig::look_every>(
        {.key = "look_every_ms", .min = 5'000, .max = 86'400'000, .meaning = "the modules are woken for a look"}),
};

/// A threshold that may be absent: no such device.
template <auto Member>
constexpr Field<AuxiliaryConfig> device(FieldInfo info) {
  Field<AuxiliaryConfig> field = number<Member>(info);
  field.read = nullptr;
  return field;
}

/// A voltage that is made of others where it is left out.
template <auto Member>
constexpr Field<BalancingConfig> from_others(FieldInfo info) {
  Field<BalancingConfig> field = number<Member, 1'000>(info);
  field.read = nullptr;
  return field;
}

constexpr std::array auxiliary_table{
    device<&AuxiliaryConfig::fan_on_dC>(
        {.key = "fan_on_dC", .min = -400, .max = 1'200, .meaning = "hottest cell; not given: there is no fan"}),
    device<&AuxiliaryConfig::fan_off_dC>(
        {.key = "fan_off_dC", .min = -400, .max = 1'200, .meaning = "hottest cell, when it stops again"}),
    number<&AuxiliaryConfig::fan_run_max>(
        {.key = "fan_run_max_ms", .min = 1'000, .max = 86'400'000, .meaning = "its longest run"}),
    device<&AuxiliaryConfig::heater_on_dC>(
        {.key = "heater_on_dC", .min = -400, .max = 1'200, .meaning = "coldest cell; not given: there is no heater"}),
    device<&AuxiliaryConfig::heater_off_dC>(
        {.key = "heater_off_dC", .min = -400, .max = 1'200, .meaning = "coldest cell, when it stops again"}),
    number<&AuxiliaryConfig::heater_hot_dC>(
        {.key = "heater_hot_dC", .min = -400, .max = 1'200, .meaning = "hottest cell, from which nothing is heated"}),
    number<&AuxiliaryConfig::heater_run_max>(
        {.key = "heater_run_max_ms", .min = 1'000, .max = 86'400'000, .meaning = "its longest run"}),
    number<&AuxiliaryConfig::pause>(
        {.key = "pause_ms", .min = 1'000, .max = 86'400'000, .meaning = "after a run that took too long"}),
    number<&AuxiliaryConfig::throttle_on_permille>({.key = "throttle_on_permille",
                                                    .min = 0,
                                                    .max = 1'000,
                                                    .meaning = "the motor controller works from here on; 0: always"}),
    number<&AuxiliaryConfig::throttle_off_permille>(
        {.key = "throttle_off_permille", .min = 0, .max = 1'000, .meaning = "and no longer below this"}),
};

constexpr std::array sensor_table{
    boolean<&SensorConfig::little_endian>(
        {.key = "little_endian", .meaning = "the sensor was configured for little-endian values"}),
    boolean<&SensorConfig::invert_current>(
        {.key = "invert_current", .meaning = "it counts charging as positive; here positive leaves the pack"}),
    boolean<&SensorConfig::has_second_current>(
        {.key = "has_second_current", .meaning = "a second one at 531h, mounted the same way round"}),
};

std::optional<SocMethod> soc_method(std::string_view text) {
  for (const SocMethod method : {SocMethod::ekf, SocMethod::mixed, SocMethod::coulomb}) {
    if (text == to_text(method)) return method;
  }
  return std::nullopt;
}

constexpr std::array soc_table{
    number<&SocConfig::rest_current_mA>({.key = "rest_current_mA",
                                         .min = 1,
                                         .max = 5'000,
                                         .meaning = "below this, with the contactors open, the pack rests"}),
    number<&SocConfig::rest>({.key = "rest_ms",
                              .min = 100,
                              .max = 86'400'000,
                              .meaning = "for how long before balancing learns from its voltages, and at least as long "
                                         "as its cells take to settle; the state of charge begins after a second of "
                                         "rest, and says how sure it is"}),
    Field<SocConfig>{
        {.key = "method",
         .min = 3,
         .max = 16,
         .meaning = "whose state of charge is told: `ekf` a Kalman filter, `mixed` counting and, where the curve is "
                    "steep, the voltage, `coulomb` counting alone. The others run beside it, to be compared",
         .is_well_formed = [](std::string_view text) { return soc_method(text).has_value(); },
         .form = "ekf, mixed or coulomb",
         .type = FieldType::text},
        [](const SocConfig& soc) -> FieldValue { return std::string(to_text(soc.method)); },
        [](SocConfig& soc, const FieldValue& value) {
          soc.method = soc_method(std::get<std::string>(value)).value_or(SocMethod{});
        }},
    number<&SocConfig::current_gain_error_permille>(
        {.key = "current_gain_error_permille",
         .min = 1,
         .max = 200,
         .meaning =
             "how well the current sensor counts, one standard deviation: what it may tell too much or too little"}),
    number<&SocConfig::current_offset_error_mA>(
        {.key = "current_offset_error_mA",
         .min = 1,
         .max = 10'000,
         .meaning = "and what it may tell without a current, one standard deviation"}),
    number<&SocConfig::resistance_pause_permille>(
        {.key = "resistance_pause_permille",
         .min = 0,
         .max = 950,
         .meaning =
             "a charger is paused once at this state of charge: the step shows the cells' resistances; 0: never"}),
    number<&SocConfig::resistance_pause>(
        {.key = "resistance_pause_ms", .min = 2'000, .max = 60'000, .meaning = "for how long"}),
};

std::optional<BalancingMethod> balancing_method(std::string_view text) {
  for (const BalancingMethod method :
       {BalancingMethod::terminal_voltage, BalancingMethod::ocv, BalancingMethod::charge}) {
    if (text == to_text(method)) return method;
  }
  return std::nullopt;
}

constexpr std::array balancing_table{
    boolean<&BalancingConfig::is_enabled>({.key = "enabled", .meaning = "cells are balanced at all"}),
    Field<BalancingConfig>{
        {.key = "method",
         .min = 3,
         .max = 16,
         .meaning = "what a plan goes by: `terminal_voltage` near the top of a charge, `ocv` the voltage without the "
                    "current's share, `charge` what is missing in each cell until it is full",
         .is_well_formed = [](std::string_view text) { return balancing_method(text).has_value(); },
         .form = "terminal_voltage, ocv or charge",
         .type = FieldType::text},
        [](const BalancingConfig& balancing) -> FieldValue { return std::string(to_text(balancing.method)); },
        [](BalancingConfig& balancing, const FieldValue& value) {
          balancing.method = balancing_method(std::get<std::string>(value)).value_or(BalancingMethod{});
        }},
    boolean<&BalancingConfig::requires_closed>(
        {.key = "requires_closed", .meaning = "nothing is bled while the contactors are open"}),
    number<&BalancingConfig::bleed_resistance_Ohm>(
        {.key = "bleed_resistance_Ohm", .min = 1, .max = 1'000, .meaning = "of the resistor that bleeds a cell"}),
    number<&BalancingConfig::dead_band_uV, 1'000>(
        {.key = "dead_band_mV", .min = 1, .max = 100, .meaning = "`terminal_voltage` and `ocv` leave so much"}),
    number<&BalancingConfig::dead_band_permille>(
        {.key = "dead_band_permille", .min = 0, .max = 100, .meaning = "of the capacity: `charge` leaves so much"}),
    number<&BalancingConfig::capacity_tolerance_permille>(
        {.key = "capacity_tolerance_permille",
         .min = 0,
         .max = 500,
         .meaning =
             "by how much a cell's capacity may differ from its file's: `charge` counts with it until it has seen "
             "the cell at rest near empty and near full"}),
    from_others<&BalancingConfig::voltage_min_uV>(
        {.key = "voltage_min_mV",
         .min = ocv_min_mV,
         .max = ocv_max_mV,
         .meaning = "nothing is bled while a cell is below. Left out: a tenth of the way from `warn_mV` of "
                    "`cell_undervoltage` to that of `cell_overvoltage`"}),
    from_others<&BalancingConfig::top_uV>(
        {.key = "top_mV",
         .min = ocv_min_mV,
         .max = ocv_max_mV,
         .meaning = "`terminal_voltage` plans while a cell is at or above. Left out: halfway from the open-circuit "
                    "voltage at 900 permille to that of a full cell, if `cell_overvoltage` warns above that"}),
    number<&BalancingConfig::discharge_max_mA>({.key = "discharge_max_mA",
                                                .min = 10,
                                                .max = 100'000,
                                                .meaning = "nothing is bled while more current leaves the pack"}),
    number<&BalancingConfig::board_min_dC>(
        {.key = "board_min_dC", .min = -400, .max = 500, .meaning = "nothing is bled while a board is colder"}),
    number<&BalancingConfig::board_max_dC>(
        {.key = "board_max_dC", .min = 0, .max = 1'200, .meaning = "nothing is bled while a board is hotter"}),
    boolean<&BalancingConfig::without_board_sensor>(
        {.key = "without_board_sensor",
         .meaning = "cells are bled also where a module has no sensor on its board: its resistors cannot overheat"}),
    number<&BalancingConfig::settle>(
        {.key = "settle_ms", .min = 1'000, .max = 600'000, .meaning = "without bleeding, before cells are compared"}),
    boolean<&BalancingConfig::is_autonomous_allowed>(
        {.key = "autonomous",
         .meaning =
             "modules that are left alone on their own supply may balance by themselves; told to each while every "
             "module is the one that belongs on its node"}),
};

constexpr std::array vehicle_table{
    Field<VehicleConfig>{{.key = "base_id",
                          .min = 1,
                          .max = 3,
                          .meaning = "identifier of the first of nine messages, hexadecimal",
                          .is_well_formed = is_base_id,
                          .form = "1 to 3 hexadecimal digits from \"0\" to \"7F7\", so that nine identifiers fit",
                          .type = FieldType::text},
                         [](const VehicleConfig& vehicle) -> FieldValue { return hex_text(vehicle.base_id); },
                         [](VehicleConfig& vehicle, const FieldValue& value) {
                           vehicle.base_id =
                               static_cast<std::uint16_t>(hex_value(std::get<std::string>(value)).value_or(0));
                         }},
    text<&VehicleConfig::name>({.key = "name",
                                .min = 1,
                                .max = 8,
                                .meaning = "who made it, in the first message; padded with spaces",
                                .is_well_formed = is_printable_ascii,
                                .form = "1 to 8 ASCII characters"}),
    text<&VehicleConfig::version>({.key = "version",
                                   .min = 1,
                                   .max = 8,
                                   .meaning = "its version, in the second message; padded with spaces",
                                   .is_well_formed = is_printable_ascii,
                                   .form = "1 to 8 ASCII characters"}),
};

bool is_device_file(std::string_view text) {
  return is_printable_ascii(text) && text.substr(0, 5) == "/dev/";
}

constexpr std::array gpio_table{
    required(text<&GpioConfig::chip>({.key = "chip",
                                      .min = 6,
                                      .max = 255,
                                      .meaning = "the chip's device file; udev can give it a name that stays",
                                      .is_well_formed = is_device_file,
                                      .form = "a file such as /dev/gpiochip0"})),
};

bool is_no_device_or_a_file(std::string_view text) {
  return text.empty() || is_device_file(text);
}

constexpr std::array interface_table{
    boolean<&InterfaceConfig::set_up>(
        {.key = "set_up",
         .meaning =
             "an interface that is down is set to its bit rate and restart, and up, where the daemon has the right "
             "to (CAP_NET_ADMIN)"}),
    number<&InterfaceConfig::vehicle_kbit_per_s>(
        {.key = "vehicle_kbit_per_s",
         .min = 10,
         .max = 1'000,
         .meaning = "bit rate of `vehicle`, if that is another interface; `internal` has the one of `buses`"}),
    number<&InterfaceConfig::restart_ms>(
        {.key = "restart_ms",
         .min = 0,
         .max = 60'000,
         .meaning = "how long after bus-off a controller comes back; 0: not by itself"}),
};
constexpr std::array serial_table{
    text<&SerialConfig::device>({.key = "device",
                                 .min = 0,
                                 .max = 255,
                                 .meaning = "the terminal device of the console; nothing: there is none",
                                 .is_well_formed = is_no_device_or_a_file,
                                 .form = "a file such as /dev/ttyUSB0, or nothing"}),
    number<&SerialConfig::bit_rate_Bd>(
        {.key = "bit_rate_Bd",
         .min = serial_rates_Bd.front(),
         .max = serial_rates_Bd.back(),
         .meaning = "1200, 2400, 4800, 9600, 19200, 38400, 57600 or 115200; 8 data bits, no parity, 1 stop bit"}),
    boolean<&SerialConfig::may_set_cell_count>(
        {.key = "may_set_cell_count", .meaning = "`CellC` may set the number of cells of a pack with one module"}),
};

constexpr std::array gpio_line_table{
    required(number<&GpioLine::line>(
        {.key = "line", .min = 0, .max = gpio_line_max, .meaning = "number of the line on its chip, from 0"})),
    boolean<&GpioLine::active_low>({.key = "active_low", .meaning = "the wire is at 0 V when active"}),
};

constexpr FieldInfo debounce_info{.key = "debounce_ms",
                                  .min = 0,
                                  .max = static_cast<double>(to_ms(gpio_debounce_max)),
                                  .meaning = "how long a level stands still before it counts",
                                  .because = "as long as PDU_STATUS may take to tell the same"};
constexpr std::array gpio_feedback_table{number<&GpioFeedback::debounce>(debounce_info)};

std::optional<GpioInputKind> gpio_input_kind(std::string_view name) {
  const auto* const found = std::find(gpio_input_kind_names.begin(), gpio_input_kind_names.end(), name);
  if (found == gpio_input_kind_names.end()) return std::nullopt;
  return static_cast<GpioInputKind>(found - gpio_input_kind_names.begin());
}

constexpr std::array gpio_input_table{
    required(text<&GpioInput::name>({.key = "name",
                                     .min = 1,
                                     .max = 32,
                                     .meaning = "for people, and no other input's: `cockpit`",
                                     .is_well_formed = is_printable_ascii,
                                     .form = "1 to 32 ASCII characters"})),
    required(Field<GpioInput>{
        {.key = "kind",
         .min = 5,
         .max = 17,
         .meaning = "what it tells",
         .is_well_formed = [](std::string_view name) { return gpio_input_kind(name).has_value(); },
         .form = "vehicle_on, charger_connected, estop, interlock, insulation_ok, supply_ok or resume_button",
         .type = FieldType::text},
        [](const GpioInput& input) -> FieldValue { return std::string(to_text(input.kind)); },
        [](GpioInput& input, const FieldValue& value) {
          input.kind = gpio_input_kind(std::get<std::string>(value)).value_or(GpioInputKind{});
        }}),
    number<&GpioInput::debounce>(debounce_info),
};

constexpr std::array limit_row_table{
    LimitRow{"cell_undervoltage", &LimitsConfig::cell_undervoltage, false, true, voltage_limit_table, "mV", 1'000,
             "cell_voltage_ms", &AgeConfig::cell_voltage, electrical_reaction_max, "The lowest cell."},
    LimitRow{"cell_overvoltage", &LimitsConfig::cell_overvoltage, true, true, voltage_limit_table, "mV", 1'000,
             "cell_voltage_ms", &AgeConfig::cell_voltage, electrical_reaction_max, "The highest cell."},
    LimitRow{"cell_deep_discharge", &LimitsConfig::cell_deep_discharge, false, false, deep_limit_table, "mV", 1'000,
             "cell_voltage_ms", &AgeConfig::cell_voltage, electrical_reaction_max,
             "The lowest cell, where it must not be charged again before somebody has looked. Left out: the cell's "
             "absolute minimum."},
    LimitRow{"cell_imbalance", &LimitsConfig::cell_imbalance, true, false, imbalance_limit_table, "mV", 1'000,
             "cell_voltage_ms", &AgeConfig::cell_voltage, plausibility_reaction_max,
             "Highest less lowest cell. Left out: a fifth of the window between `cell_undervoltage` and "
             "`cell_overvoltage` warns, half of it opens."},
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
             "Current out of the pack. Without `limit_mA` it takes nothing from the allowed current before it opens."},
    LimitRow{"charge_overcurrent", &LimitsConfig::charge_overcurrent, true, true, overcurrent_limit_table, "mA", 1,
             "pack_current_ms", &AgeConfig::pack_current, electrical_reaction_max,
             "Current into the pack, as a positive number. Without `limit_mA` as above."},
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

// --- what the tables say, for documentation -------------------------------------------------------------------------

std::string json_text(const FieldValue& value) {
  const auto text = [](const auto& held) -> std::string {
    using Held = std::decay_t<decltype(held)>;
    if constexpr (std::is_same_v<Held, bool>) {
      return held ? "true" : "false";
    } else if constexpr (std::is_same_v<Held, double>) {
      return number_text(held);
    } else {
      return in_quotes(held);
    }
  };
  return std::visit(text, value);
}

template <class Target>
void describe(const std::string& path, std::span<const Field<Target>> fields, std::vector<KeyDescription>& keys) {
  const Target fresh{};
  for (const Field<Target>& field : fields) {
    const bool has_default = !field.info.is_required && field.read != nullptr;
    keys.push_back({path + "/" + std::string(field.info.key), field.info,
                    has_default ? json_text(field.read(fresh)) : std::string()});
  }
}

template <class Target>
void describe(const std::string& path, std::span<const ListField<Target>> lists, std::vector<KeyDescription>& keys) {
  for (const ListField<Target>& field : lists) {
    const FieldInfo& number = field.info.number;
    keys.push_back({path + "/" + std::string(number.key), number, "", field.info});
  }
}

}  // namespace

std::string hex_text(unsigned id) {
  constexpr std::string_view digits = "0123456789ABCDEF";
  std::string text;
  for (const unsigned shift : {8U, 4U, 0U}) text += digits[(id >> shift) & 0xF];
  return text;
}

bool is_bus_name(std::string_view name) {
  constexpr std::string_view embedded = "unix:";
  constexpr std::string_view plain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_.-";
  if (name.substr(0, embedded.size()) == embedded) {
    const std::string_view bus = name.substr(embedded.size());
    return !bus.empty() && bus.size() <= 32 &&
           std::all_of(bus.begin(), bus.end(), [plain](char c) { return is_one_of(c, plain); });
  }
  // The rules of the kernel: dev_valid_name(). IFNAMSIZ is 16 with the final zero.
  const bool has_room = !name.empty() && name.size() <= 15;
  const bool is_path = name == "." || name == "..";
  return has_room && !is_path &&
         std::none_of(name.begin(), name.end(), [](char c) { return is_one_of(c, "/: \t\n\v\f\r"); });
}

std::span<const LimitRow> limit_rows() {
  return limit_row_table;
}
std::span<const AgeRow> age_rows() {
  return age_row_table;
}
std::span<const Field<PackConfig>> pack_fields() {
  return pack_table;
}
std::span<const Field<ModuleEntry>> module_fields() {
  return module_table;
}
std::span<const Field<CellFile>> cell_name_fields() {
  return cell_name_table;
}
std::span<const Field<CellModel>> cell_model_fields() {
  return cell_model_table;
}
std::span<const Field<ConfirmTimes>> confirm_fields() {
  return confirm_table;
}
std::span<const Field<BusNames>> bus_fields() {
  return bus_table;
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
std::span<const Field<LimitRampConfig>> ramp_fields() {
  return ramp_table;
}
std::span<const Field<AgeConfig>> age_fields() {
  return age_table;
}
std::span<const Field<PollConfig>> poll_fields() {
  return poll_table;
}
std::span<const Field<ContactorConfig>> contactor_fields() {
  return contactor_table;
}
std::span<const Field<SensorConfig>> sensor_fields() {
  return sensor_table;
}
std::span<const Field<InsulationConfig>> insulation_fields() {
  return insulation_table;
}
std::span<const Field<RestConfig>> rest_fields() {
  return rest_table;
}
std::span<const Field<AuxiliaryConfig>> auxiliary_fields() {
  return auxiliary_table;
}
std::span<const Field<SocConfig>> soc_fields() {
  return soc_table;
}
std::span<const Field<BalancingConfig>> balancing_fields() {
  return balancing_table;
}
std::span<const Field<HistoryConfig>> history_fields() {
  return history_table;
}

std::span<const Field<VehicleConfig>> vehicle_fields() {
  return vehicle_table;
}

std::span<const Field<InterfaceConfig>> interface_fields() {
  return interface_table;
}
std::span<const Field<SerialConfig>> serial_fields() {
  return serial_table;
}
std::span<const Field<GpioConfig>> gpio_fields() {
  return gpio_table;
}
std::span<const Field<GpioLine>> gpio_line_fields() {
  return gpio_line_table;
}
std::span<const Field<GpioFeedback>> gpio_feedback_fields() {
  return gpio_feedback_table;
}
std::span<const Field<GpioInput>> gpio_input_fields() {
  return gpio_input_table;
}

std::vector<KeyDescription> describe_keys() {
  std::vector<KeyDescription> keys;
  describe<PackConfig>("", pack_fields(), keys);
  describe<ModuleEntry>("/modules/*", module_fields(), keys);
  // A module without a number of its own is none: the fresh entry's 0 is no default.
  for (KeyDescription& key : keys) {
    if (key.path == "/modules/*/node") key.fallback.clear();
  }
  for (const LimitRow& row : limit_rows()) describe<LimitConfig>("/limits/" + std::string(row.key), row.fields, keys);
  PackConfig fresh;
  visit_sections(fresh, [&keys](const SectionInfo& section, auto fields, const auto&) {
    describe("/" + std::string(section.key), fields, keys);
  });
  describe<PartConfig>("/component_limits/*", part_fields(), keys);
  describe<CurrentBounds>("/component_limits/*", bound_fields(), keys);
  describe<GpioConfig>("/gpio", gpio_fields(), keys);
  describe<GpioLine>("/gpio/outputs/*", gpio_line_fields(), keys);
  describe<GpioLine>("/gpio/feedback/*", gpio_line_fields(), keys);
  describe<GpioFeedback>("/gpio/feedback/*", gpio_feedback_fields(), keys);
  describe<GpioInput>("/gpio/inputs/*", gpio_input_fields(), keys);
  describe<GpioLine>("/gpio/inputs/*", gpio_line_fields(), keys);
  describe<CellFile>("/cell", cell_name_fields(), keys);
  describe<CellModel>("/cell", cell_model_fields(), keys);
  describe<ChargePlateauModel>("/cell/charge_plateau", charge_plateau_fields(), keys);
  describe<CellDynamics>("/cell/dynamics", dynamics_fields(), keys);
  describe<CellDynamics>("/cell/dynamics", dynamics_lists(), keys);
  describe<CellDynamics::Row>("/cell/dynamics/rows/*", dynamics_row_fields(), keys);
  describe<CellDynamics::Row>("/cell/dynamics/rows/*", dynamics_row_lists(), keys);
  return keys;
}

std::vector<SectionDescription> describe_sections() {
  std::vector<SectionDescription> sections{
      {"/modules/*", "A module, or several that are alike."},
      {"/component_limits/*", "Something that the whole current flows through; with at least one current."},
      {"/cell",
       "The cell, in its own file or in place; and `ocv`, `derating`, `charge_plateau`, `dynamics`, see above."},
      {"/cell/charge_plateau", "What a whole charge with a steady current says of the capacity; may be left out."},
      {"/cell/dynamics", "What was measured of the cell; and `rows`."},
      {"/cell/dynamics/rows/*", "The cell at one temperature."},
      {"/gpio", "Lines of this machine; and `outputs`, `feedback`, `inputs`."},
      {"/gpio/outputs/*", "The line of an output, see above for their names."},
      {"/gpio/feedback/*", "The auxiliary contact of the output of that name."},
      {"/gpio/inputs/*", "An input of this machine."}};
  for (const LimitRow& row : limit_rows()) sections.push_back({"/limits/" + std::string(row.key), row.meaning});
  PackConfig fresh;
  visit_sections(fresh, [&sections](const SectionInfo& section, auto, const auto&) {
    sections.push_back({"/" + std::string(section.key), section.meaning});
  });
  return sections;
}

}  // namespace bmu
