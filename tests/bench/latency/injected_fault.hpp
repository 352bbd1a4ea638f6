// Fault that an emulated pack injects, and the frame that completes its confirmation by the daemon.
//
//   emergency_stop    confirmed by the first PDU_STATUS with the emergency stop pressed
//   cell_overvoltage  a cell of the pack, drawn by lot, is measured 10 mV above its opening threshold. The daemon
//                     confirms the fault (daemon/core/faults/fault_memory.hpp) once two samples of the cell and
//                     `confirm_ms` of the limit are complete. The second sample comes with the answer to a single POLL,
//                     which the daemon sends 15 ms after the POLL of the first at the earliest. With a `confirm_ms` of
//                     at most 10 the time is over when the second sample arrives, so its CELLS frame completes the
//                     confirmation. With a longer `confirm_ms` no frame does: the time ends between two frames, and the
//                     next decision, after at most a tick of 10 ms, opens. Therefore pack_for() shortens a longer
//                     `confirm_ms` to 10, and a frame that comes before `confirm_ms` is over is not measured.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "config/pack_config.hpp"
#include "mmu/devices/random.hpp"
#include "protocol/frame.hpp"
#include "protocol/time.hpp"

namespace bmu::latency {

enum class FaultChoice : std::uint8_t { emergency_stop, cell_overvoltage };

inline constexpr std::array all_faults{FaultChoice::emergency_stop, FaultChoice::cell_overvoltage};

[[nodiscard]] std::string_view to_text(FaultChoice fault);

/// Longest confirm time of a cell overvoltage that is over when the second sample arrives.
inline constexpr Duration confirm_max = 10ms;

/// The pack file as the daemon is started with it: `file` itself, or a copy of it in `folder` with the confirm time of
/// the cell overvoltage shortened to confirm_max. Throws if the file is invalid.
[[nodiscard]] std::string pack_for(FaultChoice fault, const std::string& file, const std::string& folder);

class InjectedFault {
 public:
  InjectedFault(FaultChoice fault, const CoreConfig& pack, RandomSource& random);

  /// Event of the script language that injects the fault.
  [[nodiscard]] const std::string& event() const { return event_; }

  enum class Effect : std::uint8_t {
    none,
    completes,           // this frame completes the confirmation
    completes_too_soon,  // the last sample, before the confirm time was over: the daemon confirms at a tick
  };
  /// To be called with every frame of the emulated pack, in order, just before it is written.
  [[nodiscard]] Effect effect_of(const CanFrame& frame, TimePoint written_at);

 private:
  [[nodiscard]] bool shows_fault(const CanFrame& frame) const;

  FaultChoice fault_;
  std::string event_;
  std::uint8_t node_ = 0;  // of the cell
  std::size_t cell_ = 0;   // in its module, from 0
  std::int32_t threshold_uV_ = 0;
  Duration confirm_{};
  std::size_t samples_needed_ = 1;
  std::size_t samples_ = 0;
  TimePoint first_at_{};
};

}  // namespace bmu::latency
