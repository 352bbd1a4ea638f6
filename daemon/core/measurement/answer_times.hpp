// Time from the POLL to the last frame of a module's answer, over the session: statistics of fixed size, so that a
// module that becomes slow or irregular is detected before it is lost.
//
//   last, worst, mean    of all complete answers
//   jitter               difference between consecutive answers, smoothed: j += (|difference| - j) / 16, the
//                        interarrival jitter of RFC 3550, section 6.4.1
//   within               number of answers up to each of `bounds`; percentiles are read from it
//
// Cost: a few compares an answer, about 100 bytes a module.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "protocol/fields.hpp"
#include "protocol/time.hpp"

namespace bmu {

class AnswerTimes {
 public:
  /// An answer belongs to the first bound that is not less than its time; the last place is for times beyond all
  /// bounds.
  static constexpr std::array<Duration, 8> bounds{2ms, 5ms, 10ms, 20ms, 30ms, 50ms, 100ms, 200ms};
  using Counts = std::array<std::uint32_t, bounds.size() + 1>;

  constexpr void add(Duration took) {
    if (count_ > 0) {
      const Duration apart = took > last_ ? took - last_ : last_ - took;
      jitter_ += (apart - jitter_) / smoothing;
    }
    last_ = took;
    worst_ = std::max(worst_, took);
    sum_ += took;
    ++count_;
    const auto* const bound = std::lower_bound(bounds.begin(), bounds.end(), took);
    ++counts_[static_cast<std::size_t>(bound - bounds.begin())];
  }

  [[nodiscard]] constexpr std::uint64_t count() const { return count_; }
  [[nodiscard]] constexpr Duration last() const { return last_; }
  [[nodiscard]] constexpr Duration worst() const { return worst_; }
  [[nodiscard]] constexpr Duration jitter() const { return jitter_; }
  /// Zero without an answer.
  [[nodiscard]] constexpr Duration mean() const {
    return count_ == 0 ? Duration{} : sum_ / static_cast<std::int64_t>(count_);
  }
  /// Minimum bound that this share of the answers did not exceed, or the worst answer if that is less: 950 gives the
  /// 95th percentile. Zero without an answer.
  [[nodiscard]] constexpr Duration within(std::uint64_t permille) const {
    std::uint64_t kept = 0;
    for (std::size_t place = 0; place < bounds.size(); ++place) {
      kept += counts_[place];
      if (kept * 1'000 >= permille * count_) return std::min(bounds[place], worst_);
    }
    return worst_;
  }
  [[nodiscard]] constexpr const Counts& counts() const { return counts_; }

 private:
  static constexpr std::int64_t smoothing = 16;

  std::uint64_t count_ = 0;
  Duration last_{};
  Duration worst_{};
  Duration sum_{};
  Duration jitter_{};
  Counts counts_{};
  BMU_FIELDS(count_, last_, worst_, sum_, jitter_, counts_)
};

}  // namespace bmu
