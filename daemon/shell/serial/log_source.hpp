// Source of the log lines that the serial console dumps: the history, if one is kept.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "protocol/result.hpp"

namespace bmu {

/// The next line, without its end; no value after the last one; or the error, for people.
using NextLogLine = std::function<Result<std::optional<std::string>, std::string>()>;

/// Starts at the oldest line, once for each dump. Both are called on the console's thread, which may wait for a disk:
/// they share nothing with the control loop, and own all objects that they need.
using LogSource = std::function<NextLogLine()>;

/// For a daemon that keeps no history.
[[nodiscard]] inline LogSource empty_log() {
  return [] { return [] { return Result<std::optional<std::string>, std::string>(std::nullopt); }; };
}

}  // namespace bmu
