#include "daemon/shell/system/sparing_log.hpp"

#include <string>
#include <utility>

namespace bmu {

void SparingLog::log(TimePoint now, std::string_view line) {
  tell_left_out(now);
  if (lines_ == 0) began_at_ = now;
  if (lines_ == lines_max) {
    ++left_out_;
    return;
  }
  ++lines_;
  log_(line);
}

void SparingLog::tell_left_out(TimePoint now) {
  if (lines_ == 0 || now - began_at_ < period) return;
  lines_ = 0;
  const std::uint64_t count = std::exchange(left_out_, 0);
  if (count > 0) log_(std::to_string(count) + " similar lines suppressed within one minute");
}

}  // namespace bmu
