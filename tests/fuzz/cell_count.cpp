// The number of cells that was set over the serial console, stored beside the state file: it is in force only if the
// file is exact to the byte, for this pack file, and the pack file is valid with that many cells; else the pack file's
// own number is in force, and one line is logged. It is written the same again, and a number set afterwards is found at
// the next start.
//
// Input: the file. One that starts with '@' is its content alone, which gets a valid checksum; "@@" and a number is the
// content for this pack. After a line "=== previous" comes the file before it, and after one "=== set" the number that
// is set afterwards.
#include "config/cell_count.hpp"

#include <array>
#include <cstdio>
#include <optional>
#include <string>

#include "config/pack_config.hpp"
#include "daemon/shell/serial/cell_count_setting.hpp"
#include "protocol/fnv.hpp"
#include "protocol/number_text.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/model_disk.hpp"

using namespace bmu;

namespace {

const std::string state_path = "/state/bmud";
const std::string path = state_path + ".cells";
constexpr std::size_t cells_max = 12;  // of a module

std::string hex_of(std::uint64_t number) {
  std::array<char, 20> hex{};
  std::snprintf(hex.data(), hex.size(), "%016llx", static_cast<unsigned long long>(number));
  return hex.data();
}

/// The pack of six cells on one module.
const PackConfig& pack() {
  static const PackConfig config = [] {
    auto loaded = load_pack_config(test::in_source("config/packs/lipo-6s-24v.json"));
    FUZZ_CHECK(loaded.has_value());
    loaded->serial.may_set_cell_count = true;
    return *loaded;
  }();
  return config;
}

std::string sealed(const std::string& content) {
  return content + ", checksum " + hex_of(continue_fnv(fnv_start, content)) + "\n";
}

std::string text_for_this_pack(const std::string& number) {
  return sealed(number + " cells, pack " + hex_of(pack().core.hash));
}

std::string file_of(std::string_view text) {
  if (text.starts_with("@@")) return text_for_this_pack(std::string(text.substr(2)));
  return text.starts_with('@') ? sealed(std::string(text.substr(1))) : std::string(text);
}

/// The number that a valid file contains for this pack.
std::optional<std::size_t> count_in(const std::string& text) {
  static const auto texts = [] {
    std::array<std::string, cells_max + 1> all;
    for (std::size_t count = 1; count <= cells_max; ++count) {
      if (with_cell_count(pack(), count)) all.at(count) = text_for_this_pack(std::to_string(count));
    }
    return all;
  }();
  for (std::size_t count = 1; count <= cells_max; ++count) {
    if (!text.empty() && text == texts.at(count)) return count;
  }
  return std::nullopt;
}

/// Checks that the number is set on a disk with these files, and found at the next start; or refused with one line that
/// gives the reason, without any change. A number that is in force already is not written.
void check_set(std::size_t count, const test::DiskImage& before) {
  test::ModelDisk disk(before);
  CellCountSetting setting(pack(), state_path, disk);
  const std::size_t count_before = cell_count(setting.pack().core);
  const auto set = setting.set(count, true);
  if (!set) FUZZ_CHECK(!set.error().empty() && set.error().find('\n') == std::string::npos);
  const std::string written = text_for_this_pack(std::to_string(count));
  disk.for_each_disk([&](const test::DiskImage& after) {
    FUZZ_CHECK(after == before ? !set || set->is_in_force || before.at(path) == written : after.at(path) == written);
  });
  FUZZ_CHECK(cell_count(CellCountSetting(pack(), state_path, disk).pack().core) == (set ? count : count_before));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto with_set = fuzz::pieces_of(fuzz::text_of(data, size), "=== set\n", 2);
  const auto pieces = fuzz::pieces_of(with_set.empty() ? "" : with_set[0], "=== previous\n", 2);
  test::DiskImage files;
  if (!pieces.empty() && !pieces[0].empty()) files[path] = file_of(pieces[0]);
  if (pieces.size() > 1) files[path + ".previous"] = file_of(pieces[1]);

  test::ModelDisk disk(files);
  const CellCountSetting setting(pack(), state_path, disk);
  const std::size_t own_count = cell_count(pack().core);
  // The previous file counts only if there is no other: it is a number that was withdrawn.
  const auto said = files.empty() ? std::nullopt : count_in(files.begin()->second);
  FUZZ_CHECK(cell_count(setting.pack().core) == said.value_or(own_count));
  FUZZ_CHECK(setting.told().empty() == (files.empty() || said == own_count));
  FUZZ_CHECK(setting.told().find('\n') == std::string::npos);

  // Written the same again, on an empty disk.
  if (said) check_set(*said, {});
  const auto to_set = with_set.size() > 1 ? number_of_text<std::size_t>(with_set[1]) : std::nullopt;
  if (to_set) check_set(*to_set, files);
  return 0;
}
