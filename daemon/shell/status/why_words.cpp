#include "daemon/shell/status/why_words.hpp"

#include <algorithm>
#include <utility>

#include "daemon/shell/gpio/line_feeder.hpp"
#include "daemon/shell/status/span_text.hpp"
#include "devices/device_list.hpp"

namespace bmu {

namespace {

/// "040 CONTACTOR_COMMAND, 083 COMMAND": identifiers under which another node has sent frames of the master.
void add_foreign_frames(const Catalogue& catalogue, const ReceiveCheck& check, Texts& ids) {
  for (const MessageSpec* message : catalogue.messages()) {
    if (message->sender != Sender::bmu) continue;
    for (std::uint32_t node = message->node_min; node <= message->node_max; ++node) {
      const std::uint32_t id = message->id_of(node);
      if (check.rejected_under(id) > 0) ids.push_back(id_text(id) + " " + text(message->name));
    }
  }
}
std::string foreign_frames(const CoreView& view) {
  constexpr std::size_t shown_max = 5;
  Texts ids;
  const CoreConfig& config = view.core.config();
  add_foreign_frames(view.core.receive_check().catalogue(), view.core.receive_check(), ids);
  if (const ModuleDriver* driver = config.foreign.driver; driver != nullptr) {
    add_foreign_frames(*driver->catalogue, view.core.foreign_check(), ids);
  }
  if (const SensorSetUpDriver* driver = config.sensor.set_up; driver != nullptr) {
    add_foreign_frames(*find_device(driver->name)->catalogue, view.core.receive_check(), ids);
  }
  const std::uint32_t second_id = config.sensor.second_command_id;
  if (second_id != 0 && view.core.receive_check().rejected_under(second_id) > 0) {
    ids.push_back(id_text(second_id) + " to the second current sensor");
  }
  if (ids.size() <= shown_max) return joined(ids);
  const std::string more = " and " + std::to_string(ids.size() - shown_max) + " more";
  ids.resize(shown_max);
  return joined(ids) + more;
}

/// Faults of inputs: those of the PDU come first, the lines of this machine are numbered after them.
struct InputRow {
  FaultId fault;
  std::string_view what;
  GpioInputKind kind;
  unsigned of_unit;
};
constexpr InputRow input_table[] = {
    {FaultId::emergency_stop, "emergency stop", GpioInputKind::estop, 2},
    {FaultId::interlock_open, "interlock", GpioInputKind::interlock, 1},
};

std::string line_text(std::string_view what, GpioInputKind kind, std::size_t index, const CoreView& view) {
  const std::vector<std::string_view> names =
      view.lines != nullptr ? view.lines->lines().names_of(kind) : std::vector<std::string_view>{};
  const std::string name = index < names.size() ? "\"" + text(names[index]) + "\"" : std::to_string(index + 1);
  return text(what) + " " + name + " (GPIO)";
}

std::string input_text(const InputRow& row, unsigned number, const CoreView& view) {
  if (number > row.of_unit) return line_text(row.what, row.kind, number - row.of_unit - 1, view);
  return text(row.what) + (row.of_unit > 1 ? " " + std::to_string(number) : "") + " (PDU)";
}

}  // namespace

std::string span_text(Duration span) {
  return span_text_of_ms(std::max<std::int64_t>(to_ms(span), 0));
}

std::string ago_text(const CoreView& view, TimePoint at) {
  return at == TimePoint{} ? "never" : span_text(view.now - at) + " ago";
}

std::string capitalised(std::string sentence) {
  if (!sentence.empty() && sentence.front() >= 'a' && sentence.front() <= 'z') {
    sentence.front() = static_cast<char>(sentence.front() - 'a' + 'A');
  }
  return sentence;
}

std::string joined(const Texts& texts) {
  std::string all;
  for (const std::string& one : texts) all += (all.empty() ? "" : ", ") + one;
  return all;
}

Json step(std::string_view kind, std::string sentence) {
  return {{"kind", kind}, {"text", std::move(sentence)}};
}

std::string place_text(const FaultRow& row, const Element& element, const CoreView& view) {
  const auto* input = std::find_if(std::begin(input_table), std::end(input_table),
                                   [&row](const InputRow& one) { return one.fault == row.id; });
  if (input == std::end(input_table) || element.input == 0) return element_text(element, row.unit);
  return input_text(*input, element.input, view);
}

Json place_json(const FaultRow& row, const Element& element, const CoreView& view) {
  Json json = element_json(element, row.unit);
  if (!json.is_null()) json["text"] = place_text(row, element, view);
  return json;
}

std::string lines_text(const CoreView& view) {
  if (view.lines == nullptr || view.lines->lines().last_error().empty()) return {};
  return joined(view.lines->lines().names()) + ": " + view.lines->lines().last_error();
}

std::string reading_text(const FaultRow& row, const Reading& reading, const CoreView& view) {
  if (row.id == FaultId::foreign_master) return foreign_frames(view);
  if (row.id == FaultId::lines_failed) return lines_text(view);
  if (row.id == FaultId::charger_runaway) return excess_text(view.core.charger_watch().excess());
  std::string place = place_text(row, reading.element, view);
  if (!row.has_limit()) return place;
  if (!reading.is_known) return "value unknown";
  const std::string value = value_text(row.unit, reading.value);
  return place.empty() ? value : place + ": " + value;
}

Silence silence_of(FaultId fault, const CoreView& view) {
  const AgeConfig& ages = view.core.config().ages;
  const Duration inverter_max = view.core.inverter().patience();
  switch (fault) {
    case FaultId::module_lost: return {.is_one = true, .limit = std::min(ages.cell_voltage, ages.module_status)};
    case FaultId::current_sensor_lost: return {.is_one = true, .limit = ages.pack_current};
    case FaultId::voltage_sensor_lost: return {.is_one = true, .limit = ages.pack_voltage};
    case FaultId::pdu_lost: return {.is_one = true, .limit = ages.pdu_status};
    case FaultId::charger_silent: return {.is_one = true, .limit = view.core.chargers().silence_max()};
    case FaultId::inverter_silent:
    case FaultId::inverter_lost: return {.is_one = true, .limit = inverter_max};
    case FaultId::second_pack_silent: return {.is_one = true, .limit = SecondPack::age_max};
    default: return {};
  }
}

std::string excess_text(const ChargerExcess& excess) {
  if (!excess.is_known()) return {};
  return excess_text(excess.is_voltage ? Unit::mV : Unit::mA, excess.given, excess.asked);
}

std::string confirmed_text(const FaultRow& row, const FaultState& state, const CoreView& view) {
  std::string what = reading_text(row, state.confirmed, view);
  const bool is_over = row.has_limit() && state.stage == FaultStage::latched && !state.is_restored;
  if (is_over && state.confirmed.is_known) what = "last " + what;
  if (is_over && state.latest.is_known) what += ", now " + value_text(row.unit, state.latest.value);
  if (!state.is_restored) return what;
  return (what.empty() ? "" : what + ", ") + "from an earlier session";
}

std::string likely_text(const FaultRow& row, const CoreView& view) {
  return to_text(view.core.likely_cause(row.id, view.now));
}

Texts line_texts(std::string_view what, GpioInputKind kind, unsigned bits, const CoreView& view) {
  Texts texts;
  for (std::size_t i = 0; i < gpio_inputs_max; ++i) {
    if (((bits >> i) & 1U) != 0) texts.push_back(line_text(what, kind, i, view));
  }
  return texts;
}

}  // namespace bmu
