#include "tools/bmudump/identify/dialect.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

#include "tools/bmudump/identify/letters.hpp"

namespace bmu::dump {
namespace {

std::string hex(std::uint32_t id) {
  std::array<char, 16> text{};
  std::snprintf(text.data(), text.size(), "%03Xh", static_cast<unsigned>(id));
  return text.data();
}

}  // namespace

const Dialect* find_dialect(std::span<const Dialect> rows, std::string_view name) {
  const auto found = std::find_if(rows.begin(), rows.end(), [name](const Dialect& row) { return row.name == name; });
  return found == rows.end() ? nullptr : &*found;
}

bool is_pack_name(const CanFrame& frame) {
  const std::string text(frame.data.begin(), frame.data.end());
  return frame.length == text.size() && printable_count(text) == text.size();
}

bool DialectWatch::note_own(const CanFrame& frame) {
  if (frame.is_extended || frame.is_remote || frame.is_error) return false;
  if (frame.id == base_id_) return note_name(frame);
  return frame.id == base_id_ + status_offset && note_status(frame);
}

/// A different name later is from another pack, and is evaluated too.
bool DialectWatch::note_name(const CanFrame& frame) {
  if (!is_pack_name(frame)) return false;
  const std::string name(frame.data.begin(), frame.data.end());
  const auto found = std::find_if(rows_.begin(), rows_.end(), [&name](const Dialect& row) {
    return !row.pack_name.empty() && row.pack_name == name;
  });
  const std::string sign = hex(base_id_) + " says \"" + name + "\"";
  if (sign == sign_) return false;
  sign_ = sign;
  is_told_by_length_ = false;
  if (found == rows_.end()) return false;
  spoken_ = &*found;
  return true;
}

bool DialectWatch::note_status(const CanFrame& frame) {
  if (spoken_ != nullptr) return false;
  const auto has_length = [&frame](const Dialect& row) { return row.status_length == frame.length; };
  if (std::count_if(rows_.begin(), rows_.end(), has_length) != 1) return false;
  spoken_ = &*std::find_if(rows_.begin(), rows_.end(), has_length);
  sign_ = hex(frame.id) + " has " + std::to_string(frame.length) + " bytes";
  is_told_by_length_ = true;
  return true;
}

}  // namespace bmu::dump
