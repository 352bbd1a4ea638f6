// Rows of the daemon's connections: buses and their interfaces, the vehicle, a terminal, GPIO lines.
#include <algorithm>
#include <array>

#include "config/fields/id_fields.hpp"
#include "config/fields/pack_fields.hpp"
#include "config/fields/word_fields.hpp"
#include "protocol/number_text.hpp"

namespace bmu {
namespace {

bool is_one_of(char c, std::string_view characters) {
  return characters.find(c) != std::string_view::npos;
}

constexpr int base_id_max = 0x7FF - static_cast<int>(std::size(vehicle_bus::rows)) + 1;

bool is_id_up_to(std::string_view text, int max) {
  const auto value = hex_value(text);
  return value && text.size() <= 3 && *value <= max && text.front() != '-';
}
bool is_base_id(std::string_view text) {
  return is_id_up_to(text, base_id_max);
}
bool is_nothing_or_base_id(std::string_view text) {
  return text.empty() || is_base_id(text);
}

bool is_nothing_or_bus_name(std::string_view text) {
  return text.empty() || is_bus_name(text);
}

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
    text<&BusNames::charger>({.key = "charger",
                              .min = 0,
                              .max = 64,
                              .meaning = "chargers (section `charger`); nothing: on `vehicle`",
                              .is_well_formed = is_nothing_or_bus_name,
                              .form = bus_form}),
    text<&BusNames::second_pack>({.key = "second_pack",
                                  .min = 0,
                                  .max = 64,
                                  .meaning = "a pack beside this one (section `second_pack`); nothing: on `vehicle`",
                                  .is_well_formed = is_nothing_or_bus_name,
                                  .form = bus_form}),
    text<&BusNames::inverter>({.key = "inverter",
                               .min = 0,
                               .max = 64,
                               .meaning = "the inverter (section `inverter`); nothing: on `vehicle`",
                               .is_well_formed = is_nothing_or_bus_name,
                               .form = bus_form}),
    number<&BusNames::internal_kbit_per_s>(
        {.key = "internal_kbit_per_s",
         .min = 125,
         .max = 1'000,
         .meaning = "bitrate of `internal`, used to calculate the bus load of all modules; the interface is configured "
                    "elsewhere, or by `interfaces`, and compared with it",
         .because = "the modules support no other"}),
};

constexpr std::array<std::string_view, vehicle_dialect_count> names_of_dialects() {
  std::array<std::string_view, vehicle_dialect_count> names;
  for (std::size_t i = 0; i < names.size(); ++i) names[i] = vehicle_dialects[i].name;
  return names;
}
constexpr std::array vehicle_dialect_names = names_of_dialects();

constexpr std::array vehicle_table{
    choice<&VehicleConfig::dialect, vehicle_dialect_names>(
        {.key = "dialect",
         .meaning = "how the messages are filled: as in the 2013 design, as their first page has them, or as a "
                    "Lithiumate sends them"}),
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
                                .meaning = "manufacturer in the first message, padded with spaces",
                                .is_well_formed = is_printable_ascii,
                                .form = "1 to 8 ASCII characters"}),
    text<&VehicleConfig::version>({.key = "version",
                                   .min = 1,
                                   .max = 8,
                                   .meaning = "its version, in the second message; padded with spaces",
                                   .is_well_formed = is_printable_ascii,
                                   .form = "1 to 8 ASCII characters"}),
    boolean<&VehicleConfig::is_charge_positive>(
        {.key = "charge_is_positive",
         .meaning = "624h counts the charge current as positive, for receivers that require it"}),
    boolean<&VehicleConfig::is_energy_in_kWh>(
        {.key = "energy_in_kWh", .meaning = "625h of `elithion` counts kWh; else Wh: its readers do not agree"}),
    optional_id<&VehicleConfig::request_id>({.key = "request_id",
                                             .meaning = "identifier at which tools for a Lithiumate request data, "
                                                        "there \"745\"; nothing: requests are not answered",
                                             .is_well_formed = is_nothing_or_id,
                                             .form = id_form}),
    optional_id<&VehicleConfig::reply_id>({.key = "reply_id",
                                           .meaning = "and of the answers; nothing: 8 above it",
                                           .is_well_formed = is_nothing_or_id,
                                           .form = id_form}),
    boolean<&VehicleConfig::may_clear_faults>(
        {.key = "may_clear_faults",
         .meaning =
             "allow requests there to clear stored faults with the rights of a user, from every node on that bus"}),
    optional_id<&VehicleConfig::cell_voltages_id>(
        {.key = "cell_voltages_id",
         .meaning = "identifier of CELL_VOLTAGES, every cell once a period, such as \"650\"; nothing: not sent",
         .is_well_formed = is_nothing_or_id,
         .form = id_form}),
    optional_id<&VehicleConfig::cell_temperatures_id>(
        {.key = "cell_temperatures_id",
         .meaning = "identifier of CELL_TEMPERATURES, every sensor of the cells, such as \"651\"; nothing: not sent",
         .is_well_formed = is_nothing_or_id,
         .form = id_form}),
    number<&VehicleConfig::cell_data_period>(
        {.key = "cell_data_period_ms", .min = 100, .max = 60'000, .meaning = "of a round of all of these"}),
};

constexpr std::array<std::string_view, 2> master_address_names{"F4", "F5"};

constexpr std::array charger_table{
    driver_field<&ChargerConfig::driver, &Device::charger>(
        {.key = "protocol", .meaning = "protocol of the chargers; nothing: none is controlled"}),
    number<&ChargerConfig::unit_count>(
        {.key = "units", .min = 1, .max = charger_units_max, .meaning = "how many of them share the work"}),
    choice<&ChargerConfig::master_address, master_address_names>(
        {.key = "master_address",
         .meaning = "source address of the commands, where the protocol has one: as the chargers are set"}),
    number<&ChargerConfig::current_max_mA>(
        {.key = "current_max_mA",
         .min = 0,
         .max = pack_current_max_mA,
         .meaning = "maximum request to all of them together; 0: `current/charge_continuous_mA`"}),
    number<&ChargerConfig::voltage_max_mV>({.key = "voltage_max_mV",
                                            .min = 0,
                                            .max = 1'500'000,
                                            .meaning = "maximum request; 0: all cells half a percent above "
                                                       "`cell_full_mV`, at most at the warning of `cell_overvoltage`"}),
    number<&ChargerConfig::mains_current_max_mA>(
        {.key = "mains_current_max_mA",
         .min = 1'000,
         .max = 100'000,
         .meaning = "maximum mains current of each, if its protocol supports it"}),
    number<&ChargerConfig::cell_full_uV, 1'000>(
        {.key = "cell_full_mV",
         .min = 0,
         .max = ocv_max_mV,
         .meaning =
             "where the highest cell is held, and full; 0: where the cell's curve ends, and at least 10 mV below "
             "the warning of `cell_overvoltage` and its middle tier"}),
    number<&ChargerConfig::end_current_mA>(
        {.key = "end_current_mA",
         .min = 0,
         .max = pack_current_max_mA,
         .meaning = "full, when the highest cell takes no more than this; 0: the current of 20 hours"}),
    number<&ChargerConfig::end_for>(
        {.key = "end_for_ms", .min = 1'000, .max = 3'600'000, .meaning = "and for so long"}),
    number<&ChargerConfig::rise_mA_per_s>({.key = "rise_mA_per_s",
                                           .min = 10,
                                           .max = 1'000'000,
                                           .meaning = "rise of the request; a lower request takes effect immediately"}),
    number<&ChargerConfig::balance_window_uV, 1'000>(
        {.key = "balance_window_mV",
         .min = 0,
         .max = 500,
         .meaning = "cells that are no further apart at the top count as full together; else the charge pauses there "
                    "while they are balanced; 0: what balancing by voltages leaves, `dead_band_mV` and twice the "
                    "cell's `hysteresis_mV`, and at least 10 mV"}),
    number<&ChargerConfig::resume_uV, 1'000>({.key = "resume_mV",
                                              .min = 1,
                                              .max = 500,
                                              .meaning = "how far the highest cell is bled down, from where it stands "
                                                         "5 min after the charge has paused, before the "
                                                         "charge goes on"}),
    number<&ChargerConfig::resume_below_permille>(
        {.key = "resume_below_permille",
         .min = 0,
         .max = 990,
         .meaning = "a full pack that stays plugged in is charged again below this state of charge; 0: never"}),
    boolean<&ChargerConfig::opens_when_full>(
        {.key = "opens_when_full", .meaning = "the contactors open once it is full, unless the vehicle is on"}),
    boolean<&ChargerConfig::requests_mains>(
        {.key = "requests_mains",
         .meaning = "the charger is commanded to request mains from a charging post while the pack is being charged, "
                    "if its protocol supports it"}),
};

constexpr std::array<std::string_view, 3> silent_inverter_names{"warn", "stop", "open"};

bool is_short_ascii(std::string_view text) {
  return text.empty() || is_printable_ascii(text);
}

constexpr std::array inverter_table{
    driver_field<&InverterConfig::driver, &Device::inverter>(
        {.key = "protocol", .meaning = "protocol of the inverter; nothing: none is controlled"}),
    number<&InverterConfig::period>({.key = "period_ms",
                                     .min = 200,
                                     .max = 5'000,
                                     .meaning = "period of all messages; decreasing limits are sent immediately",
                                     .because = "as SMA takes no frame more often than every 200 ms"}),
    number<&InverterConfig::silence_max>(
        {.key = "silence_max_ms",
         .min = 0,
         .max = 60'000,
         .meaning = "timeout of its keep-alive while the pack is closed; 0: not monitored"}),
    number<&InverterConfig::first_word_max>(
        {.key = "first_word_max_ms",
         .min = 1'000,
         .max = 600'000,
         .meaning = "maximum time from closing to the first message of an inverter that is supplied by the pack"}),
    choice<&InverterConfig::when_silent, silent_inverter_names>(
        {.key = "when_silent",
         .meaning = "reaction to a missing keep-alive: `warn` warning only, `stop` reported limits are zero, `open` "
                    "the pack opens, too, 5 s later at the latest"}),
    number<&InverterConfig::charge_voltage_max_mV>(
        {.key = "charge_voltage_max_mV",
         .min = 0,
         .max = 1'500'000,
         .meaning =
             "to which it may charge; 0: all cells full, where the cell's curve ends, and at least 10 mV below the "
             "warning of `cell_overvoltage` and its middle tier"}),
    number<&InverterConfig::discharge_voltage_min_mV>(
        {.key = "discharge_voltage_min_mV",
         .min = 0,
         .max = 1'500'000,
         .meaning = "to which it may discharge; 0: all cells at the warning of `cell_undervoltage`"}),
    number<&InverterConfig::charge_max_mA>({.key = "charge_current_max_mA",
                                            .min = 0,
                                            .max = pack_current_max_mA,
                                            .meaning = "most that it may charge with; 0: as much as the pack allows"}),
    number<&InverterConfig::discharge_max_mA>({.key = "discharge_current_max_mA",
                                               .min = 0,
                                               .max = pack_current_max_mA,
                                               .meaning = "most that it may draw; 0: likewise"}),
    number<&InverterConfig::force_charge_permille>(
        {.key = "force_charge_below_permille",
         .min = 0,
         .max = 500,
         .meaning = "SOC below which it is requested to charge, from the mains if necessary; 0: never"}),
    number<&InverterConfig::full_charge_after_days>(
        {.key = "full_charge_after_days",
         .min = 0,
         .max = 365,
         .meaning = "a full charge is requested when 97 % have not been reached for this time; 0: never"}),
    number<&InverterConfig::soh_assumed_permille>(
        {.key = "soh_assumed_permille",
         .min = 0,
         .max = 1'000,
         .meaning =
             "SOH reported while it is unknown; 0: none, and if the protocol has no code for that, no SOC either"}),
    Field<InverterConfig>{{.key = "discharge_is_positive",
                           .meaning = "356h counts the discharge current as positive; left out, as the protocol is "
                                      "known: true with orion, else false",
                           .type = FieldType::boolean},
                          nullptr,  // no default: it depends on the protocol
                          [](InverterConfig& inverter, const FieldValue& value) {
                            inverter.is_discharge_positive = std::get<bool>(value);
                          }},
    boolean<&InverterConfig::has_short_frames>(
        {.key = "short_frames", .meaning = "frames end with their last byte that has a meaning; else they have eight"}),
    Field<InverterConfig>{{.key = "maker",
                           .min = 0,
                           .max = 8,
                           .meaning = "manufacturer of the battery in 35Eh, which some inverters evaluate; nothing: "
                                      "\"PYLON\" with pylontech, else \"BMUD\"",
                           .is_well_formed = is_short_ascii,
                           .form = "up to 8 ASCII characters",
                           .type = FieldType::text},
                          [](const InverterConfig& inverter) -> FieldValue {
                            return inverter.maker.front() == '\0' ? std::string() : detail::text_of(inverter.maker);
                          },
                          [](InverterConfig& inverter, const FieldValue& value) {
                            const std::string& text = std::get<std::string>(value);
                            inverter.maker = {};
                            if (!text.empty()) detail::assign_text(inverter.maker, text);
                          }},
};

template <auto Member>
constexpr Field<ForeignModulesConfig> module_option(FieldInfo info) {
  info.type = FieldType::boolean;
  return {
      info, [](const ForeignModulesConfig& foreign) -> FieldValue { return foreign.options.*Member; },
      [](ForeignModulesConfig& foreign, const FieldValue& value) { foreign.options.*Member = std::get<bool>(value); }};
}

constexpr std::array foreign_module_table{
    driver_field<&ForeignModulesConfig::driver, &Device::modules>(
        {.key = "protocol", .meaning = "protocol of the modules; nothing: that of bmud"}),
    Field<ForeignModulesConfig>{
        {.key = "temperature_offset_dC",
         .min = -600,
         .max = -300,
         .meaning = "of `outlander_cmu`: what a temperature byte of 0 means; -500 fits frames of "
                    "a car, and others read them otherwise",
         .type = FieldType::integer},
        [](const ForeignModulesConfig& foreign) -> FieldValue {
          return static_cast<double>(foreign.options.temperature_offset_dC);
        },
        [](ForeignModulesConfig& foreign, const FieldValue& value) {
          foreign.options.temperature_offset_dC = static_cast<std::int32_t>(std::get<double>(value));
        }},
    module_option<&ModuleOptions::swaps_cell_frames>(
        {.key = "swaps_cell_frames",
         .meaning = "of `outlander_cmu`: 6X2h has cells 5 to 8 and 6X3h cells 1 to 4, as one paper has it and no car"}),
    module_option<&ModuleOptions::idle_as_others>(
        {.key = "idle_as_others",
         .meaning = "of `i3_csc`: an idle command has 00h in b4, as from others, and not 20h, as from the car"}),
};

constexpr std::array second_pack_table{
    optional_id<&SecondPackConfig::base_id>(
        {.key = "base_id",
         .meaning = "identifier of the first of its nine messages, hexadecimal; nothing: there is none",
         .is_well_formed = is_nothing_or_base_id,
         .form = "1 to 3 hexadecimal digits from \"0\" to \"7F7\", or nothing"}),
    choice<&SecondPackConfig::dialect, vehicle_dialect_names>({.key = "dialect", .meaning = "how it fills them"}),
};

bool is_device_file(std::string_view text) {
  constexpr std::string_view devices = "/dev/";
  return is_printable_ascii(text) && text.size() > devices.size() && text.starts_with(devices);
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
    boolean<&InterfaceConfig::set_up>({.key = "set_up",
                                       .meaning = "an interface that is down is configured (bitrate, restart) and "
                                                  "brought up, if the daemon has the permission (CAP_NET_ADMIN)"}),
    number<&InterfaceConfig::vehicle_kbit_per_s>(
        {.key = "vehicle_kbit_per_s",
         .min = 10,
         .max = 1'000,
         .meaning = "bit rate of `vehicle`, if that is another interface; `internal` has the one of `buses`"}),
    number<&InterfaceConfig::charger_kbit_per_s>({.key = "charger_kbit_per_s",
                                                  .min = 0,
                                                  .max = 1'000,
                                                  .meaning = "bit rate of `charger`, if that is an interface of its "
                                                             "own; 0: the first that every device on it can have"}),
    number<&InterfaceConfig::second_pack_kbit_per_s>(
        {.key = "second_pack_kbit_per_s",
         .min = 10,
         .max = 1'000,
         .meaning = "bit rate of `second_pack`, if that is an interface of its own"}),
    number<&InterfaceConfig::inverter_kbit_per_s>(
        {.key = "inverter_kbit_per_s",
         .min = 10,
         .max = 1'000,
         .meaning = "bit rate of `inverter`, if that is an interface of its own"}),
    number<&InterfaceConfig::restart_ms>({.key = "restart_ms",
                                          .min = 0,
                                          .max = 60'000,
                                          .meaning = "automatic restart delay after bus-off; 0: no automatic restart"}),
};
constexpr std::array serial_table{
    text<&SerialConfig::device>({.key = "device",
                                 .min = 0,
                                 .max = 255,
                                 .meaning = "serial device of the console; empty: none",
                                 .is_well_formed = is_no_device_or_a_file,
                                 .form = "a file such as /dev/ttyUSB0, or nothing"}),
    number<&SerialConfig::bit_rate_Bd>(
        {.key = "bit_rate_Bd",
         .min = serial_rates_Bd.front(),
         .max = serial_rates_Bd.back(),
         .meaning = "1200, 2400, 4800, 9600, 19200, 38400, 57600 or 115200; 8 data bits, no parity, 1 stop bit"}),
    boolean<&SerialConfig::may_set_cell_count>(
        {.key = "may_set_cell_count", .meaning = "`CellC` may set the number of cells of a pack with one module"}),
    number<&SerialConfig::modules_max>(
        {.key = "modules_max",
         .min = 1,
         .max = node_max,
         .meaning = "of `CellC`: more cells than one module has are spread over so many at most, at the node numbers "
                    "behind the one of the file; 1: the pack cannot be extended"}),
};

bool is_no_file_or_a_path(std::string_view text) {
  return text.empty() || (is_printable_ascii(text) && text.size() > 1 && text.starts_with("/"));
}

constexpr std::array intake_air_table{
    choice<&IntakeAirKeys::source, air_source_names>(
        {.key = "source",
         .meaning = "a board sensor of a module that sits in the air, the PDU (PDU_TEMPERATURE), or a file of this "
                    "machine's kernel; `none`: 627h reports it as unknown"}),
    number<&IntakeAirKeys::module>(
        {.key = "module", .min = 0, .max = node_max, .meaning = "of `module`: node number; 0: none"}),
    number<&IntakeAirKeys::sensor>({.key = "sensor",
                                    .min = 1,
                                    .max = internal_bus::board_temperatures_per_module,
                                    .meaning = "of `module`: which of its board sensors"}),
    text<&IntakeAirKeys::file>({.key = "file",
                                .min = 0,
                                .max = 255,
                                .meaning = "of `file`: read once a second, milli-degrees Celsius as IIO and hwmon "
                                           "have them",
                                .is_well_formed = is_no_file_or_a_path,
                                .form = "a path such as /sys/bus/iio/devices/iio:device0/in_temp_input, or nothing"}),
    number<&IntakeAirKeys::age_max>({.key = "age_max_ms",
                                     .min = 2'000,
                                     .max = 60'000,
                                     .meaning = "of `pdu` and `file`: an older temperature is unknown; a module's is "
                                                "by `ages/temperature_ms`",
                                     .because = "as it comes once a second, and one may be lost"}),
};

constexpr std::array gpio_line_table{
    required(number<&GpioLine::line>(
        {.key = "line", .min = 0, .max = gpio_line_max, .meaning = "number of the line on its chip, from 0"})),
    boolean<&GpioLine::active_low>({.key = "active_low", .meaning = "the wire is at 0 V when active"}),
};

constexpr FieldInfo debounce_info{.key = "debounce_ms",
                                  .min = 0,
                                  .max = static_cast<double>(to_ms(gpio_debounce_max)),
                                  .meaning = "debounce time",
                                  .because = "the maximum delay of the same state in PDU_STATUS"};
constexpr std::array gpio_feedback_table{number<&GpioFeedback::debounce>(debounce_info)};

constexpr std::array gpio_input_table{
    required(text<&GpioInput::name>({.key = "name",
                                     .min = 1,
                                     .max = 32,
                                     .meaning = "unique display name, e.g. `cockpit`",
                                     .is_well_formed = is_printable_ascii,
                                     .form = "1 to 32 ASCII characters"})),
    required(choice<&GpioInput::kind, gpio_input_kind_names>({.key = "kind", .meaning = "signal of the input"})),
    number<&GpioInput::debounce>(debounce_info),
};

}  // namespace

std::optional<int> hex_value(std::string_view text) {
  const auto value = number_of_text<int>(text, 16);
  return value && *value >= 0 ? value : std::nullopt;
}

bool is_nothing_or_id(std::string_view text) {
  return text.empty() || is_id_up_to(text, 0x7FF);
}

bool is_printable_ascii(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return c >= ' ' && c <= '~'; });
}

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
  // The rules of the kernel: dev_valid_name(). IFNAMSIZ is 16 including the final zero. In addition no control
  // characters, which the kernel allows and a line of a log does not.
  const bool has_room = !name.empty() && name.size() <= 15;
  const bool is_path = name == "." || name == "..";
  return has_room && !is_path && std::none_of(name.begin(), name.end(), [](char c) {
           return static_cast<unsigned char>(c) <= ' ' || is_one_of(c, "/:\x7F");
         });
}

std::span<const Field<BusNames>> bus_fields() {
  return bus_table;
}
std::span<const Field<VehicleConfig>> vehicle_fields() {
  return vehicle_table;
}
std::span<const Field<SecondPackConfig>> second_pack_fields() {
  return second_pack_table;
}
std::span<const Field<ChargerConfig>> charger_fields() {
  return charger_table;
}
std::span<const Field<InverterConfig>> inverter_fields() {
  return inverter_table;
}
std::span<const Field<ForeignModulesConfig>> foreign_module_fields() {
  return foreign_module_table;
}
std::span<const Field<InterfaceConfig>> interface_fields() {
  return interface_table;
}
std::span<const Field<IntakeAirKeys>> intake_air_fields() {
  return intake_air_table;
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

}  // namespace bmu
