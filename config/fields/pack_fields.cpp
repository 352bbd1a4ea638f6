#include "config/fields/pack_fields.hpp"

#include <array>

namespace bmu {
namespace {

constexpr std::array pack_table{
    required(text<&PackConfig::name>(
        {.key = "name", .min = 1, .max = 64, .meaning = "name of the pack, for people: status, log, picture"})),
    // Editors look for this key to find pack.schema.json; it has no effect here.
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
         .max = cell_sensors_max,
         .meaning = "sensors at cells, as many as the module reports: up to 4, for `outlander_cmu` 5; at least one in "
                    "the whole pack"})),
    // Without a default of its own: the module that is expected is then the registered one.
    Field<ModuleEntry>{{.key = "serial_number",
                        .min = 0,
                        .max = serial_number_max,
                        .meaning = "which module has this node; left out: the one first received there"},
                       nullptr,
                       [](ModuleEntry& entry, const FieldValue& value) {
                         entry.serial_number = static_cast<std::uint32_t>(std::get<double>(value));
                       }},
    boolean<&ModuleEntry::must_report_front_end>(
        {.key = "front_end_faults",
         .meaning = "the module has to report undervoltage of its front end's supply and thermal shutdown of the front "
                    "end; one that does not keeps the pack open"}),
};

constexpr std::array cell_name_table{
    required(text<&CellFile::name>({.key = "name", .min = 1, .max = 64, .meaning = "name of the cell type"})),
    text<&CellFile::origin>({.key = "origin", .min = 0, .max = 1024, .meaning = "source of the data"}),
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

}  // namespace

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

}  // namespace bmu
