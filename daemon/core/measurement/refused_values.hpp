// Counters of invalid values of a sensor or monitor, by reason.
//
// Incomplete frames are rejected before, except from a sensor with frames of its own, which are rejected by its driver.
// Frames of the results at 521h to 531h are counted by their defect, like those of a module (RejectReason). The
// counters are kept when the bus was down. Pure.
#pragma once

#include <array>
#include <cstdint>
#include <numeric>
#include <string_view>

#include "protocol/ir155.hpp"
#include "protocol/receive_check.hpp"
#include "protocol/signal.hpp"
#include "protocol/time.hpp"

namespace bmu {

/// Reason why a result is not valid.
enum class ResultRefusal : std::uint8_t {
  sensor_fault,  // marked as an error by the sensor
  out_of_range,  // outside the range of any sensor
  not_known,     // marked as unknown by the sensor
  wrong_frame,   // of a sensor with frames of its own: incomplete, or of another device
};
inline constexpr std::size_t result_refusal_count = 4;

[[nodiscard]] std::string_view to_text(ResultRefusal why);
/// Reason for a value that is not valid.
[[nodiscard]] ResultRefusal refusal_of(Validity validity);

struct RefusedResults {
  std::array<std::uint64_t, result_refusal_count> by_reason{};
  ResultRefusal last = ResultRefusal::sensor_fault;  // has no meaning before the first one
  TimePoint last_at{};
  std::array<std::uint64_t, reject_reason_count> frames{};  // of the rows of the sensor, by RejectReason

  void note(ResultRefusal why, TimePoint at) {
    ++by_reason[static_cast<std::size_t>(why)];
    last = why;
    last_at = at;
  }
  void note_frame(RejectReason why) { ++frames[static_cast<std::size_t>(why)]; }
  [[nodiscard]] std::uint64_t of(ResultRefusal why) const { return by_reason[static_cast<std::size_t>(why)]; }
  /// Without the rejected frames.
  [[nodiscard]] std::uint64_t count() const {
    return std::accumulate(by_reason.begin(), by_reason.end(), std::uint64_t{0});
  }
};

/// Invalid periods of an insulation monitor's pulses, by the property that matches no row.
struct RefusedPulses {
  std::array<std::uint64_t, ir155::misfit_count> by_reason{};
  TimePoint ended_at{};  // end of the last evaluated period; zero: none

  /// Evaluates the signal as read at `at`: each period once, however often it is reported.
  void observe(const ir155::Pwm& pwm, TimePoint at);
  [[nodiscard]] std::uint64_t of(ir155::Misfit why) const { return by_reason[static_cast<std::size_t>(why)]; }
};

}  // namespace bmu
