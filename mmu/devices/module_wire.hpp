// Between a module unit and the bus: what a broken transmitter, a wrong firmware or a wrongly set up unit makes of the
// frames of a unit that itself is healthy.
//
//   push(frames, faults, now)   what the unit sends now, changed as the faults say
//   pop(now)                    the next frame whose time has come, or nothing; until it says nothing
//
// Checksums are right whatever else is wrong, except where the fault is the checksum. Pure; room for `frames_max`
// frames on their way, which a delay of half a second and a POLL every 50 ms do not fill; what finds no room is lost.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "mmu/devices/frame_queue.hpp"
#include "mmu/devices/mmu.hpp"

namespace bmu {

/// Which frames of an answer a module leaves out.
enum class OmittedFrames : std::uint8_t { nothing, status, cells, temperatures, module, ident };

struct ModuleWireFaults {
  bool is_silent = false;
  bool has_damaged_frames = false;  // wrong checksum
  bool is_stuck = false;            // data bytes of each kind of frame for ever as they were last
  bool has_frozen_counter = false;  // for ever the counter that was sent last
  bool is_replaying = false;        // both: old answers, whole
  OmittedFrames omitted = OmittedFrames::nothing;
  std::optional<std::uint8_t> node;  // in its identifiers; it goes on listening to its own
  std::optional<std::uint8_t> cell_count;
  std::optional<std::uint8_t> temperature_sensor_count;
  std::optional<std::uint8_t> protocol_version;
  std::optional<std::uint32_t> serial_number;
  CellMask undervoltage_flags = 0;          // set in STATUS whatever the unit has found
  std::optional<CellMask> balancing_cells;  // switches as they stand, where they do not do what the unit wants
  Duration delay{};
};

class ModuleWire {
 public:
  static constexpr std::size_t frames_max = 128;

  void push(const MmuFrames& frames, const ModuleWireFaults& faults, TimePoint now);
  [[nodiscard]] std::optional<CanFrame> pop(TimePoint now) { return queue_.pop(now); }
  /// Frames are on their way.
  [[nodiscard]] bool is_sending() const { return !queue_.is_empty(); }

 private:
  struct Kept {
    FrameBytes data{};
    bool exists = false;
  };
  static constexpr std::size_t kinds = 16;  // an identifier is a kind, times 64, and a node

  [[nodiscard]] CanFrame changed(CanFrame frame, const ModuleWireFaults& faults);
  void change_answer(std::size_t kind, const ModuleWireFaults& faults, CanFrame& frame);

  std::array<Kept, kinds> kept_{};
  std::uint8_t counter_ = 0;  // of the last answer
  FrameQueue<frames_max> queue_;
};

}  // namespace bmu
