// Text of a span of time, as the daemon and bmuctl show it.
#pragma once

#include <cstdint>
#include <string>

namespace bmu {

/// "417 ms", "14.3 s", "2 min 5 s", "3 h 20 min"; negative values in milliseconds.
[[nodiscard]] inline std::string span_text_of_ms(std::int64_t ms) {
  const std::int64_t s = ms / 1000;
  if (ms < 1'000) return std::to_string(ms) + " ms";
  if (s < 60) return std::to_string(s) + "." + std::to_string(ms % 1'000 / 100) + " s";
  if (s < 3'600) return std::to_string(s / 60) + " min " + std::to_string(s % 60) + " s";
  return std::to_string(s / 3'600) + " h " + std::to_string(s % 3'600 / 60) + " min";
}

}  // namespace bmu
