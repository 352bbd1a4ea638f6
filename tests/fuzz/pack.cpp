// Pack files: every problem has an existing location; an accepted pack keeps to the ranges of its keys, is the same
// when it is read again, and a core with it decides without permitting any closing before it has received data of the
// pack.
//
// Input: a pack file, and after a line "=== cell" the file of its cell.
#include <cmath>

#include "config/cell_count.hpp"
#include "config/fields/pack_fields.hpp"
#include "config/pack_config.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tools/common/virtual_run.hpp"

using namespace bmu;

namespace {

constexpr std::string_view cell_begins = "=== cell\n";

PackSources sources_of(std::string_view text) {
  const auto parts = fuzz::pieces_of(text, cell_begins, 2);
  PackSources sources{.pack_name = "pack.json"};
  if (!parts.empty()) sources.pack_text = parts[0];
  if (parts.size() > 1) sources.cell_name = "cell.json";
  if (parts.size() > 1) sources.cell_text = parts[1];
  return sources;
}

void check_problem(const ConfigProblem& problem, const PackSources& sources) {
  FUZZ_CHECK(!problem.found.empty() && !problem.wanted.empty());
  FUZZ_CHECK(to_text(problem).find('\n') == std::string::npos);
  if (!problem.at) return;
  const bool is_pack = problem.file == sources.pack_name;
  const auto lines = fuzz::lines_of(is_pack ? sources.pack_text : sources.cell_text);
  // The end of a text is after its last line feed.
  FUZZ_CHECK(problem.at->line >= 1 && problem.at->line <= lines.size() + 1);
  const std::size_t length = problem.at->line <= lines.size() ? lines[problem.at->line - 1].size() : 0;
  FUZZ_CHECK(problem.at->column >= 1 && problem.at->column <= length + 1);
}

template <class Target>
void check_fields(std::span<const Field<Target>> fields, const Target& target) {
  for (const Field<Target>& field : fields) {
    if (field.read == nullptr) continue;  // for editors, e.g. "$schema"
    const FieldValue value = field.read(target);
    if (value == field.read(Target{})) continue;  // omitted
    if (const auto* const number = std::get_if<double>(&value)) {
      const double rounding = field.info.type == FieldType::integer ? 0.0 : 1e-6 * std::abs(*number) + 0.5;
      FUZZ_CHECK(*number >= field.info.min - rounding && *number <= field.info.max + rounding);
    }
    if (const auto* const text = std::get_if<std::string>(&value)) {
      FUZZ_CHECK(static_cast<double>(text->size()) <= field.info.max);
    }
  }
}

void check_bounds(PackConfig pack) {
  check_fields(pack_fields(), pack);
  visit_sections(pack, [](const SectionInfo& section, auto fields, const auto& target) {
    // Omitted poll periods and the like are derived from others (pack_defaults.hpp).
    if (section.key != "poll") check_fields(fields, target);
  });
  FUZZ_CHECK(!pack.core.modules.empty());
  for (const ModuleConfig& module : pack.core.modules) {
    FUZZ_CHECK(module.node >= 1 && module.node <= node_max && module.cell_count >= 1);
    FUZZ_CHECK(module.cell_count <= internal_bus::cells_per_module_max);
  }
}

/// The core has no observation except that the buses are up.
void check_core(const PackConfig& pack) {
  const auto core = std::make_unique<Core>(pack.core, TimePoint{1s});
  for (const Port port : {Port::internal, Port::vehicle}) {
    static_cast<void>(core->observe({.at = TimePoint{1s}, .what = PortChanged{port, true}}));
  }
  TimePoint now{1s};
  for (int tick = 0; tick < 12; ++tick) {
    const Decisions decisions = core->decide(now);
    FUZZ_CHECK(!decisions.outputs.any_contactor() && !core->permission().may_close);
    FUZZ_CHECK(decisions.wake_at > now && decisions.wake_at <= now + 1s);
    now = decisions.wake_at;
  }
}

/// The emulated pack is the same for all possible packs.
void check_simulator(const PackConfig& pack) {
  VirtualRun run(pack.core, simulator_config(pack.core), {});
  while (run.elapsed() < 60ms) run.step();
  FUZZ_CHECK(!run.core().outputs().any_contactor());
}

void check_pack(const PackConfig& pack) {
  check_bounds(pack);
  const auto again = parse_pack_config(pack.sources);
  FUZZ_CHECK(again && again->core.hash == pack.core.hash && again->sources == pack.sources);
  check_core(pack);
  check_simulator(pack);
  const auto other = with_cell_count(pack, pack.core.modules[0].cell_count);
  if (other) check_bounds(*other);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const PackSources sources = sources_of(fuzz::text_of(data, size));
  const auto pack = parse_pack_config(sources);
  if (pack) {
    check_pack(*pack);
    return 0;
  }
  FUZZ_CHECK(!pack.error().empty());
  for (const ConfigProblem& problem : pack.error()) check_problem(problem, sources);
  return 0;
}
