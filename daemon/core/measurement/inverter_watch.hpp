// State of the inverter: its keep-alive, its other reports, and whether another node sends it battery messages.
//
// An inverter that is supplied by the pack cannot send before the pack is closed, and starts some time after: until its
// first keep-alive the timeout is `first_word_max`; from then on, and if it was sending when the pack closed, it is
// `silence_max` between two keep-alives. While the pack is open, no keep-alive is required.
//
// Pure; some 50 ns a frame.
#pragma once

#include <cstdint>

#include "daemon/core/types/core_config.hpp"
#include "devices/inverter.hpp"
#include "protocol/fields.hpp"
#include "protocol/frame.hpp"

namespace bmu {

class InverterWatch {
 public:
  /// Another node that sends battery messages to this inverter sends once per second: the detection is held for two and
  /// a half periods.
  static constexpr Duration foreign_memory = 2'500ms;

  void init(const InverterConfig& config) { config_ = config; }
  [[nodiscard]] bool is_there() const { return config_.driver != nullptr; }
  [[nodiscard]] const InverterConfig& config() const { return config_; }

  /// A frame of the inverter's bus. False: a frame neither of an inverter nor of a battery.
  bool observe(const CanFrame& frame, TimePoint at);
  /// After an interruption of the core (stall, bus down, sleep) previously received values are invalid.
  void forget_values();

  /// `closed_since`: when the pack was closed; zero: not closed.
  [[nodiscard]] bool is_silent(TimePoint now, TimePoint closed_since) const;
  [[nodiscard]] bool is_talking(TimePoint now) const {
    return heard_at_ != TimePoint{} && now - heard_at_ <= patience();
  }
  /// It reports a failure, and its keep-alive is received.
  [[nodiscard]] bool has_trouble(TimePoint now) const { return is_talking(now) && report_.has_failed; }
  /// Another node sends the battery messages of this node.
  [[nodiscard]] bool has_foreign_battery(TimePoint now) const {
    return foreign_at_ != TimePoint{} && now - foreign_at_ <= foreign_memory;
  }
  [[nodiscard]] TimePoint foreign_at() const { return foreign_at_; }
  /// Maximum time between two keep-alives; a default if the keep-alive is not monitored.
  [[nodiscard]] Duration patience() const {
    return config_.silence_max > Duration{} ? config_.silence_max : InverterConfig{}.silence_max;
  }

  [[nodiscard]] const InverterReport& report() const { return report_; }
  [[nodiscard]] TimePoint heard_at() const { return heard_at_; }
  [[nodiscard]] std::uint64_t frames_taken() const { return frames_taken_; }
  [[nodiscard]] std::uint64_t frames_refused() const { return frames_refused_; }

 private:
  InverterConfig config_;
  InverterReport report_;
  TimePoint heard_at_{};  // its keep-alive; zero: never
  TimePoint foreign_at_{};
  std::uint64_t frames_taken_ = 0;
  std::uint64_t frames_refused_ = 0;
  BMU_FIELDS(skipped(config_), report_, heard_at_, foreign_at_, frames_taken_, frames_refused_)
};

}  // namespace bmu
