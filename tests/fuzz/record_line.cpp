// Single lines of a recording: an observation that is read is written as it was read.
//
// Input: lines; the first byte selects the offset of the log's clock.
#include "daemon/recording/record_line.hpp"

#include <array>
#include <string>

#include "tests/fuzz/fuzz.hpp"

using namespace bmu;

namespace {

const RecordBuses buses{.internal = "vcan0", .vehicle = "can1"};

std::string printed(const Observation& observation, const RecordClock& clock) {
  std::array<char, record_line_max> room{};
  const std::size_t length = print_observation(observation, clock, buses, room);
  FUZZ_CHECK(length >= 1 && length <= room.size() && room[length - 1] == '\n');
  return {room.data(), length - 1};
}

void check_observation(const Observation& observation, const RecordClock& clock) {
  constexpr Duration latest = std::chrono::microseconds{record_time_max_us};
  if (std::chrono::abs(observation.at.time_since_epoch()) > latest)
    return;  // impossible in a core: handled by the reader
  const std::string line = printed(observation, clock);
  FUZZ_CHECK(line.find('\n') == std::string::npos);
  const auto again = parse_record_line(line, clock, buses);
  FUZZ_CHECK(again && std::holds_alternative<Observation>(*again));
  const auto& read = std::get<Observation>(*again);
  FUZZ_CHECK(read.at == observation.at && read.what.index() == observation.what.index());
  FUZZ_CHECK(printed(read, clock) == line);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string_view text = fuzz::text_of(data, size);
  if (text.empty()) return 0;
  constexpr std::array<std::int64_t, 3> aheads_us{0, 1'699'987'654'321'098, record_time_max_us};
  const RecordClock clock{.ahead_us = aheads_us[data[0] % aheads_us.size()]};
  text.remove_prefix(1);
  for (const std::string_view line : fuzz::lines_of(text)) {
    const auto parsed = parse_record_line(line, clock, buses);
    if (!parsed) {
      FUZZ_CHECK(parsed.error().column <= line.size() && !parsed.error().wanted.empty());
    } else if (const auto* const observation = std::get_if<Observation>(&*parsed)) {
      check_observation(*observation, clock);
    }
  }
  return 0;
}
