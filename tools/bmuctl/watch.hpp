// bmuctl watch: the live view on a terminal, a line a second anywhere else, the last live view at the end.
#pragma once

#include <chrono>
#include <optional>
#include <string>

namespace bmu {

struct WatchOptions {
  std::string socket;
  std::optional<std::chrono::milliseconds> period;    // default: 250 ms on a terminal, 1 s elsewhere
  std::optional<std::chrono::milliseconds> duration;  // then the program ends by itself
  bool reconnect = false;
  bool json = false;
  bool with_colour = false;
};

/// Exit code: 0 ended by the user or by its duration, 1 the daemon does not answer or has gone.
[[nodiscard]] int watch(const WatchOptions& options);

}  // namespace bmu
