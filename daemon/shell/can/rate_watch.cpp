#include "daemon/shell/can/rate_watch.hpp"

namespace bmu {

bool RateWatch::update(const BusPort& internal) {
  const std::int64_t found_bit_per_s = internal.rate_bit_per_s();
  if (found_bit_per_s == finding_.found_bit_per_s) return false;
  finding_ = judge_rate(pack_, file_name_, found_bit_per_s);
  return finding_.verdict != RateVerdict::unknown;
}

Severity RateWatch::severity(bool is_start) const {
  switch (finding_.verdict) {
    case RateVerdict::unknown:
    case RateVerdict::as_wanted: return Severity::info;
    case RateVerdict::differs: return is_start ? Severity::warning : Severity::error;
    case RateVerdict::too_slow: return Severity::error;
  }
  return Severity::error;
}

}  // namespace bmu
