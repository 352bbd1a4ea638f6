#include "daemon/recording/record_writer.hpp"

#include <array>
#include <cstdio>
#include <filesystem>
#include <vector>

#include "daemon/core/core_image.hpp"
#include "daemon/recording/base64.hpp"
#include "protocol/fnv.hpp"

namespace bmu {

namespace {

/// Of a line, beside its word: with "# pack-file | " and the line feed it stays below record_line_max.
constexpr std::size_t piece_max = 360;
/// Whole groups of three, so that each line is base64 of its own.
constexpr std::size_t image_bytes_per_line = 270;

std::string hex16(std::uint64_t value) {
  std::array<char, 17> text{};
  std::snprintf(text.data(), text.size(), "%016llx", static_cast<unsigned long long>(value));
  return text.data();
}

std::string file_name(const std::string& path) {
  return std::filesystem::path(path).filename().string();
}

}  // namespace

void RecordWriter::begin(const Core& core, TimePoint now, std::int64_t unix_time_us) {
  clock_.ahead_us = unix_time_us - RecordClock{}.to_log_us(now);
  outputs_ = core.outputs();
  text_ += "# bmud-recording " + std::to_string(record_format) + "\n# version " + head_.version + "\n# bus internal " +
           head_.buses.internal + "\n# bus vehicle " + head_.buses.vehicle + "\n# ahead_us " +
           std::to_string(clock_.ahead_us) + "\n# configuration " + hex16(head_.hash) + "\n# pack-file " +
           file_name(head_.sources.pack_name) + "\n";
  add_text("pack", head_.sources.pack_text);
  if (!head_.sources.cell_name.empty()) {
    text_ += "# cell-file " + file_name(head_.sources.cell_name) + "\n";
    add_text("cell", head_.sources.cell_text);
  }
  add_image(core);
}

void RecordWriter::add_text(std::string_view word, std::string_view text) {
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    const std::size_t size = std::min(end - at, piece_max);
    const bool ends_line = at + size == end && end < text.size();
    text_.append("# ").append(word).append(ends_line ? " | " : " + ").append(text.substr(at, size)).append("\n");
    at += size + (ends_line ? 1 : 0);
  }
}

void RecordWriter::add_image(const Core& core) {
  std::vector<std::uint8_t> bytes(core_image_size(core));
  write_core_image(core, bytes);
  text_ += "# core " + hex16(core_image_layout()) + " " + std::to_string(bytes.size()) + "\n";
  const std::span<const std::uint8_t> all(bytes);
  for (std::size_t at = 0; at < all.size(); at += image_bytes_per_line) {
    text_ += "# image " + to_base64(all.subspan(at, std::min(image_bytes_per_line, all.size() - at))) + "\n";
  }
  const std::string_view as_text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  text_ += "# core-end " + hex16(continue_fnv(fnv_start, as_text)) + "\n";
}

void RecordWriter::set_wall_clock(TimePoint now, std::int64_t unix_time_us) {
  clock_.ahead_us = unix_time_us - RecordClock{}.to_log_us(now);
  text_ += "# ahead_us " + std::to_string(clock_.ahead_us) + "\n";
}

void RecordWriter::observed(const Observation& observation) {
  std::array<char, record_line_max> line{};
  text_.append(line.data(), print_observation(observation, clock_, head_.buses, line));
}

void RecordWriter::decided(TimePoint at, const Decisions& decisions) {
  append_decisions(text_, at, decisions, outputs_, clock_, head_.buses);
  outputs_ = decisions.outputs;
}

}  // namespace bmu
