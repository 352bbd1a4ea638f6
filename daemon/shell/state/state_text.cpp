#include "daemon/shell/state/state_text.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <optional>
#include <stdexcept>
#include <utility>

#include <nlohmann/json.hpp>

#include "daemon/shell/state/state_charges.hpp"
#include "daemon/shell/state/state_modules.hpp"
#include "daemon/shell/state/state_soc.hpp"
#include "protocol/fnv.hpp"

namespace bmu {

namespace {

using Json = nlohmann::ordered_json;

constexpr std::int64_t format = 1;
constexpr std::int64_t totals_max = std::int64_t{1} << 60;  // more than any pack has carried; a session adds to it
constexpr std::int64_t heat_max_uJ = totals_max;            // the same for a resistor
constexpr int depth_max = 8;                                // serialising it for the checksum recurses

/// By ContactorId.
constexpr std::array<std::string_view, contactor_id_count> contactor_names{"main_positive", "main_negative",
                                                                           "precharge", "charge"};

struct Damage : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// --- one description of each record, for writing and for reading ---

class Writer {
 public:
  template <class Number>
  void number(const char* key, const Number& value) {
    json[key] = value;
  }
  void number(const char* key, const std::optional<std::int32_t>& value) {
    json[key] = value ? Json(*value) : Json(nullptr);
  }
  void boolean(const char* key, bool value) { json[key] = value; }
  template <class Enum>
  void name(const char* key, Enum value) {
    json[key] = to_text(value);
  }
  template <class Enum>
  void name(const char* key, const std::optional<Enum>& value) {
    json[key] = value ? Json(to_text(*value)) : Json(nullptr);
  }
  template <class Part>
  void part(const char* key, const Part& value) {
    Writer inner;
    describe(inner, value);
    json[key] = std::move(inner.json);
  }
  template <class Part>
  void part(const char* key, const std::optional<Part>& value) {
    if (value) return part(key, *value);
    json[key] = nullptr;
  }
  /// Whether the record has keys of later versions: always, when writing.
  [[nodiscard]] bool has(const char*) const { return true; }

  Json json = Json::object();
};

class Reader {
 public:
  explicit Reader(const Json& json) : json_(json) {
    if (!json.is_object()) throw Damage("expected an object, found " + json.dump());
  }

  template <class Number>
  void number(const char* key, Number& to) const {
    const Json& value = at(key);
    // An unsigned number above the signed range would come out negative.
    const bool fits = value.is_number_integer() &&
                      (!value.is_number_unsigned() || value.get<std::uint64_t>() <= std::uint64_t{INT64_MAX}) &&
                      value.get<std::int64_t>() >= std::int64_t{std::numeric_limits<Number>::min()} &&
                      value.get<std::int64_t>() <= std::int64_t{std::numeric_limits<Number>::max()};
    if (!fits) throw Damage(std::string(key) + " is " + value.dump());
    to = static_cast<Number>(value.get<std::int64_t>());
  }
  void number(const char* key, std::optional<std::int32_t>& to) const {
    to.reset();
    if (!at(key).is_null()) number(key, to.emplace());
  }
  void boolean(const char* key, bool& to) const {
    if (!at(key).is_boolean()) throw Damage(std::string(key) + " is " + at(key).dump());
    to = at(key).get<bool>();
  }
  /// The enumerators are few and count from 0; "?" is the text of none of them.
  template <class Enum>
  void name(const char* key, Enum& to) const {
    for (std::uint8_t number = 0; to_text(static_cast<Enum>(number)) != "?"; ++number) {
      to = static_cast<Enum>(number);
      if (at(key) == to_text(to)) return;
    }
    throw Damage(std::string(key) + " is " + at(key).dump());
  }
  template <class Enum>
  void name(const char* key, std::optional<Enum>& to) const {
    to.reset();
    if (!at(key).is_null()) name(key, to.emplace());
  }
  template <class Part>
  void part(const char* key, Part& to) const {
    const Reader inner(at(key));
    describe(inner, to);
  }
  template <class Part>
  void part(const char* key, std::optional<Part>& to) const {
    to.reset();
    if (!at(key).is_null()) part(key, to.emplace());
  }
  /// A file of an earlier version has only the first keys of a record.
  [[nodiscard]] bool has(const char* key) const { return json_.contains(key); }

 private:
  [[nodiscard]] const Json& at(const char* key) const {
    const auto found = json_.find(key);
    if (found == json_.end()) throw Damage(std::string(key) + " is missing");
    return *found;
  }

  const Json& json_;
};

template <class Visitor, class Record>
void describe_element(Visitor& visit, Record& element) {
  visit.number("module", element.module_node);
  visit.number("number", element.number);
  visit.number("pack_number", element.pack_number);
  visit.boolean("is_temperature_sensor", element.is_temperature_sensor);
  visit.number("contactor", element.contactor);
  visit.number("input", element.input);
}
template <class Visitor, class Record>
void describe_value(Visitor& visit, Record& value) {
  visit.number("value", value.value);
  visit.name("validity", value.validity);
}
template <class Visitor, class Record>
void describe_outputs(Visitor& visit, Record& outputs) {
  visit.boolean("main_positive", outputs.main_positive);
  visit.boolean("main_negative", outputs.main_negative);
  visit.boolean("precharge", outputs.precharge);
  visit.boolean("charge", outputs.charge);
  visit.boolean("auxiliary", outputs.auxiliary);
  visit.boolean("fan", outputs.fan);
  visit.boolean("heater", outputs.heater);
}
template <class Visitor, class Record>
void describe_inputs(Visitor& visit, Record& inputs) {
  visit.boolean("main_positive_closed", inputs.main_positive_closed);
  visit.boolean("main_negative_closed", inputs.main_negative_closed);
  visit.boolean("precharge_closed", inputs.precharge_closed);
  visit.boolean("charge_closed", inputs.charge_closed);
  visit.boolean("opened_by_timeout", inputs.opened_by_timeout);
  visit.boolean("vehicle_on", inputs.vehicle_on);
  visit.boolean("charger_connected", inputs.charger_connected);
  visit.boolean("estop_1_released", inputs.estop_1_released);
  visit.boolean("estop_2_released", inputs.estop_2_released);
  visit.boolean("interlock_closed", inputs.interlock_closed);
  visit.boolean("insulation_monitor_ok", inputs.insulation_monitor_ok);
  visit.boolean("resume_button", inputs.resume_button);
  visit.boolean("supply_ok", inputs.supply_ok);
  visit.number("estops_pressed", inputs.estops_pressed);
  visit.number("interlocks_open", inputs.interlocks_open);
  visit.name("insulation_state", inputs.insulation_state);
  visit.part("insulation_resistance_Ohm", inputs.insulation_resistance_Ohm);
  visit.part("throttle_permille", inputs.throttle_permille);
  if (visit.has("alarm_loop_open")) visit.boolean("alarm_loop_open", inputs.alarm_loop_open);
}
/// Keys that the first versions of a frame did not have.
template <class Visitor, class Record>
void describe_rest_of_frame(Visitor& visit, Record& frame) {
  visit.name("mode", frame.mode);
  visit.number("cell_voltage_sum_mV", frame.cell_voltage_sum_mV);
  visit.number("module_voltage_sum_mV", frame.module_voltage_sum_mV);
  visit.part("cell_temperature_min_at", frame.cell_temperature_min_at);
  visit.part("cell_temperature_max_at", frame.cell_temperature_max_at);
  visit.number("board_temperature_min_dC", frame.board_temperature_min_dC);
  visit.part("board_temperature_min_at", frame.board_temperature_min_at);
  visit.part("board_temperature_max_at", frame.board_temperature_max_at);
  visit.number("current_2_mA", frame.current_2_mA);
  visit.number("discharge_overload_permille", frame.discharge_overload_permille);
  visit.number("charge_overload_permille", frame.charge_overload_permille);
  visit.part("outputs", frame.outputs);
  visit.part("inputs", frame.inputs);
}
template <class Visitor, class Record>
void describe_frame(Visitor& visit, Record& frame) {
  visit.number("unix_time_ms", frame.unix_time_ms);
  visit.number("value", frame.value);
  visit.number("threshold", frame.threshold);
  visit.part("element", frame.element);
  visit.name("phase", frame.phase);
  visit.number("cell_voltage_min_uV", frame.cell_voltage_min_uV);
  visit.number("cell_voltage_max_uV", frame.cell_voltage_max_uV);
  visit.number("cell_voltage_average_uV", frame.cell_voltage_average_uV);
  visit.part("cell_voltage_min_at", frame.cell_voltage_min_at);
  visit.part("cell_voltage_max_at", frame.cell_voltage_max_at);
  visit.number("cell_temperature_min_dC", frame.cell_temperature_min_dC);
  visit.number("cell_temperature_max_dC", frame.cell_temperature_max_dC);
  visit.number("cell_temperature_average_dC", frame.cell_temperature_average_dC);
  visit.number("board_temperature_max_dC", frame.board_temperature_max_dC);
  visit.number("pack_voltage_mV", frame.pack_voltage_mV);
  visit.number("link_voltage_mV", frame.link_voltage_mV);
  visit.number("current_mA", frame.current_mA);
  visit.number("soc_permille", frame.soc_permille);
  visit.number("insulation_Ohm", frame.insulation_Ohm);
  visit.number("discharge_limit_mA", frame.discharge_limit_mA);
  visit.number("charge_limit_mA", frame.charge_limit_mA);
  if (visit.has("mode")) describe_rest_of_frame(visit, frame);
  if (visit.has("link_time_constant_ms")) visit.number("link_time_constant_ms", frame.link_time_constant_ms);
}
template <class Visitor, class Record>
void describe_clear(Visitor& visit, Record& clear) {
  visit.number("unix_time_ms", clear.unix_time_ms);
  visit.number("user_id", clear.user_id);
  visit.name("authority", clear.authority);
}
template <class Visitor, class Record>
void describe_fault(Visitor& visit, Record& fault) {
  visit.number("count", fault.count);
  visit.number("first_unix_time_ms", fault.first_unix_time_ms);
  visit.number("last_unix_time_ms", fault.last_unix_time_ms);
  visit.boolean("is_locked", fault.is_locked);
  visit.part("cleared", fault.cleared);
  visit.part("frame", fault.frame);
}
template <class Visitor, class Record>
void describe_wear(Visitor& visit, Record& wear) {
  visit.number("closings", wear.closings);
  visit.number("openings", wear.openings);
  visit.number("openings_under_load", wear.openings_under_load);
  visit.number("current_broken_max_mA", wear.current_broken_max_mA);
  visit.number("current_broken_sum_mA", wear.current_broken_sum_mA);
}

template <class Visitor, class Record>
void describe_precharge(Visitor& visit, Record& precharge) {
  visit.number("heat_uJ", precharge.heat_uJ);
  visit.number("last_try_uJ", precharge.last_try_uJ);
  visit.number("tries_failed", precharge.tries_failed);
}
template <class Visitor, class Record>
void describe_closing(Visitor& visit, Record& closing) {
  visit.part("precharge", closing.precharge);
  visit.number("lockout_ms", closing.lockout_ms);
}

template <class Visitor, class Record>
void describe_totals(Visitor& visit, Record& totals) {
  visit.number("charge_out_uAs", totals.charge_out_uAs);
  visit.number("charge_in_uAs", totals.charge_in_uAs);
  visit.number("energy_out_mWh", totals.energy_out_mWh);
  visit.number("energy_in_mWh", totals.energy_in_mWh);
}

template <class Visitor, class Record>
void describe_known_module(Visitor& visit, Record& module) {
  visit.number("serial_number", module.serial_number);
}

void describe(Writer& visit, const KnownModule& module) {
  describe_known_module(visit, module);
}
void describe(const Reader& visit, KnownModule& module) {
  describe_known_module(visit, module);
  module.is_known = true;
}
void describe(Writer& visit, const Element& element) {
  describe_element(visit, element);
}
void describe(const Reader& visit, Element& element) {
  describe_element(visit, element);
}
void describe(Writer& visit, const SignalValue& value) {
  describe_value(visit, value);
}
void describe(const Reader& visit, SignalValue& value) {
  describe_value(visit, value);
}
void describe(Writer& visit, const ContactorOutputs& outputs) {
  describe_outputs(visit, outputs);
}
void describe(const Reader& visit, ContactorOutputs& outputs) {
  describe_outputs(visit, outputs);
}
void describe(Writer& visit, const PduState& inputs) {
  describe_inputs(visit, inputs);
}
void describe(const Reader& visit, PduState& inputs) {
  describe_inputs(visit, inputs);
}
void describe(Writer& visit, const FreezeFrame& frame) {
  describe_frame(visit, frame);
}
void describe(const Reader& visit, FreezeFrame& frame) {
  describe_frame(visit, frame);
}
void describe(Writer& visit, const ClearRecord& clear) {
  describe_clear(visit, clear);
}
void describe(const Reader& visit, ClearRecord& clear) {
  describe_clear(visit, clear);
}
void describe(Writer& visit, const FaultRecord& fault) {
  describe_fault(visit, fault);
}
void describe(const Reader& visit, FaultRecord& fault) {
  describe_fault(visit, fault);
}
void describe(Writer& visit, const ContactorWear& wear) {
  describe_wear(visit, wear);
}
void describe(const Reader& visit, ContactorWear& wear) {
  describe_wear(visit, wear);
}
void describe(Writer& visit, const PrechargeMemory& precharge) {
  describe_precharge(visit, precharge);
}
void describe(const Reader& visit, PrechargeMemory& precharge) {
  describe_precharge(visit, precharge);
  for (const std::int64_t one : {precharge.heat_uJ, precharge.last_try_uJ}) {
    if (one < 0 || one > heat_max_uJ) throw Damage("a heat is " + std::to_string(one));
  }
}
void describe(Writer& visit, const ClosingMemory& closing) {
  describe_closing(visit, closing);
}
void describe(const Reader& visit, ClosingMemory& closing) {
  describe_closing(visit, closing);
}

void describe(Writer& visit, const PackTotals& totals) {
  describe_totals(visit, totals);
}
void describe(const Reader& visit, PackTotals& totals) {
  describe_totals(visit, totals);
  for (const std::int64_t one :
       {totals.charge_out_uAs, totals.charge_in_uAs, totals.energy_out_mWh, totals.energy_in_mWh}) {
    if (one < 0 || one > totals_max) throw Damage("a total is " + std::to_string(one));
  }
}

// --- the whole ---

std::string checksum_of(const std::string& content) {
  std::array<char, 20> hex{};
  std::snprintf(hex.data(), hex.size(), "%016llx", static_cast<unsigned long long>(continue_fnv(fnv_start, content)));
  return hex.data();
}

/// Reads records into an array by their names; counts those with unknown names.
template <class Records, class Find>
std::size_t read_named(const Json& parent, const char* key, Records& records, Find find) {
  if (!parent.contains(key) || !parent[key].is_object()) throw Damage(std::string(key) + " is missing");
  std::size_t unknown = 0;
  for (const auto& [name, json] : parent[key].items()) {
    const std::optional<std::size_t> index = find(name);
    if (!index) {
      ++unknown;
      continue;
    }
    const Reader reader(json);
    describe(reader, records.at(*index));
  }
  return unknown;
}

template <class Names, class NameOf>
std::optional<std::size_t> index_of(const Names& names, std::string_view name, NameOf name_of) {
  const auto found = std::find_if(names.begin(), names.end(), [&](const auto& one) { return name_of(one) == name; });
  if (found == names.end()) return std::nullopt;
  return static_cast<std::size_t>(found - names.begin());
}

StateRead read_content(const Json& content) {
  if (!content.is_object()) throw Damage("content is no object");
  StateRead read;
  read.unknown_names += read_named(content, "faults", read.state.faults, [](std::string_view name) {
    return index_of(fault_table(), name, [](const FaultRow& row) { return row.name; });
  });
  read.unknown_names += read_named(content, "contactors", read.state.contactors, [](std::string_view name) {
    return index_of(contactor_names, name, [](std::string_view one) { return one; });
  });
  // Files from before these keys are accepted nevertheless: nothing is pending then, and no module is registered.
  const Reader whole(content);
  if (content.contains("closing")) whole.part("closing", read.state.closing);
  if (content.contains("totals")) whole.part("totals", read.state.totals);
  if (content.contains("starts")) whole.number("starts", read.state.starts);
  if (content.contains("hours_since_full")) whole.number("hours_since_full", read.state.hours_since_full);
  if (content.contains("modules")) {
    read.unknown_names += read_named(content, "modules", read.state.modules, node_from_text);
  }
  if (content.contains("cell_charges")) {
    const Result<CellChargeRecords, std::string> charges = parse_charges(content["cell_charges"]);
    if (charges) read.state.cell_charges = *charges;
    if (!charges) read.charges_problem = charges.error();
  }
  if (content.contains("soc")) {
    const Result<SocRecords, std::string> soc = parse_soc(content["soc"]);
    if (soc) read.state.soc = *soc;
    if (!soc) read.soc_problem = soc.error();
  }
  return read;
}

/// The exceptions of the library begin with a name and a number in brackets, which mean nothing to a reader.
std::string without_number(std::string_view what) {
  const std::size_t end = what.starts_with("[json.exception.") ? what.find("] ") : std::string_view::npos;
  return std::string(end == std::string_view::npos ? what : what.substr(end + 2));
}

}  // namespace

std::string state_text(const PersistentState& state) {
  Writer faults;
  for (const FaultRow& row : fault_table()) {
    const FaultRecord& record = state.faults[static_cast<std::size_t>(row.id)];
    if (record != FaultRecord{}) faults.part(std::string(row.name).c_str(), record);  // most never occurred
  }
  Writer contactors;
  for (std::size_t i = 0; i < contactor_id_count; ++i) {
    contactors.part(std::string(contactor_names[i]).c_str(), state.contactors[i]);
  }
  Writer closing;
  describe(closing, state.closing);
  Writer totals;
  describe(totals, state.totals);
  Writer modules;
  for (std::size_t node = 1; node < state.modules.size(); ++node) {
    if (state.modules[node].is_known) modules.part(std::to_string(node).c_str(), state.modules[node]);
  }
  const Json content{{"faults", std::move(faults.json)},
                     {"contactors", std::move(contactors.json)},
                     {"closing", std::move(closing.json)},
                     {"modules", std::move(modules.json)},
                     {"cell_charges", charges_json(state.cell_charges)},
                     {"soc", soc_json(state.soc)},
                     {"totals", std::move(totals.json)},
                     {"starts", state.starts},
                     {"hours_since_full", state.hours_since_full}};
  return Json{{"format", format}, {"checksum", checksum_of(content.dump())}, {"content", content}}.dump() + "\n";
}

Result<StateRead, std::string> parse_state(std::string_view text) {
  if (text.empty()) return failure(std::string("empty"));
  try {
    const Json file = Json::parse(text, [](int depth, Json::parse_event_t, const Json&) {
      if (depth > depth_max) throw Damage("nested more than " + std::to_string(depth_max) + " deep");
      return true;
    });
    if (!file.is_object() || !file.contains("format") || !file.contains("checksum") || !file.contains("content")) {
      return failure(std::string("expected format, checksum and content"));
    }
    if (file["format"] != format) {
      return failure("found format " + file["format"].dump() + ", expected " + std::to_string(format));
    }
    const std::string checksum = checksum_of(file["content"].dump());
    if (file["checksum"] != checksum) {
      return failure("checksum mismatch: found " + file["checksum"].dump() + ", expected " + checksum);
    }
    return read_content(file["content"]);
  } catch (const Json::parse_error& error) {
    return failure("from byte " + std::to_string(error.byte) + " on it is no JSON");
  } catch (const std::exception& error) {
    return failure(without_number(error.what()));
  }
}

}  // namespace bmu
