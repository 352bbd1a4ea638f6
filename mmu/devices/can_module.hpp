// One emulated module of another maker, whatever language it speaks: it measures by itself, answers what it is asked,
// and bleeds those cells that are above the voltage it is told, by its own decision.
//
//   observe(frame, now)          at once, for every frame on its bus
//   is_sample_due(now)           whether it measures now; then sample(measured, now)
//   tick(faults, now)            every millisecond: its answers begin, as the faults of its wire say
//   pop(now)                     the next frame whose time has come, or nothing; until it says nothing
//
//   question ---- answer_delay ----> status, cells, ... a frame each frame_spacing
//                                    (modules that are asked together: one after the other)
//
// What an answer says was measured up to a round of the car earlier, ModuleDriver::sample_age_max: nobody tells such a
// module when to measure. Before its first sample it says nothing. An answer is given in full although the next
// question has come; questions beyond `questions_max` unanswered ones are not heard.
//
// Not known, and made up here: that it goes on bleeding for `bleeds_on_for` when its master falls silent and then
// stops; that a start with questions of which nobody knows the meaning is answered like any other; and what it says of
// a sensor or wire that is off (devices/measured_value.hpp). How much lower a cell reads while it is bled is what its
// resistor's current leaves on the wires; one recording shows 40 mV on one cell of twelve and nothing on the others. A
// cell is bled until it reads so much below what was told, or it would be switched on and off for ever.
//
// Pure; about 10 kB of state, most of it frames that a script delays.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

#include "devices/module_driver.hpp"
#include "mmu/devices/frame_queue.hpp"
#include "mmu/devices/mode.hpp"
#include "mmu/devices/module_wire.hpp"
#include "mmu/devices/periodic.hpp"
#include "mmu/devices/sampling.hpp"

namespace bmu {

struct CanModuleConfig {
  const ModuleDriver* driver = nullptr;  // null: the modules are ours
  ModuleOptions options;
  Duration frame_spacing = 250us;
  Duration bleeds_on_for = 10s;            // since its last question
  std::int32_t bled_reads_low_uV = 2'000;  // 0 to 100'000
};

/// How long after a question the first of them answer. Twice the soonest that can be: 30 ms in an Outlander; where an
/// answer may come at once, some milliseconds.
[[nodiscard]] constexpr Duration answer_delay(const ModuleDriver& driver) {
  constexpr Duration least = 3ms;
  return std::max(2 * driver.answer_after, least);
}

/// Whether modules of this kind have frames of that group, to leave them out.
[[nodiscard]] bool has_frames(const ModuleDriver& driver, OmittedFrames group);

class CanModule {
 public:
  static constexpr std::size_t questions_max = 4;
  /// Half a second of answers to a question every 24 ms.
  static constexpr std::size_t frames_max = 192;

  /// `config.driver` is there. `node` 1 to its node_max; `place` counts the modules that answer before this one.
  CanModule(const CanModuleConfig& config, std::uint8_t node, std::size_t place, TimePoint powered_at);

  void observe(const CanFrame& frame, TimePoint now);
  [[nodiscard]] bool is_sample_due(TimePoint now) const { return sampling_.is_due(now); }
  /// `measured` but for its bleeding cells, which this knows itself.
  void sample(const ModuleMeasurements& measured, TimePoint now);
  void tick(const ModuleWireFaults& faults, TimePoint now);
  [[nodiscard]] std::optional<CanFrame> pop(TimePoint now) { return leaving_.pop(now); }
  /// It has been asked, and has not yet sent all of its answer.
  [[nodiscard]] bool is_answering() const { return !questions_.is_empty() || !leaving_.is_empty(); }

  /// What it wants of its switches.
  [[nodiscard]] CellMask bleeding_cells() const { return bleeding_; }
  [[nodiscard]] UnitMode mode() const { return has_sample_ ? UnitMode::normal : UnitMode::starting; }
  [[nodiscard]] std::uint64_t answers_given() const { return answers_given_; }

 private:
  [[nodiscard]] CellMask cells_to_bleed() const;
  void answer(const ModuleQuestion& question, const ModuleWireFaults& faults, TimePoint now);
  void refresh_words(const ModuleWireFaults& faults);

  CanModuleConfig config_;
  std::uint8_t node_;
  Duration answer_delay_;
  Periodic sampling_;
  ModuleMeasurements sample_;
  bool has_sample_ = false;
  CellMask bleeding_ = 0;
  std::optional<std::int32_t> bleed_above_uV_{};
  TimePoint asked_at_{};  // last
  FrameQueue<questions_max> questions_;
  FrameQueue<frames_max> leaving_;
  // Of the last answer.
  ModuleMeasurements said_;
  std::uint8_t counter_ = 0;
  std::uint64_t answers_given_ = 0;
};

}  // namespace bmu
