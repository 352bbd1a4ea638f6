// Recent current samples: minimum and maximum of each 10 ms, and the last sample with its time, for at least the last
// 640 ms. Used to explain the difference between two voltages that were sampled at different times, and to find the
// current at the sample time of a voltage.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>

#include "protocol/fields.hpp"
#include "protocol/time.hpp"

namespace bmu {

struct CurrentRange {
  bool is_known = false;
  std::int32_t min_mA = 0;
  std::int32_t max_mA = 0;
};

class CurrentWindow {
 public:
  void add(std::int32_t current_mA, TimePoint at) {
    Bucket& latest = buckets_[head_];
    if (latest.is_used && at - latest.began_at < bucket_length) {
      latest.min_mA = std::min(latest.min_mA, current_mA);
      latest.max_mA = std::max(latest.max_mA, current_mA);
      latest.last_mA = current_mA;
      latest.last_at = at;
      return;
    }
    head_ = (head_ + 1) % buckets_.size();
    buckets_[head_] = {true, at, current_mA, current_mA, current_mA, at};
  }

  /// The current at an instant, linearly interpolated between the samples on either side of it. Unknown without both,
  /// or if either is further away than `apart_max`.
  [[nodiscard]] std::optional<std::int32_t> at(TimePoint moment, Duration apart_max) const {
    const Bucket* after = nullptr;
    for (std::size_t back = 0; back < buckets_.size(); ++back) {
      const Bucket& bucket = buckets_[(head_ + buckets_.size() - back) % buckets_.size()];
      if (!bucket.is_used) break;
      if (bucket.last_at == moment) return bucket.last_mA;
      if (bucket.last_at > moment) {
        after = &bucket;
        continue;
      }
      const bool is_between =
          after != nullptr && after->last_at - moment <= apart_max && moment - bucket.last_at <= apart_max;
      if (!is_between) break;
      const std::int64_t step_mA = std::int64_t{after->last_mA} - bucket.last_mA;
      return static_cast<std::int32_t>(bucket.last_mA + step_mA * ((moment - bucket.last_at) / 1us) /
                                                            ((after->last_at - bucket.last_at) / 1us));
    }
    return std::nullopt;
  }

  /// Minimum and maximum of the buckets that overlap the time from `from` to `to`. Unknown without any.
  [[nodiscard]] CurrentRange range(TimePoint from, TimePoint to) const {
    CurrentRange found;
    for (std::size_t back = 0; back < buckets_.size(); ++back) {
      const Bucket& bucket = buckets_[(head_ + buckets_.size() - back) % buckets_.size()];
      if (!bucket.is_used || bucket.began_at + bucket_length < from) break;
      if (bucket.began_at > to) continue;
      found.min_mA = found.is_known ? std::min(found.min_mA, bucket.min_mA) : bucket.min_mA;
      found.max_mA = found.is_known ? std::max(found.max_mA, bucket.max_mA) : bucket.max_mA;
      found.is_known = true;
    }
    return found;
  }

  /// As `range`, including the last samples before `from` and the first after `to`: the current in that whole time lies
  /// between them. Unknown without both.
  [[nodiscard]] CurrentRange span(TimePoint from, TimePoint to) const {
    const Bucket* behind = nullptr;
    for (std::size_t back = 0; back < buckets_.size(); ++back) {
      const Bucket& bucket = buckets_[(head_ + buckets_.size() - back) % buckets_.size()];
      if (!bucket.is_used) break;
      if (bucket.last_at >= to) behind = &bucket;
      if (bucket.last_at > from) continue;
      if (behind == nullptr) break;
      return range(bucket.began_at, behind->began_at);
    }
    return {};
  }

  /// Maximum minus minimum of the samples from `since` on, including the bucket before it. 0 without samples.
  [[nodiscard]] std::int64_t swing_mA(TimePoint since) const {
    std::int32_t min_mA = buckets_[head_].min_mA;
    std::int32_t max_mA = buckets_[head_].max_mA;
    for (std::size_t back = 0; back < buckets_.size(); ++back) {
      const Bucket& bucket = buckets_[(head_ + buckets_.size() - back) % buckets_.size()];
      if (!bucket.is_used) break;
      min_mA = std::min(min_mA, bucket.min_mA);
      max_mA = std::max(max_mA, bucket.max_mA);
      if (bucket.began_at < since) break;
    }
    return std::int64_t{max_mA} - min_mA;
  }

 private:
  struct Bucket {
    bool is_used = false;
    TimePoint began_at{};
    std::int32_t min_mA = 0;
    std::int32_t max_mA = 0;
    std::int32_t last_mA = 0;
    TimePoint last_at{};
  };

  static constexpr Duration bucket_length = 10ms;

  std::array<Bucket, 64> buckets_{};
  std::size_t head_ = 0;
  [[nodiscard]] bool are_fields_possible() const { return head_ < buckets_.size(); }
  BMU_FIELDS(buckets_, head_)
};

}  // namespace bmu
