// Lines of a candump log and of its screen: an accepted line is written again and read as the same, a rejected one is
// reported with a position within the line.
//
// Input: lines.
#include <array>

#include "protocol/candump_screen.hpp"
#include "tests/fuzz/fuzz.hpp"

using namespace bmu;

namespace {

void check_long_frame(const LogLine& line) {
  std::array<std::uint8_t, xl_bytes_max> bytes{};
  const LongFrame frame = long_frame_of(line);
  const std::size_t count = unpack(frame, bytes);
  FUZZ_CHECK(count <= (frame.is_xl ? xl_bytes_max : fd_bytes_max));
}

void check_line(const LogLine& line) {
  FUZZ_CHECK(line.time_us >= 0 && !line.bus.empty() && line.bus.size() <= bus_name_length_max);
  FUZZ_CHECK(line.frame.length <= 8 && line.frame.id <= 0x1FFF'FFFF);
  static std::array<char, long_log_line_length_max> room;
  const std::size_t length = print_log_line(line, room);
  FUZZ_CHECK(length <= log_line_length_max + line.long_frame.size());
  const auto again = parse_log_line({room.data(), length});
  FUZZ_CHECK(again && again->kind == line.kind && again->direction == line.direction);
  FUZZ_CHECK(again->length_code == line.length_code && again->time_us == line.time_us && again->bus == line.bus);
  FUZZ_CHECK(again->frame == line.frame && again->long_frame == line.long_frame);
  if (line.kind == LogLineKind::fd_frame) check_long_frame(line);
}

void check_damage(const LogLineDamage& damage, std::string_view line) {
  FUZZ_CHECK(damage.column <= line.size() && to_text(damage.wanted) != "?");
}

/// A line of a log is also valid on a screen.
void check_screen_line(std::string_view line) {
  static ScreenRoom room;
  const auto parsed = parse_screen_line(line, room);
  if (!parsed) return check_damage(parsed.error(), line);
  FUZZ_CHECK(parsed->line.kind != LogLineKind::nothing);
  check_line(parsed->line);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  for (const std::string_view line : fuzz::lines_of(fuzz::text_of(data, size))) {
    const auto parsed = parse_log_line(line);
    const auto lost = parse_lost_frames(line);
    FUZZ_CHECK(!lost || (!lost->bus.empty() && line.starts_with(lost_frames_begin)));
    check_screen_line(line);
    if (!parsed) {
      check_damage(parsed.error(), line);
    } else if (parsed->kind != LogLineKind::nothing) {
      check_line(*parsed);
    }
  }
  return 0;
}
