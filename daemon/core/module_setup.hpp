// Gives every module the pack's cell limits, so that it protects its cells by our numbers when we are gone.
//
// A module says in STATUS that its limits were not set since its restart. Until it has answered our COMMAND with "done"
// and says so no longer, the pack may not close.
#pragma once

#include <array>
#include <cstdint>

#include "daemon/core/core_config.hpp"
#include "daemon/core/module_table.hpp"
#include "protocol/fixed_vector.hpp"
#include "protocol/frame.hpp"

namespace bmu {

/// COMMANDs of one tick; more modules wait for the next.
inline constexpr std::size_t setup_commands_per_tick = 4;
/// An unanswered COMMAND is sent again after this.
inline constexpr Duration setup_retry = 200ms;

enum class SetupStage : std::uint8_t {
  needed,
  asked,
  told,  // it has answered "done"; its next STATUS has to say so, too
  done,
  refused,
};

class ModuleSetup {
 public:
  void init(const CoreConfig& config);
  /// Nobody counts as told: while nothing was heard, a module may have been swapped or restarted.
  void start_over();
  /// What a module says of its limits, from each STATUS. Returns the stage it led to.
  SetupStage observe_status(std::size_t module_index, bool limits_not_set);
  /// A RESPONSE to our COMMAND. Returns the stage it led to.
  SetupStage observe_response(std::size_t module_index, const CanFrame& frame);
  /// COMMANDs that are due.
  [[nodiscard]] FixedVector<CanFrame, setup_commands_per_tick> step(TimePoint now, const ModuleTable& modules);
  /// Broadcast COMMANDs, which nobody answers: that all modules forget the failures they latched, and that all sleep.
  [[nodiscard]] CanFrame clear_faults();
  [[nodiscard]] CanFrame sleep();
  /// Every module has been told, and says so itself.
  [[nodiscard]] bool is_complete() const;
  [[nodiscard]] SetupStage stage(std::size_t module_index) const { return slots_[module_index].stage; }

 private:
  struct Slot {
    SetupStage stage = SetupStage::needed;
    TimePoint asked_at{};
    std::uint8_t counter = 0;
  };

  std::array<Slot, modules_max> slots_{};
  std::uint8_t broadcast_counter_ = 0;
  std::size_t module_count_ = 0;
  std::int32_t undervoltage_uV_ = 0;
  std::int32_t overvoltage_uV_ = 0;
};

}  // namespace bmu
