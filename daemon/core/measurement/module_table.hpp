// What the modules last said: every value with the time it was taken and whether it is one.
//
// Fed with frames that passed the receive check, one at a time; a frame changes its own values and no others. Nothing
// here judges: age is asked by who uses a value, faults are raised elsewhere.
//
// When a voltage was taken: with SYNC a module samples as its POLL arrives, so the POLL's time is the sample's time,
// unless the module's STATUS admits that its voltages are older, or of unknown age: then they count as such. Voltages
// whose STATUS did not arrive say nothing about their age and are not taken over; what was known before grows old.
//
// Modules of another maker say nothing of when they measured: their voltages count as older than the question that
// brought them by as much as the driver says (devices/module_driver.hpp). Nor do they say which question that was, so
// an answer counts as one to the question before the last where it may be: what comes too soon for the last one, and
// what is of a part that the question before brought nothing of. Such a doubt lasts for one round: then the answer is
// taken for lost, as it cannot be told from one that is late by a whole round for ever, and a value that is always a
// round older would open a healthy pack with the next loss. The round in doubt is no picture of one moment. What comes
// before a first question for values is nobody's answer. Their status says what they know of themselves, which is
// little.
//
// A temperature that jumps is `doubtful` until a later sample says so, too (jump_watch.hpp). Which board sensors a
// module has is learned from itself: one that was ever anything but "not fitted" is expected from then on.
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

/// What a module says about itself in STATUS. Masks have cell 1 in the lowest bit.
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
  std::uint32_t maker_errors = 0;  // of a foreign module: its own word for what is wrong; 0: nothing
};

/// What a module's front end reports of itself, in MODULE.
struct FrontEndStatus {
  bool is_reported = false;  // without, the other two mean nothing: a module built before them sends 0
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
  std::uint8_t fitted_boards = 0;  // sensors, the first lowest; kept when all else is forgotten
  Measured<std::int32_t> module_voltage_mV;
  Measured<ModuleStatus> status;
  Measured<ModuleIdentity> identity;
  Measured<FrontEndStatus> front_end;  // of a foreign module: never valid
  std::uint16_t balancing_cells = 0;
  TimePoint switches_read_at{};  // when that was told
  std::uint16_t open_wire_cells = 0;
  bool serial_number_known = false;  // kept when all else is forgotten: a module swapped meanwhile is noticed
  std::uint32_t serial_number = 0;
  std::uint32_t rival_serial_number = 0;  // the other one of rival_seen_at, if it came with an IDENT; else 0
  TimePoint conflict_seen_at{};           // last answer that contradicts one already accepted; once may be chance
  TimePoint rival_seen_at{};  // when two modules last spoke under this node number, or one was swapped while live
  TimePoint last_answer_at{};
  std::uint16_t damaged_frames = 0;  // of its last ten under its identifiers: one bit each, the latest lowest
  TimePoint damaged_at{};
  AnswerTimes answer_times;  // POLL to everybody, to the last frame of the complete answer
  std::uint64_t answers_complete = 0;
  std::uint64_t answers_missed = 0;
  std::uint32_t restarts = 0;                                 // since it first answered in full
  std::uint32_t asked_alone = 0;                              // because something of its answer was missing
  std::array<std::uint32_t, reject_reason_count> rejected{};  // frames under its identifiers, by RejectReason
  std::uint64_t values_out_of_range = 0;                      // that nobody of its kind can have; taken for no values
  BMU_FIELDS(skipped(config), cell_voltage_uV, cell_temperature_dC, board_temperature_dC, fitted_boards,
             module_voltage_mV, status, identity, front_end, balancing_cells, switches_read_at, open_wire_cells,
             serial_number_known, serial_number, rival_serial_number, conflict_seen_at, rival_seen_at, last_answer_at,
             damaged_frames, damaged_at, answer_times, answers_complete, answers_missed, restarts, asked_alone,
             rejected, values_out_of_range)
};

/// Bits of what a POLL asks for, as in its b1.
struct PollWants {
  bool status = true;
  bool cells = true;
  bool temperatures = true;
  bool module = true;
  bool identity = false;
};

/// Longer than the ten seconds between two questions for the identity, so that two modules which take turns under one
/// node number are one lasting conflict.
inline constexpr Duration conflict_memory = 15s;

class ModuleTable {
 public:
  /// Keeps no reference to the configuration.
  void init(const CoreConfig& config);

  /// The record of a node, or null if the pack has no such node.
  [[nodiscard]] const ModuleRecord* find(std::uint8_t node) const;
  /// Position of a node that `find` found.
  [[nodiscard]] std::size_t index_of(std::uint8_t node) const { return index_of_node_[node]; }

  /// Takes over a checked frame of an MMU; a node that is not part of this pack is ignored.
  void observe(const MessageSpec& message, std::uint8_t node, const CanFrame& frame, TimePoint at);
  /// The same of a foreign module's frame that passed its checks.
  void observe(const ModuleReport& report, TimePoint at);
  /// A POLL to everybody went out: counts what the last one left unanswered and expects `wants` from now on.
  void begin_cycle(TimePoint at, const PollWants& wants);
  /// The same of questions to all foreign modules; those a start begins with (`is_start`) expect nothing.
  void begin_round(TimePoint at, bool is_start);
  /// A POLL to one module went out, beside the cycle: what it brings is of `at`. It ends an answer that was still under
  /// way, so it has to want what that had still to bring.
  void begin_single(std::uint8_t node, TimePoint at);
  /// The next module that owes something of this cycle, now that nobody speaks any more, and was not asked alone in it;
  /// null: there is none, answers still come, or nobody has answered at all, which is no module's fault.
  [[nodiscard]] const ModuleRecord* next_silent(TimePoint now) const;
  /// Nobody has said a word since the last POLL to everybody.
  [[nodiscard]] bool is_silent() const { return heard_at_ == TimePoint{}; }
  /// It is asked alone, with begin_single. Modules take turns over the cycles.
  void note_asked_alone(std::uint8_t node);
  /// What a module still owes from the last cycle.
  [[nodiscard]] PollWants outstanding(std::uint8_t node) const;
  /// When this node was polled last.
  [[nodiscard]] TimePoint polled_at(std::uint8_t node) const { return polled_at_[index_of_node_[node]]; }
  /// A module with a doubtful temperature that it would confirm or take back if asked now; 0: none.
  [[nodiscard]] std::uint8_t node_in_doubt(TimePoint now) const;
  /// A frame under this node's identifiers repeats the counter of the one already accepted, with other bytes. Those
  /// between two questions to the node are one answer. One answer like that is what a module leaves that was away for a
  /// whole circle of the counter; a second one means that there are two.
  void note_conflict(std::uint8_t node, TimePoint at);
  /// A frame under this node's identifiers was refused.
  void note_rejected(std::uint8_t node, RejectReason reason);
  /// Who is on the node may be another one from now on, and need not be the same as before.
  void forget_identity(std::uint8_t node);
  /// A frame under this node's identifiers that failed its checks.
  void note_damaged(std::uint8_t node, TimePoint at);
  /// All values become unknown: after a gap in our own life nothing seen before may count as fresh.
  void forget_values();

  /// One of the values that this frame brought reaches an opening threshold, or the module itself flags a failed cell
  /// or front end.
  [[nodiscard]] bool any_beyond(const CheckedFrame& checked, const LimitsConfig& limits) const;
  /// The same of whatever a foreign module has said last.
  [[nodiscard]] bool any_beyond(std::uint8_t node, const LimitsConfig& limits) const;
  /// Complete cycles in a row, without a missed one between.
  [[nodiscard]] std::uint32_t complete_cycles() const { return complete_cycles_; }
  /// The cycles so far prove nothing: counting starts again with the next one that begins.
  void requalify();
  /// The POLL time of the last cycle that everybody answered; zero while there was none.
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

  const ModuleDriver* foreign_ = nullptr;  // null: the modules are ours
  FixedVector<ModuleRecord, modules_max> modules_;
  std::array<std::uint8_t, internal_bus::node_count_max + 1> index_of_node_{};
  std::array<std::uint32_t, modules_max> expected_{};  // answer bits still missing in this cycle, by module
  std::array<TimePoint, modules_max> polled_at_{};
  // Of foreign modules: the last questions for values and those before; zero: none.
  TimePoint round_at_{};
  TimePoint round_before_at_{};
  std::array<ModuleParts, modules_max> owed_{};  // nothing of these came to the questions before
  bool is_in_doubt_ = false;                     // this round, as somebody owed something when it began
  std::array<std::array<JumpWatch, temperatures_per_module>, modules_max> jumps_{};  // cell sensors, then the board's
  std::array<bool, modules_max> asked_alone_{};                                      // in this cycle
  std::size_t next_turn_ = 0;  // the module that is first looked at when somebody is silent
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
