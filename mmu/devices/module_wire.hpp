// Fault injection between a module and the bus: changes the frames of a healthy module as a defective transmitter, a
// wrong firmware or a wrongly configured module would.
//
//   push(frames, faults, now)   the frames that the module sends now, changed by the faults
//   pop(now)                    the next frame that is due, or none; repeated until none
//
// Checksums are right regardless of other faults, unless the checksum is the fault. Pure; capacity for `frames_max`
// pending frames, which a delay of half a second and a POLL every 50 ms do not fill; frames beyond it are lost.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "mmu/devices/frame_queue.hpp"
#include "mmu/devices/mmu.hpp"

namespace bmu {

/// Frames of an answer that a module omits.
enum class OmittedFrames : std::uint8_t { nothing, status, cells, temperatures, module, ident };

struct ModuleWireFaults {
  bool is_silent = false;
  bool has_damaged_frames = false;  // wrong checksum
  bool is_stuck = false;            // data bytes of each kind of frame remain as they were last
  bool has_frozen_counter = false;  // the counter remains as it was sent last
  bool is_replaying = false;        // both: complete old answers
  OmittedFrames omitted = OmittedFrames::nothing;
  std::optional<std::uint8_t> node;  // in its identifiers; it still receives requests to its own
  std::optional<std::uint8_t> cell_count;
  std::optional<std::uint8_t> temperature_sensor_count;
  std::optional<std::uint8_t> protocol_version;
  std::optional<std::uint32_t> serial_number;
  CellMask undervoltage_flags = 0;          // set in STATUS regardless of the measurements
  std::optional<CellMask> balancing_cells;  // actual switches, if they do not follow the module
  Duration delay{};
};

class ModuleWire {
 public:
  static constexpr std::size_t frames_max = 128;

  void push(const MmuFrames& frames, const ModuleWireFaults& faults, TimePoint now);
  [[nodiscard]] std::optional<CanFrame> pop(TimePoint now) { return queue_.pop(now); }
  /// Whether frames are pending.
  [[nodiscard]] bool is_sending() const { return !queue_.is_empty(); }

 private:
  struct Kept {
    FrameBytes data{};
    bool exists = false;
  };
  static constexpr std::size_t kinds = 16;  // identifier = kind * 64 + node

  [[nodiscard]] CanFrame changed(CanFrame frame, const ModuleWireFaults& faults);
  void change_answer(std::size_t kind, const ModuleWireFaults& faults, CanFrame& frame);

  std::array<Kept, kinds> kept_{};
  std::uint8_t counter_ = 0;  // of the last answer
  FrameQueue<frames_max> queue_;
};

}  // namespace bmu
