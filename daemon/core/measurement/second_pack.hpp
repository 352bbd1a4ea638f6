// Receiver of the vehicle messages of a second pack, for its SOC in this node's 626h (SOC2) and for display.
//
// The pack is identified by the base identifier of its nine messages, or by its bus; the dialect defines the format of
// 622h. A frame counts only as a whole: one with another length than its row, or a remote frame, changes nothing and is
// counted; an extended frame is not a message of the pack. A name that is not printable is not from a traction pack:
// other devices use 620h and its neighbours, too. A value older than `age_max` is unknown: a pack that is lost is
// unknown, never empty.
//
// Of the two messages that some revisions extend by a byte, 622h and 626h, six bytes are accepted as well; the values
// behind them are then unknown, and so is the SOH: six bytes do not define its place.
//
// Pure; some 50 ns a frame.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>

#include "daemon/core/types/core_config.hpp"
#include "daemon/core/types/measured.hpp"
#include "protocol/fields.hpp"
#include "protocol/frame.hpp"

namespace bmu {

class SecondPack {
 public:
  /// Each message is sent once per second: two may be lost.
  static constexpr Duration age_max = 3'500ms;

  struct Values {
    Measured<std::int32_t> state;  // the number, if it is one of the dialect's, or the bits of 622h b0
    Measured<std::int32_t> pack_voltage_mV;
    Measured<std::int32_t> cell_voltage_min_uV;
    Measured<std::int32_t> cell_voltage_max_uV;
    Measured<std::int32_t> current_mA;
    Measured<std::int32_t> charge_limit_mA;
    Measured<std::int32_t> discharge_limit_mA;
    Measured<std::int32_t> soc_permille;
    Measured<std::int32_t> soh_permille;
    Measured<std::int32_t> cell_temperature_min_dC;
    Measured<std::int32_t> cell_temperature_max_dC;
    std::array<char, 8> name{};  // 620h; zeros: not received
  };

  void init(const SecondPackConfig& config, TimePoint now) {
    config_ = config;
    listening_since_ = now;
  }
  [[nodiscard]] bool is_expected() const { return config_.base_id != 0; }
  [[nodiscard]] VehicleDialect dialect() const { return config_.dialect; }

  /// A frame of the bus of the second pack. False: not a message of this pack.
  bool observe(const CanFrame& frame, TimePoint at);
  /// After an interruption of the core (stall, bus down, sleep) previously received values are invalid.
  void forget_values(TimePoint now) {
    values_ = {};
    listening_since_ = now;
  }

  [[nodiscard]] const Values& values() const { return values_; }
  [[nodiscard]] TimePoint heard_at() const { return heard_at_; }
  /// A second pack is configured and has not been received within the timeout.
  [[nodiscard]] bool is_silent(TimePoint now) const {
    return is_expected() && now - std::max(heard_at_, listening_since_) > age_max;
  }
  [[nodiscard]] std::optional<std::int32_t> soc_permille(TimePoint now) const;
  [[nodiscard]] std::uint64_t frames_taken() const { return frames_taken_; }
  [[nodiscard]] std::uint64_t frames_refused() const { return frames_refused_; }
  /// Values of accepted frames that are outside the range of their field.
  [[nodiscard]] std::uint64_t values_out_of_range() const { return values_out_of_range_; }

 private:
  [[nodiscard]] bool take(const MessageSpec& message, const CanFrame& frame, TimePoint at);
  void take_value(Measured<std::int32_t>& target, const SignalValue& value, TimePoint at);
  [[nodiscard]] bool take_name(const CanFrame& frame);

  SecondPackConfig config_;
  Values values_;
  TimePoint heard_at_{};
  TimePoint listening_since_{};
  std::uint64_t frames_taken_ = 0;
  std::uint64_t frames_refused_ = 0;
  std::uint64_t values_out_of_range_ = 0;
  BMU_FIELDS(skipped(config_), values_, heard_at_, listening_since_, frames_taken_, frames_refused_,
             values_out_of_range_)
};

}  // namespace bmu
