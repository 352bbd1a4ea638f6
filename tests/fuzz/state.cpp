// The state file: a state that is read is written, read again and written the same; a core that restores it closes
// nothing. Also the combinations of files that a loss of power leaves: the best of them is read, and one that is
// written afterwards is found next.
//
// Input: a state file. One that starts with '@' is its content alone, which gets a valid checksum. After lines "===
// previous" and "=== new" come the other two files.
#include <array>
#include <cstdio>

#include <nlohmann/json.hpp>

#include "config/pack_config.hpp"
#include "daemon/core/core.hpp"
#include "daemon/shell/state/state_file.hpp"
#include "daemon/shell/state/state_text.hpp"
#include "protocol/fnv.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/model_disk.hpp"

using namespace bmu;

namespace {

using Json = nlohmann::ordered_json;

/// Empty if the content is no JSON.
std::string sealed(std::string_view content) {
  const Json json = Json::parse(content, nullptr, false);
  if (json.is_discarded()) return {};
  const std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  std::array<char, 20> hex{};
  std::snprintf(hex.data(), hex.size(), "%016llx", static_cast<unsigned long long>(continue_fnv(fnv_start, text)));
  return R"({"format":1,"checksum":")" + std::string(hex.data()) + R"(","content":)" + text + "}\n";
}

std::string file_of(std::string_view text) {
  return text.starts_with('@') ? sealed(text.substr(1)) : std::string(text);
}

const CoreConfig& pack() {
  static const CoreConfig config = [] {
    const auto loaded = load_pack_config(test::in_source("config/packs/lipo-6s-24v.json"));
    FUZZ_CHECK(loaded.has_value());
    return loaded->core;
  }();
  return config;
}

void check_restored(const PersistentState& state) {
  const auto core = std::make_unique<Core>(pack(), TimePoint{1s});
  core->restore(state);
  TimePoint now{1s};
  for (int tick = 0; tick < 5; ++tick) {
    const Decisions decisions = core->decide(now);
    FUZZ_CHECK(!decisions.outputs.any_contactor() && !core->permission().may_close);
    for (const Event& event : decisions.events) FUZZ_CHECK(!to_text(event).empty());
    now = decisions.wake_at;
  }
  // The persistent state of that core can be read again, too.
  FUZZ_CHECK(parse_state(state_text(core->persistent())).has_value());
}

void check_text(std::string_view text) {
  const auto read = parse_state(text);
  if (!read) {
    FUZZ_CHECK(!read.error().empty());
    return;
  }
  const std::string written = state_text(read->state);
  const auto again = parse_state(written);
  FUZZ_CHECK(again && again->charges_problem.empty() && again->soc_problem.empty() && again->unknown_names == 0);
  FUZZ_CHECK(state_text(again->state) == written);
  check_restored(read->state);
}

StateFile::Take taking(std::string& to) {
  return [&to](std::string_view text) -> Result<void, std::string> {
    const auto read = parse_state(text);
    if (!read) return failure(read.error());
    to = text;
    return {};
  };
}

void check_files(const test::DiskImage& files) {
  test::ModelDisk disk(files);
  StateFile file("/state/bmud", disk);
  std::string taken;
  std::string problems;
  const FileFound found = file.read(taking(taken), problems);
  const auto is_good = [&](const char* name) {
    return files.contains(name) && parse_state(files.at(name)).has_value();
  };
  const bool is_newest = is_good("/state/bmud");
  const bool is_previous = !is_newest && is_good("/state/bmud.previous");
  FUZZ_CHECK((found == FileFound::newest) == is_newest && (found == FileFound::previous) == is_previous);
  FUZZ_CHECK(taken.empty() != (is_newest || is_previous));

  const std::string fresh = state_text({});
  FUZZ_CHECK(file.write(fresh).has_value());
  StateFile reader("/state/bmud", disk);
  std::string taken_then;
  FUZZ_CHECK(reader.read(taking(taken_then), problems) == FileFound::newest && taken_then == fresh);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto with_new = fuzz::pieces_of(fuzz::text_of(data, size), "=== new\n", 2);
  const auto with_previous = fuzz::pieces_of(with_new.empty() ? "" : with_new[0], "=== previous\n", 2);
  test::DiskImage files;
  if (!with_previous.empty() && !with_previous[0].empty()) files["/state/bmud"] = file_of(with_previous[0]);
  if (with_previous.size() > 1) files["/state/bmud.previous"] = file_of(with_previous[1]);
  if (with_new.size() > 1) files["/state/bmud.new"] = file_of(with_new[1]);
  for (const auto& [name, text] : files) check_text(text);
  check_files(files);
  return 0;
}
