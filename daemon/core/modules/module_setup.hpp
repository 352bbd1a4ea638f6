// Gives every module the pack's limits, so that it protects its cells by our numbers when we are gone: the cell
// voltages, and the temperature of its board if the pack file names one.
//
//   needed --COMMAND set limits--> asked --RESPONSE done--> told --STATUS: limits set--> [board limit] --> done
//      ^                             |                       |
//      +---- it restarted -----------+- 200 ms: asked again -+
//
// Until a module has answered our COMMAND with "done", and says in STATUS that its limits are set, the pack may not
// close; the board limit has no word in STATUS, its RESPONSE alone counts. A COMMAND or RESPONSE that was lost is asked
// for again; one that was obeyed twice does no harm. A module that restarted, by its own word or because it says that
// its limits are not set, is set up anew at once, with the pack open or closed: a closed one stays closed, since the
// master goes on watching the cells, and the warning module_not_set_up tells of a module that does not take them.
//
// Modules of another maker take nothing of it: they count as set up, and the pack file's limits are the only ones
// (docs/foreign-modules.md).
//
// Set up, a module is told that it is normal and whether it may balance by itself where it is left alone with its own
// supply (balancing/autonomous); in STATUS there is no word for that either, its RESPONSE counts. It is told anew after
// a restart, when the answer to the question has changed, and when it calls itself autonomous for a second although it
// answers POLLs, which by the protocol make it normal. No more than once a second, and nobody waits for it to close.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "daemon/core/measurement/module_table.hpp"
#include "daemon/core/modules/command_turns.hpp"
#include "daemon/core/types/core_config.hpp"
#include "protocol/fields.hpp"
#include "protocol/fixed_vector.hpp"
#include "protocol/frame.hpp"

namespace bmu {

/// COMMANDs of one tick; more modules wait for the next.
inline constexpr std::size_t setup_commands_per_tick = 4;
/// An unanswered COMMAND is sent again after this.
inline constexpr Duration setup_retry = 200ms;
/// A module is not told its mode more often; nor before it has called itself autonomous for so long.
inline constexpr Duration mode_retry = 1s;

enum class SetupStage : std::uint8_t {
  needed,
  asked,
  told,          // it has answered "done"; its next STATUS has to say so, too
  board_needed,  // the same for the board's limit
  board_asked,
  done,
};

/// What modules are to be told of their mode.
struct ModeWish {
  bool may_tell = true;  // it is known what
  bool is_autonomous_balancing_allowed = false;
};

class ModuleSetup {
 public:
  /// Counters begin with `first_counter`.
  void init(const CoreConfig& config, std::uint8_t first_counter);
  /// Nobody counts as told: while nothing was heard, a module may have been swapped or restarted.
  void start_over();
  /// Nor does this one: another module has its number now.
  void start_over(std::size_t module_index) {
    slots_[module_index] = {.stage = first_stage_, .counter = slots_[module_index].counter};
  }
  /// What a module says of itself, from each STATUS. Returns the stage it led to.
  SetupStage observe_status(std::size_t module_index, const ModuleStatus& said, TimePoint at);
  /// A RESPONSE to our COMMAND. True if it refuses for the first time since it was last needed.
  bool observe_response(std::size_t module_index, const CanFrame& frame);
  /// COMMANDs that are due.
  [[nodiscard]] FixedVector<CanFrame, setup_commands_per_tick> step(TimePoint now, const ModuleTable& modules,
                                                                    const ModeWish& mode, CommandTurns& turns);
  /// Broadcast COMMANDs, which nobody answers: that all modules forget the failures they latched, stop balancing, or
  /// sleep (module_broadcasts.hpp).
  [[nodiscard]] CanFrame clear_faults();
  [[nodiscard]] CanFrame stop_balancing();
  [[nodiscard]] CanFrame sleep();
  /// That the module with this serial number takes this node; all others ignore it.
  [[nodiscard]] CanFrame set_node(std::uint32_t serial_number, std::uint8_t node);
  /// For the COMMANDs of others: a module hears one row of counters from us.
  [[nodiscard]] std::uint8_t next_counter(std::size_t module_index) { return slots_[module_index].counter++; }
  /// Every module has been told, and says so itself.
  [[nodiscard]] bool is_complete() const;
  [[nodiscard]] SetupStage stage(std::size_t module_index) const { return slots_[module_index].stage; }
  /// It has answered a COMMAND with anything but "done", and has not obeyed since.
  [[nodiscard]] bool is_refused(std::size_t module_index) const { return slots_[module_index].is_refused; }
  /// It has answered "done" to being told that it may balance by itself, and nothing else since.
  [[nodiscard]] bool is_autonomous_balancing_allowed(std::size_t module_index) const {
    return slots_[module_index].is_mode_told && slots_[module_index].is_allowed;
  }

 private:
  struct Slot {
    SetupStage stage = SetupStage::needed;
    bool is_refused = false;
    TimePoint asked_at{};
    std::uint8_t counter = 0;
    bool is_mode_told = false;  // and has said "done"
    bool is_mode_asked = false;
    bool is_allowed = false;  // what it was told or is being told
    TimePoint mode_asked_at{};
    TimePoint autonomous_since{};  // by its own word; zero: it is not
  };

  [[nodiscard]] CanFrame command_for(std::uint8_t node, Slot& slot) const;
  [[nodiscard]] static bool is_mode_due(const Slot& slot, const ModeWish& mode, TimePoint now);
  [[nodiscard]] static CanFrame mode_command(std::uint8_t node, const ModeWish& mode, TimePoint now, Slot& slot);

  std::array<Slot, modules_max> slots_{};
  std::uint8_t broadcast_counter_ = 0;
  std::size_t module_count_ = 0;
  std::int32_t undervoltage_uV_ = 0;
  std::int32_t overvoltage_uV_ = 0;
  std::optional<std::int32_t> board_limit_dC_{};
  SetupStage first_stage_ = SetupStage::needed;
  BMU_FIELDS(slots_, broadcast_counter_, skipped(module_count_), skipped(undervoltage_uV_), skipped(overvoltage_uV_),
             skipped(board_limit_dC_), skipped(first_stage_))
};

}  // namespace bmu
