// What a sensor or monitor said that is no value, counted by why.
//
// A frame that is not whole never comes so far, but where a sensor has frames of its own: its driver refuses them.
// Those of the results at 521h to 531h are counted by what is wrong with them, as a module's are (RejectReason). Counts
// go on when the bus was away. Pure.
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

/// Why a result is none.
enum class ResultRefusal : std::uint8_t {
  sensor_fault,  // the sensor marks it as wrong
  out_of_range,  // no sensor can have measured it
  not_known,     // the sensor says that it does not know
  wrong_frame,   // of a sensor that has frames of its own: not whole, or another device's
};
inline constexpr std::size_t result_refusal_count = 4;

[[nodiscard]] std::string_view to_text(ResultRefusal why);
/// Of a value that is not valid.
[[nodiscard]] ResultRefusal refusal_of(Validity validity);

struct RefusedResults {
  std::array<std::uint64_t, result_refusal_count> by_reason{};
  ResultRefusal last = ResultRefusal::sensor_fault;  // only once there is one
  TimePoint last_at{};
  std::array<std::uint64_t, reject_reason_count> frames{};  // of the sensor's own rows, by RejectReason

  void note(ResultRefusal why, TimePoint at) {
    ++by_reason[static_cast<std::size_t>(why)];
    last = why;
    last_at = at;
  }
  void note_frame(RejectReason why) { ++frames[static_cast<std::size_t>(why)]; }
  [[nodiscard]] std::uint64_t of(ResultRefusal why) const { return by_reason[static_cast<std::size_t>(why)]; }
  /// Without the frames.
  [[nodiscard]] std::uint64_t count() const {
    return std::accumulate(by_reason.begin(), by_reason.end(), std::uint64_t{0});
  }
};

/// Periods of an insulation monitor's pulses that mean nothing, by what is in no row.
struct RefusedPulses {
  std::array<std::uint64_t, ir155::misfit_count> by_reason{};
  TimePoint ended_at{};  // of the period that was looked at last; zero: none

  /// The signal as it was seen at `at`: a period is looked at once, however often it is told.
  void observe(const ir155::Pwm& pwm, TimePoint at);
  [[nodiscard]] std::uint64_t of(ir155::Misfit why) const { return by_reason[static_cast<std::size_t>(why)]; }
};

}  // namespace bmu
