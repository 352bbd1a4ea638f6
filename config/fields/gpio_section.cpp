#include "config/fields/gpio_section.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "config/fields/pack_fields.hpp"
#include "daemon/core/types/contactor_id.hpp"

namespace bmu {
namespace {

template <class... Targets>
[[nodiscard]] std::vector<std::string_view> all_keys(std::span<const Field<Targets>>... fields) {
  std::vector<std::string_view> keys;
  const auto add = [&keys](const std::vector<std::string_view>& more) {
    keys.insert(keys.end(), more.begin(), more.end());
  };
  (add(keys_of(fields)), ...);
  return keys;
}

/// Reads the lines in order, and tracks which element uses which.
class GpioReader {
 public:
  GpioReader(GpioConfig& gpio, Place place, ProblemList& problems)
      : gpio_(gpio), place_(std::move(place)), problems_(problems) {}

  void read(const JsonValue& object) {
    std::vector<std::string_view> keys = keys_of(gpio_fields());
    keys.insert(keys.end(), {"outputs", "feedback", "inputs", "insulation_pulses"});
    check_keys(object, place_, keys, problems_);
    read_fields(object, place_, gpio_fields(), gpio_, problems_);
    read_named(object, "outputs", gpio_.outputs);
    read_named(object, "feedback", gpio_.feedback);
    read_inputs(object);
    read_insulation_pulses(object);
  }

  void check() {
    check_contactors();
    check_watchdog();
    check_feedback();
    check_debounce_times();
    check_not_empty();
  }

 private:
  void take(const GpioLine& line, const JsonValue& object, const Place& place) {
    const Place key = place.at("line");
    if (!object.contains("line") || !problems_.is_good(key)) return;
    const auto [owner, is_free] = owner_of_line_.emplace(line.line, place.path);
    if (is_free) return;
    problems_.add(key, std::to_string(line.line), "a line nothing else is on; it is taken by " + owner->second);
  }

  void read_line(const JsonValue& object, const Place& place, GpioLine& line) {
    check_keys(object, place, keys_of(gpio_line_fields()), problems_);
    read_fields(object, place, gpio_line_fields(), line, problems_);
    take(line, object, place);
  }
  void read_line(const JsonValue& object, const Place& place, GpioFeedback& feedback) {
    check_keys(object, place, all_keys(gpio_line_fields(), gpio_feedback_fields()), problems_);
    read_fields(object, place, gpio_line_fields(), feedback.at, problems_);
    read_fields(object, place, gpio_feedback_fields(), feedback, problems_);
    take(feedback.at, object, place);
  }
  void read_line(const JsonValue& object, const Place& place, GpioInput& input) {
    check_keys(object, place, all_keys(gpio_input_fields(), gpio_line_fields()), problems_);
    read_fields(object, place, gpio_input_fields(), input, problems_);
    read_fields(object, place, gpio_line_fields(), input.at, problems_);
    take(input.at, object, place);
  }

  /// Reads an object with a line for some of the outputs.
  template <class Line, std::size_t Count>
  void read_named(const JsonValue& parent, std::string_view key, std::array<std::optional<Line>, Count>& lines) {
    const JsonValue* object = find_value(parent, place_, key, false, problems_);
    const Place place = place_.at(key);
    if (object == nullptr || !is_object(*object, place, problems_)) return;
    const auto* names = gpio_output_names.data();
    check_keys(*object, place, {names, names + Count}, problems_);
    for (std::size_t i = 0; i < Count; ++i) {
      const std::string_view name = gpio_output_names.at(i);
      const JsonValue* value = find_value(*object, place, name, false, problems_);
      if (value == nullptr) continue;
      lines.at(i).emplace();  // present, even if wrong
      if (is_object(*value, place.at(name), problems_)) read_line(*value, place.at(name), *lines.at(i));
    }
  }

  void read_inputs(const JsonValue& parent) {
    const JsonValue* list = find_value(parent, place_, "inputs", false, problems_);
    if (list == nullptr) return;
    const Place place = place_.at("inputs");
    if (!list->is_array() || list->size() > gpio_inputs_max) {
      const std::string found = list->is_array() ? std::to_string(list->size()) + " inputs" : shown(*list);
      problems_.add(place, found, "a list of at most " + std::to_string(gpio_inputs_max) + " inputs, [{ ... }]");
      return;
    }
    for (std::size_t index = 0; index < list->size(); ++index) read_input((*list)[index], place.at(index));
  }

  void read_input(const JsonValue& value, const Place& place) {
    if (!is_object(value, place, problems_)) return;
    GpioInput input;
    read_line(value, place, input);
    if (!input.name.empty()) {
      const auto [owner, is_free] = owner_of_name_.emplace(input.name, place.path);
      if (!is_free) {
        problems_.add(place.at("name"), in_quotes(input.name),
                      "a name no other input has; it is taken by " + owner->second);
      }
    }
    gpio_.inputs.push_back(std::move(input));
  }

  void read_insulation_pulses(const JsonValue& parent) {
    const JsonValue* object = find_value(parent, place_, "insulation_pulses", false, problems_);
    if (object == nullptr) return;
    const Place place = place_.at("insulation_pulses");
    GpioLine& line = gpio_.insulation_pulses.emplace();  // present, even if wrong
    if (is_object(*object, place, problems_)) read_line(*object, place, line);
  }

  [[nodiscard]] bool has(GpioOutput output) const {
    return gpio_.outputs.at(static_cast<std::size_t>(output)).has_value();
  }
  [[nodiscard]] Place output_place(GpioOutput output) const { return place_.at("outputs").at(to_text(output)); }

  /// The sequence switches these three together: a file with only some of them on lines is a mistake.
  void check_contactors() {
    constexpr std::array together{GpioOutput::main_positive, GpioOutput::main_negative, GpioOutput::precharge};
    const auto is_there = [this](GpioOutput output) { return has(output); };
    if (std::none_of(together.begin(), together.end(), is_there)) return;
    for (const GpioOutput output : together) {
      if (has(output)) continue;
      problems_.add(output_place(output), "nothing",
                    "a line: main_positive, main_negative and precharge are all there, or none of them");
    }
  }

  void check_watchdog() {
    constexpr std::array contactors{GpioOutput::main_positive, GpioOutput::main_negative, GpioOutput::precharge,
                                    GpioOutput::charge};
    const auto* contactor =
        std::find_if(contactors.begin(), contactors.end(), [this](auto output) { return has(output); });
    if (contactor == contactors.end() || has(GpioOutput::watchdog)) return;
    problems_.add(output_place(GpioOutput::watchdog), "nothing",
                  "a line, as " + std::string(to_text(*contactor)) +
                      " has one: a level outlives the program, and only a watchdog that stands still lets it go");
  }

  void check_feedback() {
    for (std::size_t i = 0; i < gpio_feedback_count; ++i) {
      if (!gpio_.feedback.at(i) || gpio_.outputs.at(i)) continue;
      const std::string name(gpio_output_names.at(i));
      problems_.add(place_.at("feedback").at(name), "a feedback",
                    "none, or a line for the output it is of, " + output_place(static_cast<GpioOutput>(i)).path);
    }
  }

  void check_debounce_times() {
    std::set<Duration> times;
    for (const auto& feedback : gpio_.feedback) {
      if (feedback && feedback->debounce > 0ns) times.insert(feedback->debounce);
    }
    for (const GpioInput& input : gpio_.inputs) {
      if (input.debounce > 0ns) times.insert(input.debounce);
    }
    if (times.size() <= gpio_debounce_times_max) return;
    problems_.add(
        place_, std::to_string(times.size()) + " different debounce_ms",
        "at most " + std::to_string(gpio_debounce_times_max) + ", as one request to the kernel takes no more");
  }

  void check_not_empty() {
    const bool has_output = std::any_of(gpio_.outputs.begin(), gpio_.outputs.end(), [](const auto& o) { return !!o; });
    const bool has_input = !gpio_.inputs.empty() || gpio_.insulation_pulses;
    if (has_output || has_input || !problems_.is_good_throughout(place_)) return;
    problems_.add(place_, "no line at all", "outputs or inputs or insulation_pulses, or no section \"gpio\"");
  }

  GpioConfig& gpio_;
  Place place_;
  ProblemList& problems_;
  std::map<std::uint32_t, std::string> owner_of_line_;
  std::map<std::string, std::string> owner_of_name_;
};

/// The properties of the lines that the core needs.
LinesConfig lines_config(const GpioConfig& gpio) {
  const auto has_input = [&](GpioInputKind kind) {
    return std::any_of(gpio.inputs.begin(), gpio.inputs.end(),
                       [kind](const auto& input) { return input.kind == kind; });
  };
  LinesConfig lines{
      .are_used = true,
      .drive_contactors = gpio.outputs.at(static_cast<std::size_t>(GpioOutput::main_positive)).has_value(),
      .has_vehicle_on = has_input(GpioInputKind::vehicle_on),
      .has_charger_connected = has_input(GpioInputKind::charger_connected),
      .has_resume_button = has_input(GpioInputKind::resume_button),
      .has_insulation_ok = has_input(GpioInputKind::insulation_ok),
      .has_supply_ok = has_input(GpioInputKind::supply_ok)};
  // The contactors are the first outputs, in the order of ContactorId.
  for (std::size_t i = 0; i < contactor_id_count; ++i) {
    if (gpio.feedback.at(i)) lines.feedback |= static_cast<std::uint8_t>(1U << i);
  }
  return lines;
}

}  // namespace

void read_gpio(const JsonValue& root, const Place& root_place, PackConfig& pack, ProblemList& problems) {
  const Place place = root_place.at("gpio");
  const JsonValue* object = find_section(root, root_place, "gpio", problems);
  if (object == nullptr) return;
  GpioReader reader(pack.gpio.emplace(), place, problems);
  reader.read(*object);
  reader.check();
  pack.core.lines = lines_config(*pack.gpio);
  pack.core.insulation.has_pulse_line = pack.gpio->insulation_pulses.has_value();
}

}  // namespace bmu
