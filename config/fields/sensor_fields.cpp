// Rows of the sensors of current, voltage and insulation: their protocol, their bus, and their configuration.
#include <array>

#include "config/fields/id_fields.hpp"
#include "config/fields/pack_fields.hpp"
#include "config/fields/word_fields.hpp"

namespace bmu {
namespace {

constexpr std::array sensor_buses{Port::internal, Port::vehicle, Port::charger};

std::optional<Port> sensor_bus(std::string_view name) {
  for (const Port port : sensor_buses) {
    if (name == to_text(port)) return port;
  }
  return std::nullopt;
}

/// One of the buses of the section `buses`.
template <class Owner>
[[nodiscard]] constexpr Field<Owner> bus_field(std::string_view meaning) {
  return {{.key = "bus",
           .min = 1,
           .max = 16,
           .meaning = meaning,
           .words =
               [] {
                 std::vector<std::string_view> names;
                 names.reserve(std::size(sensor_buses));
                 for (const Port port : sensor_buses) names.push_back(to_text(port));
                 return names;
               },
           .type = FieldType::text},
          [](const Owner& owner) -> FieldValue { return std::string(to_text(owner.bus)); },
          [](Owner& owner, const FieldValue& value) {
            owner.bus = sensor_bus(std::get<std::string>(value)).value_or(Port::internal);
          }};
}

constexpr std::array<std::string_view, 2> monitoring_names{"ok_line", "measured"};

constexpr std::array insulation_table{
    choice<&InsulationConfig::monitoring, monitoring_names>(
        {.key = "monitoring", .meaning = "`ok_line`: its OK line alone; `measured`: its resistance and state, too"}),
    number<&InsulationConfig::warn_Ohm_per_V>({.key = "warn_Ohm_per_V",
                                               .min = 100,
                                               .max = 100'000,
                                               .meaning = "warning threshold, per volt of the full pack"}),
    number<&InsulationConfig::open_Ohm_per_V>(
        {.key = "open_Ohm_per_V", .min = 100, .max = 100'000, .meaning = "fault threshold, per volt of the full pack"}),
    number<&InsulationConfig::open_min_Ohm>({.key = "open_min_Ohm",
                                             .min = 0,
                                             .max = 10'000'000,
                                             .meaning = "minimum of the fault threshold at any pack voltage"}),
    number<&InsulationConfig::confirm>({.key = "confirm_ms",
                                        .min = 0,
                                        .max = 900,
                                        .meaning = "debounce time until the fault is confirmed",
                                        .because = "a report of the monitor must open the pack within 1 s"}),
    boolean<&InsulationConfig::opens_while_driving>(
        {.key = "opens_while_driving", .meaning = "false: while driving a low resistance only warns"}),
    driver_field<&InsulationConfig::driver, &Device::insulation>(
        {.key = "protocol",
         .meaning = "protocol of a monitor on a bus; nothing: the status of the power distribution unit or of a GPIO "
                    "line is used"}),
    bus_field<InsulationConfig>("where that monitor is"),
};

constexpr std::array sensor_table{
    boolean<&SensorConfig::little_endian>(
        {.key = "little_endian", .meaning = "the sensor was configured for little-endian values"}),
    boolean<&SensorConfig::invert_current>(
        {.key = "invert_current",
         .meaning = "the sensor counts charging as positive; in bmud discharging is positive"}),
    boolean<&SensorConfig::has_second_current>(
        {.key = "has_second_current", .meaning = "second current sensor; the worse value of both is used"}),
    boolean<&SensorConfig::is_second_reversed>(
        {.key = "second_is_reversed", .meaning = "mounted in the opposite direction to the first"}),
    driver_field<&SensorConfig::set_up, &Device::set_up>(
        {.key = "protocol",
         .meaning = "of the sensor with results from 521h on: its settings are read at the start; nothing: its results "
                    "are used without a check"}),
    Field<SensorConfig>{
        {.key = "set_up",
         .min = 1,
         .max = 16,
         .meaning = "`verify`: a sensor that is configured otherwise is not used; `configure`: it is configured, while "
                    "the pack is open",
         .words =
             [] {
               return std::vector<std::string_view>{"verify", "configure"};
             },
         .type = FieldType::text},
        [](const SensorConfig& sensor) -> FieldValue {
          return std::string(sensor.is_configured ? "configure" : "verify");
        },
        [](SensorConfig& sensor, const FieldValue& value) {
          sensor.is_configured = std::get<std::string>(value) == "configure";
        }},
    boolean<&SensorConfig::is_stored>(
        {.key = "store", .meaning = "settings are stored in the sensor's memory and survive a supply failure"}),
    driver_field<&SensorConfig::first, &Device::current>(
        {.key = "current_protocol",
         .meaning =
             "of the sensor of the first current; nothing: 521h. The voltages are those of 522h and 523h in any case"}),
    driver_field<&SensorConfig::second, &Device::current>(
        {.key = "second_protocol",
         .meaning =
             "of the sensor of the second current; nothing: 531h, or 521h if the first current has another protocol"}),
    bus_field<SensorConfig>("where the sensors of these two keys are"),
    optional_id<&SensorConfig::second_command_id>(
        {.key = "second_command_id",
         .meaning =
             "identifier at which the settings of a second sensor of `protocol`, at 531h, are read; nothing: not read",
         .is_well_formed = is_nothing_or_id,
         .form = id_form}),
    optional_id<&SensorConfig::second_response_id>({.key = "second_response_id",
                                                    .meaning = "and where it answers",
                                                    .is_well_formed = is_nothing_or_id,
                                                    .form = id_form}),
};

}  // namespace

std::span<const Field<SensorConfig>> sensor_fields() {
  return sensor_table;
}
std::span<const Field<InsulationConfig>> insulation_fields() {
  return insulation_table;
}

}  // namespace bmu
