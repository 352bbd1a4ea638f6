// Controller of the emulated charger: the share of its set output that it delivers.
//
// It receives the charge limit in PACK_CURRENT on the vehicle's bus, which is sent once a second and is 0 when charging
// is forbidden, and never exceeds it. Without a report for longer than `limit_life` charging is not permitted, as with
// a real charger. A charger that never received a report is not on the vehicle's bus, or there is no master: it is set
// by hand and has no limit.
#pragma once

#include <optional>

#include "protocol/frame.hpp"
#include "protocol/tables/vehicle_bus.hpp"
#include "protocol/time.hpp"

namespace bmu {

class ChargerControl {
 public:
  /// Three of the master's reports.
  static constexpr Duration limit_life = 3 * vehicle_bus::pack_current.period;

  /// `report_base_id`: of the vehicle's messages, usually 620h.
  explicit ChargerControl(std::uint16_t report_base_id)
      : limit_id_(report_base_id + std::uint32_t{vehicle_bus::pack_current.base_id - vehicle_bus::default_base_id}) {}

  /// Handles any frame on the vehicle's bus. An unknown limit counts as 0.
  void observe(const CanFrame& frame, TimePoint now) {
    const bool is_limit = frame.id == limit_id_ && frame.length == vehicle_bus::pack_current.length &&
                          !frame.is_extended && !frame.is_remote && !frame.is_error;
    if (!is_limit) return;
    const SignalValue limit = read<vehicle_bus::pack_current, "charge_limit_mA">(frame);
    limit_A_ = limit.is_valid() ? static_cast<double>(limit.value) * 1e-3 : 0.0;
    heard_at_ = now;
  }

  /// Maximum output; none: no limit was ever received.
  [[nodiscard]] std::optional<double> limit_A(TimePoint now) const {
    if (!limit_A_) return std::nullopt;
    return now - heard_at_ <= limit_life ? limit_A_ : 0.0;
  }

 private:
  std::uint32_t limit_id_;
  std::optional<double> limit_A_;
  TimePoint heard_at_{};
};

}  // namespace bmu
