#include "daemon/recording/record_writer.hpp"

#include <array>
#include <cstdio>
#include <filesystem>
#include <vector>

#include "daemon/core/core_image.hpp"
#include "daemon/recording/image_lines.hpp"

namespace bmu {

namespace {

/// Maximum text of a line, beside its word: with "# pack-file | " and the line feed it stays below record_line_max.
constexpr std::size_t piece_max = 360;

std::string hex16(std::uint64_t value) {
  std::array<char, 17> text{};
  std::snprintf(text.data(), text.size(), "%016llx", static_cast<unsigned long long>(value));
  return text.data();
}

std::string hex8(std::uint32_t value) {
  std::array<char, 9> text{};
  std::snprintf(text.data(), text.size(), "%08x", value);
  return text.data();
}

std::string file_name(const std::string& path) {
  return std::filesystem::path(path).filename().string();
}

/// `head_from`: start of the head; its lines up to here have a checksum of their own.
void append_image(const Core& core, std::size_t head_from, std::string& to) {
  std::vector<std::uint8_t> bytes(core_image_size(core));
  write_core_image(core, bytes);
  to += "# core " + hex16(core_image_layout()) + " " + std::to_string(bytes.size()) + "\n";
  LineSum head_sum;
  head_sum.add_lines(std::string_view(to).substr(head_from));
  append_image_lines(bytes, to);
  to += "# core-end " + hex16(image_checksum(bytes)) + " " + hex8(head_sum.value()) + "\n";
}

}  // namespace

void append_record_text(std::string_view word, std::string_view text, std::string& to) {
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    const std::size_t size = std::min(end - at, piece_max);
    const bool ends_line = at + size == end && end < text.size();
    to.append("# ").append(word).append(ends_line ? " | " : " + ").append(text.substr(at, size)).append("\n");
    at += size + (ends_line ? 1 : 0);
  }
}

/// The buses that have a name.
std::string bus_lines(const RecordBuses& buses) {
  std::string lines;
  for (const Port port : all_ports) {
    if (!buses.name(port).empty())
      lines.append("# bus ").append(to_text(port)).append(" ").append(buses.name(port)).append("\n");
  }
  return lines;
}

void append_record_head(const RecordHead& head, const Core& core, const RecordClock& clock, std::string& to) {
  const std::size_t head_from = to.size();
  to += "# bmud-recording " + std::to_string(record_format) + "\n# version " + head.version + "\n" +
        bus_lines(head.buses) + "# ahead_us " + std::to_string(clock.ahead_us) + "\n# configuration " +
        hex16(head.hash) + "\n# pack-file " + file_name(head.sources.pack_name) + "\n";
  if (head.internal_kbit_per_s != 0) to += "# internal_kbit_per_s " + std::to_string(head.internal_kbit_per_s) + "\n";
  if (head.life != 0) to += "# part " + std::to_string(head.life) + " " + std::to_string(head.part) + "\n";
  append_record_text("pack", head.sources.pack_text, to);
  if (!head.sources.cell_name.empty()) {
    to += "# cell-file " + file_name(head.sources.cell_name) + "\n";
    append_record_text("cell", head.sources.cell_text, to);
  }
  append_image(core, head_from, to);
}

void RecordWriter::begin(const Core& core, TimePoint now, std::int64_t unix_time_us, bool continues) {
  head_.life = head_.life == 0 ? unix_time_us : head_.life;
  head_.part += continues ? 1 : 2;
  lines_.begin(now, unix_time_us, core.outputs());
  append_record_head(head_, core, lines_.clock(), text_);
}

void RecordWriter::set_wall_clock(TimePoint now, std::int64_t unix_time_us) {
  lines_.set_wall_clock(now, unix_time_us, text_);
}

void RecordWriter::observed(const Observation& observation) {
  lines_.observed(observation, text_);
}

void RecordWriter::decided(TimePoint at, const Decisions& decisions) {
  lines_.decided(at, decisions, text_);
}

}  // namespace bmu
