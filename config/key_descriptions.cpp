// Descriptions of all keys from their rows, for the documentation and for the schema.
#include <type_traits>

#include "config/cell_file/cell_dynamics_reader.hpp"
#include "config/cell_file/charge_plateau_reader.hpp"
#include "config/fields/pack_fields.hpp"
#include "protocol/number_text.hpp"

namespace bmu {
namespace {

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

std::vector<KeyDescription> describe_keys() {
  std::vector<KeyDescription> keys;
  describe<PackConfig>("", pack_fields(), keys);
  describe<ModuleEntry>("/modules/*", module_fields(), keys);
  // A module needs a node number: the 0 of a new entry is no default.
  for (KeyDescription& key : keys) {
    if (key.path == "/modules/*/node") key.fallback.clear();
  }
  for (const LimitRow& row : limit_rows()) describe<LimitConfig>("/limits/" + std::string(row.key), row.fields, keys);
  PackConfig fresh;
  visit_sections(fresh, [&keys](const SectionInfo& section, auto fields, const auto&) {
    describe("/" + std::string(section.key), fields, keys);
  });
  describe<StricterReaction>("/faults/*", reaction_fields(), keys);
  describe<PartConfig>("/component_limits/*", part_fields(), keys);
  describe<CurrentBounds>("/component_limits/*", bound_fields(), keys);
  describe<GpioConfig>("/gpio", gpio_fields(), keys);
  describe<GpioLine>("/gpio/outputs/*", gpio_line_fields(), keys);
  describe<GpioLine>("/gpio/feedback/*", gpio_line_fields(), keys);
  describe<GpioFeedback>("/gpio/feedback/*", gpio_feedback_fields(), keys);
  describe<GpioInput>("/gpio/inputs/*", gpio_input_fields(), keys);
  describe<GpioLine>("/gpio/inputs/*", gpio_line_fields(), keys);
  describe<GpioLine>("/gpio/insulation_pulses", gpio_line_fields(), keys);
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
      {"/faults/*", "A fault by its name that does more to this pack than docs/faults.md has it do; never less."},
      {"/component_limits/*", "Something that the whole current flows through; with at least one current."},
      {"/cell",
       "The cell, in its own file or in place; and `ocv`, `derating`, `charge_plateau`, `dynamics`, see above."},
      {"/cell/charge_plateau", "Model of the capacity from a complete charge with constant current; may be left out."},
      {"/cell/dynamics", "What was measured of the cell; and `rows`."},
      {"/cell/dynamics/rows/*", "The cell at one temperature."},
      {"/gpio", "GPIO lines of this host; and `outputs`, `feedback`, `inputs`, `insulation_pulses`."},
      {"/gpio/outputs/*", "The line of an output, see above for their names."},
      {"/gpio/feedback/*", "The auxiliary contact of the output of that name."},
      {"/gpio/inputs/*", "An input of this machine."},
      {"/gpio/insulation_pulses", "The pulse output of an IR155, captured on its line; its OK line is an input."}};
  for (const LimitRow& row : limit_rows()) sections.push_back({"/limits/" + std::string(row.key), row.meaning});
  PackConfig fresh;
  visit_sections(fresh, [&sections](const SectionInfo& section, auto, const auto&) {
    sections.push_back({"/" + std::string(section.key), section.meaning});
  });
  return sections;
}

}  // namespace bmu
