#include "daemon/shell/serial/cell_count_setting.hpp"

#include <array>
#include <charconv>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <string_view>

#include "config/cell_count.hpp"
#include "protocol/fnv.hpp"

namespace bmu {

namespace {

struct Setting {
  std::size_t cell_count = 0;
  std::uint64_t pack_hash = 0;
};

std::string hex_of(std::uint64_t number) {
  std::array<char, 20> hex{};
  std::snprintf(hex.data(), hex.size(), "%016llx", static_cast<unsigned long long>(number));
  return hex.data();
}

/// "8 cells, pack 0123456789abcdef, checksum 0123456789abcdef"
std::string text_of(const Setting& setting) {
  const std::string content = std::to_string(setting.cell_count) + " cells, pack " + hex_of(setting.pack_hash);
  return content + ", checksum " + hex_of(continue_fnv(fnv_start, content)) + "\n";
}

/// No value unless the text is exactly as text_of() writes it.
std::optional<Setting> setting_from(std::string_view text) {
  constexpr std::string_view before_hash = " cells, pack ";
  Setting setting;
  const char* const end = text.data() + text.size();
  const auto count = std::from_chars(text.data(), end, setting.cell_count);
  const std::string_view rest = text.substr(static_cast<std::size_t>(count.ptr - text.data()));
  if (count.ec != std::errc{} || !rest.starts_with(before_hash)) return std::nullopt;
  const auto hash = std::from_chars(rest.data() + before_hash.size(), end, setting.pack_hash, 16);
  if (hash.ec != std::errc{} || text_of(setting) != text) return std::nullopt;
  return setting;
}

}  // namespace

CellCountSetting::CellCountSetting(const PackConfig& file_pack, const std::string& state_path, FileCalls& calls)
    : file_pack_(file_pack),
      pack_(file_pack),
      file_(state_path + ".cells", calls),
      is_kept_(!state_path.empty()),
      next_count_(bmu::cell_count(file_pack.core)) {
  if (is_kept_ && file_pack_.serial.may_set_cell_count) read();
}

void CellCountSetting::read() {
  std::optional<Setting> setting;
  std::string problems;
  const auto take = [&setting](std::string_view text) -> Result<void, std::string> {
    setting = setting_from(text);
    if (!setting) return failure(std::string("not a valid cell count"));
    return {};
  };
  static_cast<void>(file_.read(take, problems));
  const std::string as_in_file = "; using " + std::to_string(next_count_) + " cells of the pack file";
  // Not the previous file: its number has been replaced by an operator.
  if (!problems.empty()) {
    told_ = "cell count override ignored: " + problems + as_in_file;
    return;
  }
  if (!setting) return;
  if (setting->pack_hash != file_pack_.core.hash) {
    told_ = "cell count override " + std::to_string(setting->cell_count) + " belongs to another pack file" + as_in_file;
    return;
  }
  const auto pack = with_cell_count(file_pack_, setting->cell_count);
  if (!pack) {
    told_ = "cell count override ignored: " + to_text(pack.error().front()) + as_in_file;
    return;
  }
  if (setting->cell_count == next_count_) return;
  told_ = "cell count override: " + std::to_string(setting->cell_count) + " cells (serial console), pack file " +
          std::to_string(next_count_);
  pack_ = *pack;
  next_count_ = setting->cell_count;
}

Result<CellCountSet, std::string> CellCountSetting::set(std::size_t cell_count, bool is_open) {
  const std::string cells = std::to_string(cell_count) + " cells";
  if (!file_pack_.serial.may_set_cell_count) {
    return failure(std::string("not allowed by the pack file (serial/may_set_cell_count)"));
  }
  if (!is_open) return failure(std::string("contactors not open, or close request active"));
  const CellCountSet done{.is_in_force = cell_count == bmu::cell_count(pack_.core)};
  if (cell_count == next_count_) return done;
  if (const std::size_t modules = file_pack_.core.modules.size(); modules != 1) {
    return failure("not available for a pack with " + std::to_string(modules) + " modules");
  }
  if (!is_kept_) return failure(std::string("no state file to store it with (bmud --state)"));
  const auto pack = with_cell_count(file_pack_, cell_count);
  if (!pack) return failure("invalid with " + cells + ": " + to_text(pack.error().front()));
  const auto written = file_.write(text_of({.cell_count = cell_count, .pack_hash = file_pack_.core.hash}));
  if (!written) return failure("not stored: " + to_text(written.error()));
  next_count_ = cell_count;
  return done;
}

}  // namespace bmu
