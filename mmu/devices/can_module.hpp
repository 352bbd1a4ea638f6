// One emulated third-party module, in any protocol: it measures by itself, answers questions, and bleeds the cells
// above the voltage that it receives, by its own decision.
//
//   observe(frame, now)          at once, for every frame on its bus
//   is_sample_due(now)           whether it measures now; then sample(measured, now)
//   tick(faults, now)            every millisecond: starts its answers, subject to the faults of its wire
//   pop(now)                     the next frame that is due, or none; repeated until none
//
//   question ---- answer_delay ----> status, cells, ... a frame each frame_spacing
//                                    (modules that are polled together: one after the other)
//
// The values of an answer were measured up to a round of the car earlier, ModuleDriver::sample_age_max, because the
// master does not control when such a module measures. Before its first sample it sends nothing. An answer is sent
// completely even if the next question has arrived; questions beyond `questions_max` unanswered ones are dropped.
//
// Unknown, and assumed here: that it continues to bleed for `bleeds_on_for` without master and then stops; that the
// questions of a start, which have an unknown meaning, are answered like any other; and the value sent for a sensor or
// wire that is off (devices/measured_value.hpp). A cell reads lower while it is bled by the voltage that its resistor's
// current leaves on the wires; one recording shows 40 mV on one cell of twelve and nothing on the others. A cell is
// bled until it reads this much below the received voltage; otherwise it would be switched on and off permanently.
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
  const ModuleDriver* driver = nullptr;  // null: the modules are MMUs
  ModuleOptions options;
  Duration frame_spacing = 250us;
  Duration bleeds_on_for = 10s;            // since its last question
  std::int32_t bled_reads_low_uV = 2'000;  // 0 to 100'000
};

/// Delay from a question to the first answer: twice the minimum, 30 ms in an Outlander; some milliseconds if an answer
/// may follow at once.
[[nodiscard]] constexpr Duration answer_delay(const ModuleDriver& driver) {
  constexpr Duration least = 3ms;
  return std::max(2 * driver.answer_after, least);
}

/// Whether modules of this kind have frames of that group, which can be omitted.
[[nodiscard]] bool has_frames(const ModuleDriver& driver, OmittedFrames group);

class CanModule {
 public:
  static constexpr std::size_t questions_max = 4;
  /// Half a second of answers to a question every 24 ms.
  static constexpr std::size_t frames_max = 192;

  /// Preconditions: `config.driver` is set, `node` 1 to its node_max. `place`: number of modules that answer before
  /// this one.
  CanModule(const CanModuleConfig& config, std::uint8_t node, std::size_t place, TimePoint powered_at);

  void observe(const CanFrame& frame, TimePoint now);
  [[nodiscard]] bool is_sample_due(TimePoint now) const { return sampling_.is_due(now); }
  /// Stores `measured` except its bleeding cells, which the module determines itself.
  void sample(const ModuleMeasurements& measured, TimePoint now);
  void tick(const ModuleWireFaults& faults, TimePoint now);
  [[nodiscard]] std::optional<CanFrame> pop(TimePoint now) { return leaving_.pop(now); }
  /// Whether it was polled and has not sent all of its answer yet.
  [[nodiscard]] bool is_answering() const { return !questions_.is_empty() || !leaving_.is_empty(); }

  /// Commanded state of its switches.
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
  TimePoint asked_at_{};  // last question
  FrameQueue<questions_max> questions_;
  FrameQueue<frames_max> leaving_;
  // Of the last answer.
  ModuleMeasurements said_;
  std::uint8_t counter_ = 0;
  std::uint64_t answers_given_ = 0;
};

}  // namespace bmu
