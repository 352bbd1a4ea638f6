// Whether the inverter is there: its keep-alive, what else it says, and whether anybody else tells it of a battery.
//
// An inverter that lives on the pack can say nothing before the pack is closed, and takes a while after: until it is
// first heard it has `first_word_max`, from then on, and if it was talking when the pack closed, `silence_max` from
// word to word. Of an open pack its silence is nobody's concern.
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
  /// Somebody who tells our inverter of a battery does so once a second: remembered for two of them, and a half.
  static constexpr Duration foreign_memory = 2'500ms;

  void init(const InverterConfig& config) { config_ = config; }
  [[nodiscard]] bool is_there() const { return config_.driver != nullptr; }
  [[nodiscard]] const InverterConfig& config() const { return config_; }

  /// A frame of the inverter's bus. False: it is none of an inverter's nor of a battery's.
  bool observe(const CanFrame& frame, TimePoint at);
  /// After a gap in our own life nothing heard before may count.
  void forget_values();

  /// `closed_since`: when the pack came to be closed; zero: it is not.
  [[nodiscard]] bool is_silent(TimePoint now, TimePoint closed_since) const;
  [[nodiscard]] bool is_talking(TimePoint now) const {
    return heard_at_ != TimePoint{} && now - heard_at_ <= patience();
  }
  /// In its own words, while it talks.
  [[nodiscard]] bool has_trouble(TimePoint now) const { return is_talking(now) && report_.has_failed; }
  /// Somebody else sends what we tell the inverter.
  [[nodiscard]] bool has_foreign_battery(TimePoint now) const {
    return foreign_at_ != TimePoint{} && now - foreign_at_ <= foreign_memory;
  }
  [[nodiscard]] TimePoint foreign_at() const { return foreign_at_; }
  /// From word to word; of one that nobody has to hear, too.
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
