// Plays every *.scenario beside this file: the real core against the emulated pack, in virtual time.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "config/pack_config.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/sim_run.hpp"

using namespace bmu;
using bmu::test::SimRun;

namespace {

std::string trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return "";
  return std::string(text.substr(first, text.find_last_not_of(" \t") - first + 1));
}

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, separator);) parts.push_back(trimmed(part));
  return parts;
}

const FaultRow* find_fault(const std::string& name) {
  for (const FaultRow& row : fault_table()) {
    if (row.name == name) return &row;
  }
  return nullptr;
}

bool any_opening_fault(const Core& core) {
  return std::any_of(fault_table().begin(), fault_table().end(), [&](const FaultRow& row) {
    return row.reaction != Reaction::warn && core.faults().state(row.id).is_present();
  });
}

std::string where(const Element& element) {
  return std::to_string(element.module_node) + (element.number == 0 ? "" : "." + std::to_string(element.number));
}

/// Empty if it is true, else the state that was found.
std::string check_fault(const Core& core, const std::vector<std::string>& words) {
  const FaultRow* row = words.size() >= 2 ? find_fault(words[1]) : nullptr;
  if (row == nullptr) return "no such fault";
  const FaultState& state = core.faults().state(row->id);
  if (words[0] == "warning") return state.is_warning ? "" : "no warning";
  if (!state.is_present()) return "stage " + std::string(to_text(state.stage));
  const std::string found = where(state.confirmed.element);
  return words.size() < 3 || words[2] == found ? "" : "at " + found;
}

std::string check_opening(const Core& core, const std::string& wanted) {
  const OpeningRecord& last = core.last_opening();
  const std::string found =
      last.cause == OpeningCause::fault ? std::string(row_of(last.fault).name) : std::string(to_text(last.cause));
  return found == wanted ? "" : "opened by " + found;
}

std::string check_range(std::int64_t found, const std::string& wanted) {
  const auto dots = wanted.find("..");
  const std::int64_t low = std::stoll(wanted);
  const std::int64_t high = dots == std::string::npos ? low : std::stoll(wanted.substr(dots + 2));
  return found >= low && found <= high ? "" : std::to_string(found);
}

std::string check(const SimRun& run, const std::string& expectation) {
  const Core& core = run.core();
  const std::vector<std::string> words = split(expectation, ' ');
  const auto starts = [&](std::string_view with) { return expectation.starts_with(with); };
  if (starts("phase ")) {
    const std::string found(to_text(core.sequence().phase));
    return found == expectation.substr(6) ? "" : "phase " + found;
  }
  if (expectation == "no fault") return any_opening_fault(core) ? "fault confirmed" : "";
  if (starts("fault ") || starts("warning ")) return check_fault(core, words);
  if (starts("opened by ")) return check_opening(core, expectation.substr(10));
  if (starts("discharge limit ")) return check_range(core.limits().discharge.limit_mA / 1000, words[2]);
  if (starts("charge limit ")) return check_range(core.limits().charge.limit_mA / 1000, words[2]);
  if (starts("soc "))
    return core.estimate().pack().is_known ? check_range(core.estimate().told_permille(), words[1]) : "not known";
  if (starts("contacts ")) {
    const PduState& pdu = core.sensors().pdu.value;
    const bool closed = pdu.main_positive_closed && pdu.main_negative_closed;
    const bool open = !pdu.any_contactor_closed();
    return (words[1] == "closed" ? closed : open) ? "" : "the other way round";
  }
  return "expectation not understood";
}

void do_event(SimRun& run, const std::string& event) {
  if (event.empty() || event == "-") return;
  if (event == "clear") return run.give(Command::clear_faults);
  if (event == "shut down") return run.give(Command::shut_down);
  run.apply(event);
}

void play(const std::filesystem::path& file) {
  std::ifstream stream(file);
  REQUIRE(stream.good());
  std::optional<SimRun> run;
  int line_number = 0;
  std::size_t steps = 0;
  for (std::string line; std::getline(stream, line);) {
    ++line_number;
    line = trimmed(line);
    if (line.empty() || line[0] == '#') continue;
    if (line.starts_with("pack ")) {
      const auto pack = load_pack_config(test::in_source("config/packs/") + line.substr(5));
      REQUIRE(pack.has_value());
      run.emplace(pack->core);
      continue;
    }
    const std::vector<std::string> columns = split(line + " ", '|');
    REQUIRE(run.has_value());
    REQUIRE(columns.size() == 3);
    run->run_to(std::stod(columns[0]));
    for (const std::string& expectation : split(columns[2], ',')) {
      if (expectation.empty()) continue;
      const std::string found_instead = check(*run, expectation);
      INFO(file.filename().string() << ":" << line_number << ": at " << columns[0] << " s wanted: " << expectation
                                    << ", found: " << found_instead);
      CHECK(found_instead.empty());
    }
    do_event(*run, columns[1]);
    ++steps;
  }
  CHECK(steps > 1);
}

}  // namespace

TEST_CASE("every scenario file holds", "[scenario]") {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(test::in_source("tests/scenario"))) {
    if (entry.path().extension() == ".scenario") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  REQUIRE(files.size() >= 5);
  for (const auto& file : files) {
    DYNAMIC_SECTION(file.stem().string()) {
      play(file);
    }
  }
}

TEST_CASE("the demonstration does what it says it does", "[scenario][demo]") {
  std::ifstream stream(test::in_source("vcan-fixtures/demo.scn"));
  std::stringstream text;
  text << stream.rdbuf();
  auto scenario = parse_scenario(text.str());
  REQUIRE(scenario.has_value());
  const auto pack = load_pack_config(test::in_source("config/packs/demo-48s.json"));
  REQUIRE(pack.has_value());
  SimRun run(pack->core, *scenario);
  run.run_to(11.5);
  CHECK(run.core().sequence().phase == Phase::closed);
  CHECK(run.core().last_precharge().was_successful);
  CHECK(run.core().last_precharge().took > 300ms);
  CHECK(run.core().estimate().pack().is_known);
  run.run_to(20);
  CHECK(run.core().sequence().phase == Phase::open);
  const OpeningRecord& opening = run.core().last_opening();
  CHECK(opening.cause == OpeningCause::fault);
  CHECK(opening.fault == FaultId::cell_undervoltage);
  CHECK(opening.reading.element == Element{2, 7, 19});
  CHECK(opening.reading.value <= opening.threshold);
}
