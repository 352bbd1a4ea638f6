#include "daemon/shell/can/bus_port.hpp"

#include <algorithm>

#include <time.h>

#include "daemon/shell/can/can_socket.hpp"
#include "daemon/shell/can/embedded_bus.hpp"
#include "daemon/shell/can/port_rules.hpp"

namespace bmu {

namespace {

constexpr std::string_view embedded_prefix = "unix:";

}  // namespace

TimePoint monotonic_now() {
  timespec now{};
  clock_gettime(CLOCK_BOOTTIME, &now);
  // Whole microseconds, because a recording keeps no more: with a finer time its replay would decide at other times.
  return TimePoint(std::chrono::seconds(now.tv_sec) + std::chrono::microseconds(now.tv_nsec / 1000));
}

std::string_view to_text(BusState state) {
  switch (state) {
    case BusState::up: return "up";
    case BusState::down: return "down";
    case BusState::absent: return "absent";
  }
  return "?";
}

std::string_view to_text(SendError error) {
  switch (error) {
    case SendError::queue_full: return "queue full";
    case SendError::down: return "interface down";
    case SendError::refused: return "refused";
  }
  return "?";
}

bool is_embedded_bus(std::string_view name) {
  return name.starts_with(embedded_prefix);
}

Result<std::unique_ptr<BusPort>, OsError> open_bus(std::string_view name, const PortOptions& options) {
  const auto any_beyond = [](const std::vector<std::uint32_t>& ids, std::uint32_t max) {
    return std::any_of(ids.begin(), ids.end(), [max](std::uint32_t id) { return id > max; });
  };
  if (any_beyond(options.receive_ids, standard_id_max)) {
    return failure(OsError{.code = 0, .what = "an identifier to receive has more than 11 bits"});
  }
  if (any_beyond(options.receive_extended_ids, extended_id_max)) {
    return failure(OsError{.code = 0, .what = "an extended identifier to receive has more than 29 bits"});
  }
  if (is_embedded_bus(name)) {
    return open_embedded_bus(name.substr(embedded_prefix.size()), options);
  }
  return open_can_socket(name, options);
}

}  // namespace bmu
