// Rate-limited log, for lines that a client can cause as often as it likes: some of each minute are logged, the others
// counted, so that no client can displace important lines.
#pragma once

#include <cstdint>
#include <functional>
#include <string_view>

#include "protocol/time.hpp"

namespace bmu {

class SparingLog {
 public:
  using Log = std::function<void(std::string_view line)>;

  static constexpr Duration period = 1min;
  static constexpr std::uint32_t lines_max = 10;  // in each period

  explicit SparingLog(Log log) : log_(std::move(log)) {}

  void log(TimePoint now, std::string_view line);
  /// After the end of a period: logs how many of its lines were suppressed, if any. Call it periodically.
  void tell_left_out(TimePoint now);

 private:
  Log log_;
  TimePoint began_at_{};
  std::uint32_t lines_ = 0;
  std::uint64_t left_out_ = 0;
};

}  // namespace bmu
