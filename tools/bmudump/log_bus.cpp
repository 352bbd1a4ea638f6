#include "tools/bmudump/log_bus.hpp"

#include <optional>

#include <fcntl.h>
#include <unistd.h>

#include "protocol/candump.hpp"
#include "protocol/candump_screen.hpp"
#include "tools/common/byte_order_mark.hpp"
#include "tools/common/line_reader.hpp"

namespace bmu::dump {
namespace {

/// Some seconds of a busy bus.
constexpr std::uint64_t lines_max = 10'000;

std::optional<LogLine> frame_of(std::string_view line, ScreenRoom& room) {
  const std::string_view text = without_byte_order_mark(line);
  if (const auto parsed = parse_log_line(text)) {
    return parsed->kind == LogLineKind::frame ? std::optional(*parsed) : std::nullopt;
  }
  const auto screen = parse_screen_line(text, room);
  return screen && screen->line.kind == LogLineKind::frame ? std::optional(screen->line) : std::nullopt;
}

/// Bus names from the lines read so far.
struct Found {
  std::string first;
  std::string of_device;
};

/// Reads until the bus of the device is found.
void read_beginning(int fd, const Device& device, Found& found) {
  LineReader reader(fd);
  ScreenRoom room{};
  LineReader::Line line;
  bool has_more = true;
  while (has_more) {
    has_more = reader.fill() == LineReader::Filled::more;
    while (reader.take(line)) {
      const std::optional<LogLine> frame = frame_of(line.text, room);
      if (frame && found.first.empty()) found.first = frame->bus;
      if (frame && device.catalogue->find(frame->frame).message != nullptr) found.of_device = frame->bus;
      if (!found.of_device.empty() || reader.line_number() >= lines_max) return;
    }
  }
}

}  // namespace

std::string bus_of_logs(const std::vector<std::string>& files, const Device& device) {
  Found found;
  for (const std::string& name : files) {
    const int fd = name == "-" ? -1 : ::open(name.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (fd < 0) continue;
    read_beginning(fd, device, found);
    ::close(fd);
    if (!found.of_device.empty()) break;
  }
  return found.of_device.empty() ? found.first : found.of_device;
}

}  // namespace bmu::dump
