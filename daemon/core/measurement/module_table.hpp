// Latest values of the modules: each with its sample time and validity.
//
// Input: frames that passed the receive check, one at a time; a frame changes its own values and no others. The table
// makes no decisions: every consumer checks the age, and faults are raised elsewhere.
//
// Sample time of a voltage: with SYNC a module samples when its POLL arrives, so the time of the POLL is the sample
// time, unless the module's STATUS reports that its voltages are older, or of unknown age: then this applies. Voltages
// without their STATUS have no age and are not stored; the previous values become stale.
//
// Modules of another manufacturer do not report when they measured: their voltages count as older than the poll by the
// time that the driver gives (devices/module_driver.hpp). They do not report either which poll an answer belongs to, so
// an answer counts as one to the poll before the last if that is possible: if it comes too early for the last poll, or
// is a part that the poll before did not yield. This ambiguity lasts for one round: then the answer counts as lost,
// because it cannot be distinguished from answers that are late by a whole round permanently, and a value that is
// always a round older would open a healthy pack at the next loss. An ambiguous round is not a set of samples of one
// instant. Answers before the first poll for values are ignored. The STATUS of such a module contains only the few
// items that it reports.
//
// A temperature that jumps is `doubtful` until a later sample confirms it (jump_watch.hpp). The board sensors of a
// module are learned from its answers: a sensor that was ever anything but "not fitted" is expected from then on.
#pragma once

#include <array>
#include <cstdint>

#include "daemon/core/measurement/answer_times.hpp"
#include "daemon/core/measurement/jump_watch.hpp"
#include "daemon/core/types/core_config.hpp"
#include "daemon/core/types/measured.hpp"
#include "devices/module_driver.hpp"
#include "protocol/fields.hpp"
#include "protocol/message.hpp"
#include "protocol/receive_check.hpp"

namespace bmu {

/// State of a module as reported in STATUS. Masks have cell 1 in the lowest bit.
struct ModuleStatus {
  internal_bus::Mode mode = internal_bus::Mode::starting;
  bool on_module_supply = false;
  bool is_balancing = false;
  std::uint8_t cell_count = 0;
  bool limits_not_set = false;
  bool temperature_sensor_fault = false;
  bool restarted = false;
  bool external_supply_low = false;
  bool board_too_hot = false;
  bool open_cell_wire = false;
  bool self_test_failed = false;
  bool front_end_crc_errors = false;
  std::uint16_t undervoltage_cells = 0;
  std::uint16_t overvoltage_cells = 0;
  SignalValue voltage_age_ms;
  std::uint32_t maker_errors = 0;  // of another manufacturer's module: its error code; 0: none
};

/// State of a module's front end as reported in MODULE.
struct FrontEndStatus {
  bool is_reported = false;  // false: the other two have no meaning; older modules send 0
  bool is_supply_low = false;
  bool is_shut_down = false;  // by its temperature
};

struct ModuleIdentity {
  std::uint8_t protocol_version = 0;
  std::uint8_t cell_count = 0;
  std::uint8_t temperature_sensor_count = 0;
  std::uint32_t serial_number = 0;
};

struct ModuleRecord {
  ModuleConfig config;
  std::array<Measured<std::int32_t>, internal_bus::cells_per_module_max> cell_voltage_uV{};
  std::array<Measured<std::int32_t>, cell_sensors_max> cell_temperature_dC{};
  std::array<Measured<std::int32_t>, internal_bus::board_temperatures_per_module> board_temperature_dC{};
  std::uint8_t fitted_boards = 0;  // sensors, the first in the lowest bit; kept by forget_values()
  Measured<std::int32_t> module_voltage_mV;
  Measured<ModuleStatus> status;
  Measured<ModuleIdentity> identity;
  Measured<FrontEndStatus> front_end;  // never valid for modules of other manufacturers
  std::uint16_t balancing_cells = 0;
  TimePoint switches_read_at{};  // time of balancing_cells
  std::uint16_t open_wire_cells = 0;
  bool serial_number_known = false;  // kept by forget_values(), to detect a module replaced in the meantime
  std::uint32_t serial_number = 0;
  std::uint32_t rival_serial_number = 0;  // the other one at rival_seen_at, if it came with an IDENT; else 0
  TimePoint conflict_seen_at{};           // last answer that contradicts an accepted one; a single one may be chance
  TimePoint rival_seen_at{};  // last time two modules used this node number, or one was replaced in operation
  TimePoint last_answer_at{};
  std::uint16_t damaged_frames = 0;  // of the last ten with its identifiers: one bit each, the latest lowest
  TimePoint damaged_at{};
  AnswerTimes answer_times;  // from POLL to all modules to the last frame of the complete answer
  std::uint64_t answers_complete = 0;
  std::uint64_t answers_missed = 0;
  std::uint32_t restarts = 0;                                 // since its first complete answer
  std::uint32_t asked_alone = 0;                              // because a part of its answer was missing
  std::array<std::uint32_t, reject_reason_count> rejected{};  // frames with its identifiers, by RejectReason
  std::uint64_t values_out_of_range = 0;                      // impossible for this type of module; stored as invalid
  BMU_FIELDS(skipped(config), cell_voltage_uV, cell_temperature_dC, board_temperature_dC, fitted_boards,
             module_voltage_mV, status, identity, front_end, balancing_cells, switches_read_at, open_wire_cells,
             serial_number_known, serial_number, rival_serial_number, conflict_seen_at, rival_seen_at, last_answer_at,
             damaged_frames, damaged_at, answer_times, answers_complete, answers_missed, restarts, asked_alone,
             rejected, values_out_of_range)
};

/// Parts that a POLL requests, as the bits of its b1.
struct PollWants {
  bool status = true;
  bool cells = true;
  bool temperatures = true;
  bool module = true;
  bool identity = false;
};

/// Longer than the ten seconds between two identity polls, so that two modules that alternate under one node number are
/// one continuous conflict.
inline constexpr Duration conflict_memory = 15s;

class ModuleTable {
 public:
  /// Keeps no reference to the configuration.
  void init(const CoreConfig& config);

  /// The record of a node, or null if the pack has no such node.
  [[nodiscard]] const ModuleRecord* find(std::uint8_t node) const;
  /// Position of a node. Precondition: `find` has found it.
  [[nodiscard]] std::size_t index_of(std::uint8_t node) const { return index_of_node_[node]; }

  /// Handles a checked frame of an MMU; a node that is not part of this pack is ignored.
  void observe(const MessageSpec& message, std::uint8_t node, const CanFrame& frame, TimePoint at);
  /// The same for a checked frame of another manufacturer's module.
  void observe(const ModuleReport& report, TimePoint at);
  /// A POLL to all modules was sent: counts the answers to the last one that are missing and expects `wants` from now
  /// on.
  void begin_cycle(TimePoint at, const PollWants& wants);
  /// The same for a poll of all modules of another manufacturer; those of a start (`is_start`) expect no answer.
  void begin_round(TimePoint at, bool is_start);
  /// A POLL to one module was sent in addition to the cycle: its values are sampled at `at`. It ends an answer in
  /// progress, so it has to request the parts that were still missing.
  void begin_single(std::uint8_t node, TimePoint at);
  /// The next module with a part missing in this cycle that was not polled singly in it, once no module is sending;
  /// null: none, answers are still coming, or no module has answered at all, which is not the fault of a module.
  [[nodiscard]] const ModuleRecord* next_silent(TimePoint now) const;
  /// No module has answered since the last POLL to all modules.
  [[nodiscard]] bool is_silent() const { return heard_at_ == TimePoint{}; }
  /// The module is polled singly, with begin_single. The modules take turns over the cycles.
  void note_asked_alone(std::uint8_t node);
  /// Parts of the last cycle that are missing from a module.
  [[nodiscard]] PollWants outstanding(std::uint8_t node) const;
  /// When this node was last polled.
  [[nodiscard]] TimePoint polled_at(std::uint8_t node) const { return polled_at_[index_of_node_[node]]; }
  /// A module with an implausible temperature that a poll now would confirm or clear; 0: none.
  [[nodiscard]] std::uint8_t node_in_doubt(TimePoint now) const;
  /// A frame with this node's identifiers repeats the counter of the one already accepted, with other data. Conflicts
  /// between two polls of the node belong to one answer. One such answer occurs if a module was absent for a whole
  /// cycle of the counter; a second one within `conflict_memory` indicates two modules.
  void note_conflict(std::uint8_t node, TimePoint at);
  /// A frame with this node's identifiers was rejected.
  void note_rejected(std::uint8_t node, RejectReason reason);
  /// From now on another module may be on this node, and its serial number may differ from the previous one.
  void forget_identity(std::uint8_t node);
  /// A frame with this node's identifiers failed its checks.
  void note_damaged(std::uint8_t node, TimePoint at);
  /// All values become unknown: after an interruption of the core (stall, bus down, sleep) no previous value may count
  /// as fresh.
  void forget_values();

  /// A value of this frame reaches an opening threshold, or the module itself reports a failed cell or front end.
  [[nodiscard]] bool any_beyond(const CheckedFrame& checked, const LimitsConfig& limits) const;
  /// The same for the latest values of another manufacturer's module.
  [[nodiscard]] bool any_beyond(std::uint8_t node, const LimitsConfig& limits) const;
  /// Consecutive complete cycles, without a missed one between.
  [[nodiscard]] std::uint32_t complete_cycles() const { return complete_cycles_; }
  /// Discards the cycles so far: counting restarts with the next cycle.
  void requalify();
  /// POLL time of the last cycle that all modules answered; zero: none yet.
  [[nodiscard]] TimePoint completed_at() const { return completed_at_; }

  [[nodiscard]] const FixedVector<ModuleRecord, modules_max>& modules() const { return modules_; }

 private:
  void take_status(ModuleRecord& module, const CanFrame& frame, TimePoint at);
  static void take_cells(ModuleRecord& module, std::size_t block, const CanFrame& frame, TimePoint polled_at);
  void take_temperatures(std::size_t index, const MessageSpec& message, const CanFrame& frame, TimePoint at);
  void take_identity(ModuleRecord& module, const CanFrame& frame, TimePoint at) const;
  void note_answer(std::size_t index, std::uint32_t answer_bits, TimePoint at);
  void note_missed();
  void begin(TimePoint at);
  [[nodiscard]] bool is_too_soon(TimePoint at) const { return at - round_at_ < foreign_->answer_after; }
  [[nodiscard]] TimePoint question_for(std::size_t index, ModuleParts parts, TimePoint at) const;
  void take_report(std::size_t index, const ModuleReport& report, TimePoint asked_at);
  void take_cells_of(ModuleRecord& module, const ModuleReport& report, TimePoint asked_at) const;
  void take_temperatures_of(std::size_t index, const ModuleReport& report, TimePoint asked_at);
  void take_board(std::size_t index, std::size_t slot, const Measured<std::int32_t>& told, TimePoint asked_at);

  static constexpr std::uint8_t no_module = 0xFF;
  static constexpr std::size_t temperatures_per_module = cell_sensors_max + internal_bus::board_temperatures_per_module;

  const ModuleDriver* foreign_ = nullptr;  // null: bmud modules
  FixedVector<ModuleRecord, modules_max> modules_;
  std::array<std::uint8_t, internal_bus::node_count_max + 1> index_of_node_{};
  std::array<std::uint32_t, modules_max> expected_{};  // answer bits still missing in this cycle, by module
  std::array<TimePoint, modules_max> polled_at_{};
  // Of modules of another manufacturer: the last polls for values and those before; zero: none.
  TimePoint round_at_{};
  TimePoint round_before_at_{};
  std::array<ModuleParts, modules_max> owed_{};  // parts still missing after the polls before
  bool is_in_doubt_ = false;                     // this round, as an answer was incomplete when it started
  std::array<std::array<JumpWatch, temperatures_per_module>, modules_max> jumps_{};  // cell sensors, then board sensors
  std::array<bool, modules_max> asked_alone_{};                                      // in this cycle
  std::size_t next_turn_ = 0;  // the module that is checked first when an answer is missing
  TimePoint heard_at_{};       // the last frame of an answer in this cycle; zero: none yet
  bool is_counted_ = true;     // this cycle, when it is complete
  TimePoint cycle_began_at_{};
  TimePoint completed_at_{};
  std::uint32_t complete_cycles_ = 0;
  std::size_t modules_incomplete_ = 0;
  [[nodiscard]] bool are_fields_possible() const;
  BMU_FIELDS(skipped(foreign_), modules_, skipped(index_of_node_), expected_, polled_at_, round_at_, round_before_at_,
             owed_, is_in_doubt_, jumps_, asked_alone_, next_turn_, heard_at_, is_counted_, cycle_began_at_,
             completed_at_, complete_cycles_, modules_incomplete_)
};

}  // namespace bmu
