// Every key of a pack file and of a cell file, as rows (fields.hpp), in the order of the documentation. The rows are in
// limit_fields.cpp, control_fields.cpp, sensor_fields.cpp and port_fields.cpp, those of modules and cells in
// pack_fields.cpp.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "config/fields/fields.hpp"
#include "config/fields/list_fields.hpp"
#include "config/types/cell_file.hpp"
#include "config/types/pack.hpp"

namespace bmu {

/// SocketCAN: an interface name that the kernel and a line of a log allow; "unix:" and 1 to 32 plain characters: the
/// embedded bus.
[[nodiscard]] bool is_bus_name(std::string_view name);
/// Form that is_bus_name() expects, for messages.
inline constexpr std::string_view bus_form =
    "an interface name of 1 to 15 characters such as can0, or unix: and 1 to 32 of "
    "letters, digits, _ . -";

/// Only characters that any terminal displays.
[[nodiscard]] bool is_printable_ascii(std::string_view text);

/// "620": an identifier as it is written in the file and on a candump line.
[[nodiscard]] std::string hex_text(unsigned id);

/// An element of "modules" in the file: one node, or several identical ones.
struct ModuleEntry {
  std::uint8_t node = 0;
  std::uint8_t cell_count = 0;
  std::uint8_t temperature_sensor_count = 0;
  std::optional<std::uint32_t> serial_number{};  // of the one node
  bool must_report_front_end = false;
};

inline constexpr double serial_number_max = 4'294'967'295;  // u32 in IDENT and COMMAND

inline constexpr int node_max = internal_bus::node_count_max;
// A bound chosen by this program: above it a wrong digit is more likely than such a pack.
inline constexpr double pack_current_max_mA = 1'500'000;
inline constexpr int ocv_points_max = 64;
inline constexpr double ocv_min_mV = 500;
inline constexpr Duration poll_period_min = 20ms;
inline constexpr Duration poll_period_max = 120ms;
inline constexpr Duration parked_period_max = 500ms;
inline constexpr double ocv_max_mV = 6'000;

// Maximum receive timeouts, and the maximum time from a dangerous value to the open command.
inline constexpr Duration module_silence_max = 300ms;
inline constexpr Duration sensor_silence_max = 300ms;
inline constexpr Duration feedback_reaction_max = 300ms;
// The end of an age or of a confirm time is detected on the next tick, which is up to this much later.
inline constexpr Duration tick_allowance = tick_period;
// A stale temperature opens the pack after this; the core's table of faults has the same value (a test compares).
inline constexpr Duration temperature_lost_confirm = 100ms;
inline constexpr Duration electrical_reaction_max = 450ms;
inline constexpr Duration temperature_reaction_max = 950ms;
inline constexpr Duration plausibility_reaction_max = 1s;
inline constexpr Duration stuck_reaction_max = 2s;                    // in addition to the time that is monitored
inline constexpr Duration stuck_time_max = 10s - stuck_reaction_max;  // so that both are 10 s at most
// A GPIO input may be as late as PDU_STATUS, which it replaces: the budgets above apply to both.
inline constexpr Duration gpio_debounce_max = internal_bus::pdu_status.period;
inline constexpr int gpio_line_max = 65'534;  // the kernel counts a chip's lines in 16 bits

/// One of the limits: its keys, and its maximum reaction time.
struct LimitRow {
  std::string_view key;
  LimitConfig LimitsConfig::*member;
  bool is_upper = true;
  bool is_required = true;  // false: optional in the pack file; default of LimitsConfig, or of pack_defaults.hpp
  std::span<const Field<LimitConfig>> fields;
  std::string_view unit;     // of its keys
  std::int32_t scale = 1;    // carried counts per unit
  std::string_view age_key;  // empty: no age of its signal and no budget of its fault
  Duration AgeConfig::*age;
  Duration reaction_max;
  std::string_view meaning;

  [[nodiscard]] std::string key_of(std::string_view quantity) const {
    return std::string(quantity) + "_" + std::string(unit);
  }
};
[[nodiscard]] std::span<const LimitRow> limit_rows();

/// Maximum age of a signal, and its interval.
struct AgeRow {
  std::string_view key;
  Duration AgeConfig::*member;
  Duration (*interval)(const CoreConfig&);
  std::string_view source;     // "poll", "PDU_STATUS"
  Duration sampled_every{};    // by the sender, if it does not sample for each message
  bool takes_a_cycle = false;  // the signal waits for all answers, or its age counts from the POLL
};
[[nodiscard]] std::span<const AgeRow> age_rows();

[[nodiscard]] std::span<const Field<PackConfig>> pack_fields();  // the plain keys at the top level
[[nodiscard]] std::span<const Field<ModuleEntry>> module_fields();
[[nodiscard]] std::span<const Field<CellFile>> cell_name_fields();
[[nodiscard]] std::span<const Field<CellModel>> cell_model_fields();

[[nodiscard]] std::span<const Field<BusNames>> bus_fields();
[[nodiscard]] std::span<const Field<ConfirmTimes>> confirm_fields();
[[nodiscard]] std::span<const Field<StricterReaction>> reaction_fields();
[[nodiscard]] std::span<const Field<CurrentLimitConfig>> current_fields();
[[nodiscard]] std::span<const Field<PartConfig>> part_fields();  // besides those of bound_fields
[[nodiscard]] std::span<const Field<CurrentBounds>> bound_fields();
[[nodiscard]] std::span<const Field<PackLimitsConfig>> pack_limit_fields();
[[nodiscard]] std::span<const Field<LimitRampConfig>> ramp_fields();
[[nodiscard]] std::span<const Field<AgeConfig>> age_fields();
[[nodiscard]] std::span<const Field<PollConfig>> poll_fields();
[[nodiscard]] std::span<const Field<ContactorConfig>> contactor_fields();
[[nodiscard]] std::span<const Field<SensorConfig>> sensor_fields();
[[nodiscard]] std::span<const Field<InsulationConfig>> insulation_fields();
[[nodiscard]] std::span<const Field<RestConfig>> rest_fields();
[[nodiscard]] std::span<const Field<AuxiliaryConfig>> auxiliary_fields();
[[nodiscard]] std::span<const Field<SocConfig>> soc_fields();
[[nodiscard]] std::span<const Field<BalancingConfig>> balancing_fields();
[[nodiscard]] std::span<const Field<VehicleConfig>> vehicle_fields();
[[nodiscard]] std::span<const Field<ChargerConfig>> charger_fields();
[[nodiscard]] std::span<const Field<InverterConfig>> inverter_fields();
[[nodiscard]] std::span<const Field<ForeignModulesConfig>> foreign_module_fields();
[[nodiscard]] std::span<const Field<SecondPackConfig>> second_pack_fields();
[[nodiscard]] std::span<const Field<IntakeAirKeys>> intake_air_fields();
[[nodiscard]] std::span<const Field<HistoryConfig>> history_fields();

[[nodiscard]] std::span<const Field<InterfaceConfig>> interface_fields();
[[nodiscard]] std::span<const Field<SerialConfig>> serial_fields();
[[nodiscard]] std::span<const Field<GpioConfig>> gpio_fields();  // the plain keys of the section
[[nodiscard]] std::span<const Field<GpioLine>> gpio_line_fields();
[[nodiscard]] std::span<const Field<GpioFeedback>> gpio_feedback_fields();  // besides those of a line
[[nodiscard]] std::span<const Field<GpioInput>> gpio_input_fields();        // the same

struct SectionInfo {
  std::string_view key;
  bool is_required = false;
  std::string_view meaning;
};

/// Calls visit(SectionInfo, fields, target) for each section that is a plain object of fields.
template <class Visitor>
void visit_sections(PackConfig& pack, Visitor visit) {
  CoreConfig& core = pack.core;
  visit(SectionInfo{"buses", true, "Where the frames come from: `can0` is SocketCAN, `unix:NAME` the embedded bus."},
        bus_fields(), pack.buses);
  visit(SectionInfo{"current", true, "Continuous and peak current of the pack."}, current_fields(), core.current);
  visit(SectionInfo{"user_limits", false, "Limits below those of the pack, by choice of the user."}, bound_fields(),
        core.user_limits);
  visit(SectionInfo{"pack_limits", false, "Rules that the pack as a whole has to meet."}, pack_limit_fields(),
        core.pack_limits);
  visit(SectionInfo{"limit_ramp", false,
                    "How fast the permitted current falls and rises where nothing demands an immediate change."},
        ramp_fields(), core.limit_ramp);
  visit(SectionInfo{"confirm", false,
                    "How long a condition without thresholds must last until the fault of that name is confirmed; a "
                    "limit has its own `confirm_ms`."},
        confirm_fields(), core.limits.confirm);
  visit(SectionInfo{"ages", false, "How old a signal may be. Older counts as missing, and missing is never good."},
        age_fields(), core.ages);
  visit(SectionInfo{"poll", false, "Poll periods of the modules."}, poll_fields(), core.poll);
  visit(SectionInfo{"contactors", true, "The sequence from open to closed."}, contactor_fields(), core.contactors);
  visit(SectionInfo{"sensor", false, "Sensor of current and voltages, and its configuration: docs/sensors.md."},
        sensor_fields(), core.sensor);
  visit(SectionInfo{"insulation", false, "How the insulation of the pack is watched."}, insulation_fields(),
        core.insulation);
  visit(SectionInfo{"rest", false, "After an undervoltage: the modules asleep, and a look now and then."},
        rest_fields(), core.rest);
  visit(SectionInfo{"auxiliary", false, "Fan, heater, and the line that lets the motor controller work."},
        auxiliary_fields(), core.auxiliary);
  visit(SectionInfo{"soc", false, "When the open-circuit voltage may start the state of charge."}, soc_fields(),
        core.soc);
  visit(SectionInfo{"balancing", false, "Which cells the modules' resistors bleed, and when."}, balancing_fields(),
        core.balancing);
  visit(SectionInfo{"vehicle", false, "The messages to the vehicle."}, vehicle_fields(), core.vehicle);
  visit(SectionInfo{"intake_air", false,
                    "Where the temperature of the intake air, byte 1 of 627h, comes from: docs/vehicle.md."},
        intake_air_fields(), pack.intake_air);
  visit(SectionInfo{"charger", false, "Chargers that bmud controls: docs/charging.md."}, charger_fields(),
        core.charger);
  visit(SectionInfo{"inverter", false, "An inverter that receives the limits of the pack: docs/inverters.md."},
        inverter_fields(), core.inverter);
  visit(SectionInfo{"foreign_modules", false, "Modules of another maker in place of ours: docs/foreign-modules.md."},
        foreign_module_fields(), core.foreign);
  visit(SectionInfo{"second_pack", false, "A pack beside this one with the same messages, which are received."},
        second_pack_fields(), core.second_pack);
  visit(SectionInfo{"interfaces", false, "Whether the daemon sets up its CAN interfaces itself, and to what."},
        interface_fields(), pack.interfaces);
  visit(SectionInfo{"serial", false, "A terminal for people and old tools: docs/serial.md."}, serial_fields(),
        pack.serial);
  visit(SectionInfo{"history", false, "The history of the pack on disk: how much of it is kept."}, history_fields(),
        pack.history);
}

/// Keys of the top level that are neither plain fields nor sections of visit_sections.
inline constexpr std::string_view composite_keys[] = {"cell",   "modules",          "limits",
                                                      "faults", "component_limits", "gpio"};

/// A key for the documentation and for the test that compares the schema.
struct KeyDescription {
  std::string path;  // "/limits/cell_overvoltage/open_mV", "/modules/*/cells", "/cell/name"
  FieldInfo info;
  std::string fallback;            // the default as JSON; empty if there is none
  std::optional<ListInfo> list{};  // if it is a list of numbers; `info` then describes each of them
};
[[nodiscard]] std::vector<KeyDescription> describe_keys();

/// Purpose of the object that holds the keys.
struct SectionDescription {
  std::string path;
  std::string_view meaning;
};
[[nodiscard]] std::vector<SectionDescription> describe_sections();

}  // namespace bmu
