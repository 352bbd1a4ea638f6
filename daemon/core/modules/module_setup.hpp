// Configures every module with the limits of the pack, so that it protects its cells by these if the master is lost:
// the cell voltages, and the temperature of its board if the pack file has one.
//
//   due --COMMAND set limits--> sent --RESPONSE done--> acknowledged --STATUS: limits set--> [board limit] --> done
//    ^                           |                           |
//    +-------- restarted --------+---- 200 ms: sent again ---+
//
// Until a module has answered this node's COMMAND with "done", and reports in STATUS that its limits are set, the pack
// must not close; for the board limit STATUS has no signal, only its RESPONSE counts. A COMMAND or RESPONSE that was
// lost is repeated; executing one twice has no effect. A module that restarted, as it reports or because it reports
// that its limits are not set, is configured again immediately, with the pack open or closed: a closed one stays
// closed, since the master continues to monitor the cells, and the warning module_not_set_up reports a module that does
// not accept them.
//
// Modules of another manufacturer accept none of this: they count as configured, and only the limits of the pack file
// apply (docs/foreign-modules.md).
//
// Once configured, a module is commanded to mode normal, with the permission to balance autonomously when it is without
// master and powered by its cells (balancing/autonomous); STATUS has no signal for that either, its RESPONSE counts.
// The command is sent again after a restart, when the permission has changed, and when the module reports mode
// autonomous for a second although it answers POLLs, which by the protocol set it to normal. At most once a second, and
// closing does not wait for it.
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

/// Maximum number of COMMANDs per tick; further modules wait for the next tick.
inline constexpr std::size_t setup_commands_per_tick = 4;
/// Timeout after which an unanswered COMMAND is sent again.
inline constexpr Duration setup_retry = 200ms;
/// Minimum interval of mode commands, and time for which a module must report mode autonomous before one is sent.
inline constexpr Duration mode_retry = 1s;

enum class SetupStage : std::uint8_t {
  needed,
  asked,
  told,          // RESPONSE "done" received; its next STATUS has to confirm it
  board_needed,  // the same for the limit of the board
  board_asked,
  done,
};

/// Mode and permission to be set in the modules.
struct ModeWish {
  bool may_tell = true;  // the permission is known
  bool is_autonomous_balancing_allowed = false;
};

class ModuleSetup {
 public:
  /// Counters start with `first_counter`.
  void init(const CoreConfig& config, std::uint8_t first_counter);
  /// Resets all modules: while nothing was received, a module may have been replaced or restarted.
  void start_over();
  /// Resets one module: another module has its number now.
  void start_over(std::size_t module_index) {
    slots_[module_index] = {.stage = first_stage_, .counter = slots_[module_index].counter};
  }
  /// Handles the state in each STATUS of a module. Returns the resulting stage.
  SetupStage observe_status(std::size_t module_index, const ModuleStatus& said, TimePoint at);
  /// Handles a RESPONSE to a COMMAND of this node. True for the first refusal since the module was last configured.
  bool observe_response(std::size_t module_index, const CanFrame& frame);
  /// COMMANDs that are due.
  [[nodiscard]] FixedVector<CanFrame, setup_commands_per_tick> step(TimePoint now, const ModuleTable& modules,
                                                                    const ModeWish& mode, CommandTurns& turns);
  /// Broadcast COMMANDs, which no module answers: clear latched failures in all modules, stop balancing, or sleep
  /// (module_broadcasts.hpp).
  [[nodiscard]] CanFrame clear_faults();
  [[nodiscard]] CanFrame stop_balancing();
  [[nodiscard]] CanFrame sleep();
  /// Assigns this node to the module with this serial number; all others ignore it.
  [[nodiscard]] CanFrame set_node(std::uint32_t serial_number, std::uint8_t node);
  /// Counter for COMMANDs that other classes build: a module expects one sequence of counters from the master.
  [[nodiscard]] std::uint8_t next_counter(std::size_t module_index) { return slots_[module_index].counter++; }
  /// Every module has been configured, and its STATUS confirms it.
  [[nodiscard]] bool is_complete() const;
  [[nodiscard]] SetupStage stage(std::size_t module_index) const { return slots_[module_index].stage; }
  /// It has answered a COMMAND with anything but "done", and has not been configured since.
  [[nodiscard]] bool is_refused(std::size_t module_index) const { return slots_[module_index].is_refused; }
  /// Its last mode command permitted autonomous balancing, and was answered with "done".
  [[nodiscard]] bool is_autonomous_balancing_allowed(std::size_t module_index) const {
    return slots_[module_index].is_mode_told && slots_[module_index].is_allowed;
  }

 private:
  struct Slot {
    SetupStage stage = SetupStage::needed;
    bool is_refused = false;
    TimePoint asked_at{};
    std::uint8_t counter = 0;
    bool is_mode_told = false;  // and answered with "done"
    bool is_mode_asked = false;
    bool is_allowed = false;  // permission sent last
    TimePoint mode_asked_at{};
    TimePoint autonomous_since{};  // as reported in STATUS; zero: not autonomous
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
