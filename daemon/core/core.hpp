// The core of the battery management unit: it receives observations and decides once a tick.
//
//   observe(o)    handles one observation; changes what is known, never what is commanded
//   decide(now)   in one fixed order: summarise, estimate, evaluate faults, permission, contactors, limits, polls and
//                 reports, all through the output gate
//
// Call decide() at Decisions::wake_at (every 10 ms, deadlines advance by the period), and immediately when observe()
// returns `decide_now`: opening never waits for the clock. Times are from one monotonic clock and never go back; a
// decide() more than `loop_gap_max` after the last one means that the control loop stalled: all values are invalidated
// and the contactors open first.
//
// The daemon's shell also reports the wall clock and the state of its own disk and memory; only records and warnings
// depend on them.
//
// No I/O, no clock, no log, no thread, no allocation. Identical observations and ticks give identical decisions. Cost:
// observe about 0.1 us a frame, decide about 30 us for 192 cells (docs/performance.md).
#pragma once

#include <array>
#include <optional>

#include "daemon/core/balancing/balancing_control.hpp"
#include "daemon/core/cell/cell_dynamics.hpp"
#include "daemon/core/charging/charge_control.hpp"
#include "daemon/core/charging/charge_pause.hpp"
#include "daemon/core/charging/charge_resume.hpp"
#include "daemon/core/contactors/auxiliary.hpp"
#include "daemon/core/contactors/close_request.hpp"
#include "daemon/core/contactors/command_link.hpp"
#include "daemon/core/contactors/contactor_ledger.hpp"
#include "daemon/core/contactors/contactor_watch.hpp"
#include "daemon/core/contactors/master_claim.hpp"
#include "daemon/core/contactors/output_gate.hpp"
#include "daemon/core/contactors/permission.hpp"
#include "daemon/core/contactors/precharge_guard.hpp"
#include "daemon/core/contactors/reclosing.hpp"
#include "daemon/core/contactors/rest_mode.hpp"
#include "daemon/core/decisions.hpp"
#include "daemon/core/estimation/cell_charge.hpp"
#include "daemon/core/estimation/health/pack_totals.hpp"
#include "daemon/core/estimation/pack_estimate.hpp"
#include "daemon/core/estimation/soc/coulomb_counter.hpp"
#include "daemon/core/faults/fault_memory.hpp"
#include "daemon/core/limits/limit_ramp.hpp"
#include "daemon/core/limits/limits.hpp"
#include "daemon/core/limits/pack_forecaster.hpp"
#include "daemon/core/limits/power_limits.hpp"
#include "daemon/core/measurement/charger_table.hpp"
#include "daemon/core/measurement/insulation_table.hpp"
#include "daemon/core/measurement/inverter_watch.hpp"
#include "daemon/core/measurement/module_table.hpp"
#include "daemon/core/measurement/pack_state.hpp"
#include "daemon/core/measurement/second_pack.hpp"
#include "daemon/core/measurement/sensor_setup.hpp"
#include "daemon/core/measurement/sensor_table.hpp"
#include "daemon/core/modules/command_turns.hpp"
#include "daemon/core/modules/module_assignment.hpp"
#include "daemon/core/modules/module_broadcasts.hpp"
#include "daemon/core/modules/module_roster.hpp"
#include "daemon/core/modules/module_rounds.hpp"
#include "daemon/core/modules/module_setup.hpp"
#include "daemon/core/modules/poll_pace.hpp"
#include "daemon/core/modules/poll_schedule.hpp"
#include "daemon/core/plausibility/charger_watch.hpp"
#include "daemon/core/plausibility/watchers.hpp"
#include "daemon/core/records/event_queue.hpp"
#include "daemon/core/records/persistent_state.hpp"
#include "daemon/core/types/core_config.hpp"
#include "daemon/core/types/observation.hpp"
#include "daemon/core/vehicle/cell_reporter.hpp"
#include "daemon/core/vehicle/cell_requests.hpp"
#include "daemon/core/vehicle/inverter_reporter.hpp"
#include "daemon/core/vehicle/report_vehicle.hpp"
#include "daemon/core/vehicle/vehicle_state.hpp"
#include "protocol/fields.hpp"
#include "protocol/receive_check.hpp"

namespace bmu {

/// Maximum stall of the control loop: after a longer one no value may count as fresh. Together with the 50 ms between
/// two contactor commands it is below the 200 ms after which the power distribution unit opens by itself: this node
/// never closes again what the PDU has opened.
inline constexpr Duration loop_gap_max = 130ms;
/// Time after the start at which a module, sensor or PDU that has not been received counts as lost.
inline constexpr Duration start_grace = 2s;
/// Delay of a tick above which it is reported as a warning; loop_gap_max is the limit for opening.
inline constexpr Duration tick_late = 50ms;
/// Delay of a single poll for a pending or implausible value after the last poll of the module: an earlier one would
/// return the same sample.
inline constexpr Duration ask_again_after = 15ms;
/// Interval of the identity polls of an unknown module, until it has answered.
inline constexpr Duration ask_stranger_every = 1s;
/// Minimum interval between commands to chargers, for those sent before their period is over: a reduction, or the
/// repetition of a command that was not sent. A stop does not wait.
inline constexpr Duration charger_at_once = 50ms;
/// Minimum deviation of the wall clock from its expected time that counts as a jump.
inline constexpr Duration clock_jump_min = 2s;

/// The last opening of closed contactors (or abort of a closing), and the chain of causes.
struct OpeningRecord {
  OpeningCause cause = OpeningCause::none;
  TimePoint at{};
  Phase from = Phase::open;
  FaultId fault{};    // for cause fault
  Blocker blocker{};  // for cause permission
  Reading reading;    // value, element and sample time of the cause; of a permission the element, if any
  std::int64_t threshold = 0;
  bool is_restored = false;     // fault of a previous session: reading and confirmation have no time
  TimePoint suspected_since{};  // first sample beyond the threshold
  TimePoint confirmed_at{};
  Measured<std::int32_t> current_mA;  // broken by the first main contactor; unknown if it was
};

/// The last close request that was refused.
struct RefusalRecord {
  bool has_happened = false;
  TimePoint at{};
  Blocker blocker{};
  FaultId fault{};  // of blocker `fault`: the first one that inhibits closing
  // Of the fault, at its confirmation; of `link_follows`, and of a fault that concerns the link (is_about_link), DC
  // link and pack voltage in mV, the latter two 0 if unknown.
  Reading reading;
  std::int64_t threshold = 0;
};

/// Result of the last closing.
struct PrechargeRecord {
  bool has_run = false;
  bool was_successful = false;
  PrechargeFailure failure = PrechargeFailure::none;
  TimePoint ended_at{};
  Duration took{};
  std::int32_t pack_mV = 0;
  std::int32_t link_mV = 0;
  std::int32_t current_mA = 0;
};

struct PortStatus {
  bool is_up = false;
  std::uint64_t frames_sent = 0;  // passed to the kernel; frames_echoed: transmitted on the bus
  std::uint64_t frames_echoed = 0;
  std::uint64_t sends_failed = 0;
  std::uint64_t frames_lost = 0;  // receive overruns
  std::uint64_t error_frames = 0;
  std::uint64_t times_down = 0;
};

class Core {
 public:
  /// `started_at`: first instant of this session. The ports count as down until reported otherwise. `first_counter`:
  /// start of the counters of all messages of this node. A receiver of the previous session accepts no frame with the
  /// last counter that it accepted, so each session starts with another counter, e.g. a random number.
  Core(const CoreConfig& config, TimePoint started_at, std::uint8_t first_counter = 0);

  /// Restores the state of previous sessions, if any; it also means that the state of this session will be saved. To be
  /// called before the first observation; latches apply from the first decision on.
  void restore(const PersistentState& state);
  /// State to be saved now. It has changed if `persistent_generation` has.
  [[nodiscard]] const PersistentState& persistent() const { return persistent_; }
  [[nodiscard]] std::uint32_t persistent_generation() const { return persistent_generation_; }

  Urgency observe(const Observation& observation);
  Decisions decide(TimePoint now);

  // Values and decisions, for the status socket and for tests. References stay valid; contents change with the next
  // observe or decide.
  /// As passed to the constructor, except `ages` of module data: those that apply at the present poll rate.
  [[nodiscard]] const CoreConfig& config() const { return config_; }
  [[nodiscard]] TimePoint started_at() const { return started_at_; }
  [[nodiscard]] TimePoint decided_at() const { return decided_at_; }
  [[nodiscard]] std::uint64_t ticks() const { return ticks_; }
  [[nodiscard]] const PackState& pack() const { return pack_; }
  [[nodiscard]] const ModuleTable& modules() const { return modules_; }
  [[nodiscard]] const SensorTable& sensors() const { return sensors_; }
  [[nodiscard]] const SensorSetup& sensor_setup() const { return sensor_setup_; }
  [[nodiscard]] const SensorSetup& second_sensor_setup() const { return second_sensor_setup_; }
  /// From the source in the pack file; unknown without a source, and while the value is stale or no temperature.
  [[nodiscard]] Temperature_dC intake_air_dC(TimePoint now) const;
  [[nodiscard]] const InsulationTable& insulation() const { return insulation_; }
  [[nodiscard]] const FaultMemory& faults() const { return faults_; }
  [[nodiscard]] const Permission& permission() const { return permission_; }
  [[nodiscard]] const SequenceState& sequence() const { return sequence_; }
  [[nodiscard]] const ContactorOutputs& outputs() const { return outputs_; }
  [[nodiscard]] const CurrentLimits& limits() const { return limits_; }
  /// Permissible power with these limits (power_limits.hpp has its cost).
  [[nodiscard]] PowerLimits power_limits() const;
  [[nodiscard]] const ChargeState& charge() const { return counter_.state(); }
  [[nodiscard]] const PackEstimate& estimate() const { return estimate_; }
  /// Over all sessions; none if they are not saved.
  [[nodiscard]] std::optional<PackTotals> totals() const {
    return has_memory_ ? std::optional(totals_with(former_totals_, counter_.state())) : std::nullopt;
  }
  /// Number of starts of a daemon with this pack in which the whole pack was received, including this one; none before
  /// that, and if it is not saved.
  [[nodiscard]] std::optional<std::uint32_t> starts() const {
    return is_start_counted_ ? std::optional(persistent_.starts) : std::nullopt;
  }
  [[nodiscard]] const ChargePause& charge_pause() const { return charge_pause_; }
  /// As published; none while it is unknown.
  [[nodiscard]] std::optional<std::int32_t> soc_permille() const;
  [[nodiscard]] const OpeningRecord& last_opening() const { return last_opening_; }
  /// End of the lockout: no contactor closes before.
  [[nodiscard]] TimePoint locked_out_until() const { return locked_out_until_; }
  [[nodiscard]] const RefusalRecord& last_refusal() const { return last_refusal_; }
  /// A key of the pack file that explains the fault, based on the values at `now`.
  [[nodiscard]] LikelyCause likely_cause(FaultId fault, TimePoint now) const;
  [[nodiscard]] const PrechargeRecord& last_precharge() const { return last_precharge_; }
  /// Of all frames on the internal bus, of any sender.
  [[nodiscard]] ReceiveCounts receive_counts() const;
  [[nodiscard]] const ReceiveCheck& receive_check() const { return check_; }
  /// Check of the frames of another manufacturer's modules; without such modules it accepts nothing.
  [[nodiscard]] const ReceiveCheck& foreign_check() const { return foreign_check_; }
  /// Voltage above which modules of another manufacturer are commanded to bleed; none: no bleeding, or bmud modules.
  [[nodiscard]] std::optional<std::int32_t> bleed_above_uV() const {
    return shutting_down_ ? std::nullopt : balancing_.bleed_above_uV(pack_);
  }
  [[nodiscard]] const PortStatus& port(Port port) const { return ports_[static_cast<std::size_t>(port)]; }
  [[nodiscard]] std::uint64_t events_dropped() const { return events_.dropped(); }
  [[nodiscard]] const ModuleSetup& module_setup() const { return setup_; }
  [[nodiscard]] const ModuleAssignment& assignment() const { return assignment_; }
  [[nodiscard]] const PollPacer& pace() const { return pace_; }
  [[nodiscard]] ModuleFinding finding(const ModuleRecord& module) const {
    return watchers_.roster.finding(module, modules_, decided_at_);
  }
  /// All contactors are commanded open, there is no close request and no shutdown: the nodes of the modules may be
  /// changed.
  [[nodiscard]] bool may_change_modules() const {
    return !outputs_.any_contactor() && !request_.is_present() && !shutting_down_;
  }
  /// A close request: an edge of vehicle-on or charger-connected since start or the last opening.
  [[nodiscard]] bool is_close_requested() const { return request_.is_present(); }
  [[nodiscard]] Wish wish() const { return {request_.is_by_vehicle(), request_.is_by_charger()}; }
  /// Precondition: `now` is not before the last observation.
  [[nodiscard]] ModeInputs mode_inputs(TimePoint now) const;
  [[nodiscard]] PackMode mode(TimePoint now) const { return pack_mode(mode_inputs(now)); }
  [[nodiscard]] const Watchers& watchers() const { return watchers_; }
  [[nodiscard]] const PrechargeGuard& precharge_guard() const { return guard_; }
  [[nodiscard]] const RestMode& rest() const { return rest_; }
  /// Whether this daemon commands the pack; the shell ends the process when the claim is lost.
  [[nodiscard]] const MasterClaim& claim() const { return claim_; }
  [[nodiscard]] const BalancingControl& balancing() const { return balancing_; }
  [[nodiscard]] const CellRequests::Counts& cell_requests() const { return requests_.counts(); }
  [[nodiscard]] const ChargerTable& chargers() const { return chargers_; }
  /// Last commanded current of a charger's unit.
  [[nodiscard]] std::int32_t ordered_mA(std::size_t unit) const { return ordered_mA_[unit]; }
  [[nodiscard]] const ChargeControl& charge_control() const { return charge_; }
  /// The charge resumes automatically when its charger is received again.
  [[nodiscard]] bool is_resume_pending() const { return charge_resume_.is_pending(); }
  [[nodiscard]] const ChargerWatch& charger_watch() const { return charger_watch_; }
  [[nodiscard]] const InverterWatch& inverter() const { return inverter_; }
  [[nodiscard]] bool is_inverter_silent() const { return inverter_.is_silent(decided_at_, flags_.closed_since); }
  /// Present report to the inverter.
  [[nodiscard]] BatteryReport inverter_report() const { return inverter_reporter_.report(inverter_view(decided_at_)); }
  [[nodiscard]] const SecondPack& second_pack() const { return second_pack_; }
  [[nodiscard]] const CellChargeBook& cell_charges() const { return cell_charges_; }
  [[nodiscard]] bool is_balancing_switched_off() const { return balancing_off_; }
  /// ms since 1970 at `at`; 0 while the wall clock is unknown.
  [[nodiscard]] std::int64_t unix_time_ms(TimePoint at) const;
  [[nodiscard]] std::uint64_t gate_refusals() const { return gate_refusals_; }
  /// Present rules of the output gate.
  [[nodiscard]] GateRules gate_rules() const;

 private:
  // observe, one overload per kind
  Urgency take(TimePoint at, const FrameReceived& what);
  Urgency take(TimePoint at, const FrameEchoed& what);
  Urgency take(TimePoint at, const SendFailed& what);
  Urgency take(TimePoint at, const PortChanged& what);
  Urgency take(TimePoint at, const FramesLost& what);
  Urgency take(TimePoint at, const BusErrorSeen& what);
  Urgency take(TimePoint at, const CommandGiven& what);
  Urgency take(TimePoint at, const WallClockSeen& what);
  Urgency take(TimePoint at, const HealthSeen& what);
  Urgency take(TimePoint at, const LinesSeen& what);
  Urgency take(TimePoint at, const PulsesSeen& what);
  Urgency take(TimePoint at, const ClaimBegins& what);
  [[nodiscard]] static Urgency urgency_of(const PduState& before, const PduState& now);
  Urgency take(TimePoint at, const IntakeAirSeen& what);
  void take_vehicle_frame(const CanFrame& frame, TimePoint at);
  void take_request(const CanFrame& request, TimePoint at);
  [[nodiscard]] bool is_battery_frame(const CanFrame& frame) const;
  Urgency take_rejected(const CheckedFrame& checked, const CanFrame& frame, TimePoint at);
  Urgency take_masters_frame(const CanFrame& frame, TimePoint at);
  [[nodiscard]] bool is_foreign_modules(const CanFrame& frame) const;
  [[nodiscard]] bool are_buses_swapped(TimePoint now) const;
  [[nodiscard]] bool is_internal_bus_silent(TimePoint at) const;
  Urgency take_foreign_frame(const CanFrame& frame, TimePoint at);
  Urgency take_foreign_rejected(const CheckedFrame& checked, const CanFrame& frame, TimePoint at);
  void note_sound_frame(TimePoint at);
  Urgency take_module_frame(const CheckedFrame& checked, const CanFrame& frame, TimePoint at);
  void take_stranger(const CheckedFrame& checked, const CanFrame& frame, TimePoint at);
  void note_set_up(SetupStage before, std::size_t index, std::uint8_t node, TimePoint at);
  void note_status(std::size_t index, const ModuleRecord& module, TimePoint at);
  void note_identity(const ModuleRecord& module, const Measured<ModuleIdentity>& before, TimePoint at);
  void note_identity_for_assignment(std::uint8_t node, std::uint32_t serial_number, TimePoint at);
  Urgency take_sensor_frame(const CheckedFrame& checked, const CanFrame& frame, TimePoint at);
  [[nodiscard]] std::optional<Urgency> take_foreign_current(const CanFrame& frame, TimePoint at);
  Urgency follow_current(TimePoint at);
  [[nodiscard]] bool is_foreign_sensor_command(const CanFrame& frame) const;
  Urgency take_foreign_sensor_command(const CanFrame& frame, TimePoint at);
  [[nodiscard]] bool take_sensor_answer(const CanFrame& frame, TimePoint at);
  [[nodiscard]] bool take_sensor_answer(SensorSetup& setup, const CanFrame& frame, TimePoint at);
  void note_sensor_setup(const SensorSetup& before, const SensorSetup& setup, TimePoint at);
  void note_sensor_set_up(const SensorSetup& setup, TimePoint at);

  // decide, in this order
  void check_loop_gap(TimePoint now);
  void follow_claim(TimePoint now);
  void estimate(TimePoint now);
  void follow_estimate(TimePoint now);
  void keep_estimate(TimePoint now);
  void keep_totals(bool is_last);
  void keep_hours_since_full(TimePoint now);
  void count_start();
  void follow_charges(TimePoint now);
  void keep_charges(TimePoint now);
  void follow_request(TimePoint now);
  void follow_pace(TimePoint now);
  [[nodiscard]] AgeConfig ages_now(TimePoint now) const;
  void follow_modules(TimePoint now);
  void accept_modules(TimePoint now);
  void forget_cells_of(std::uint8_t node);
  void begin_assignment(TimePoint now);
  void keep_roster();
  void follow_rest(TimePoint now);
  void watch_contactors(TimePoint now);
  void note_pdu_counter(std::uint8_t counter);
  void evaluate_faults(TimePoint now);
  void grant_permission(TimePoint now);
  void refuse_vain_request(TimePoint now);
  [[nodiscard]] RefusalRecord refusal_record(TimePoint now, Blocker blocker) const;
  void step_contactors(TimePoint now);
  void step_auxiliary(TimePoint now);
  void set_limits(TimePoint now);
  void charge(TimePoint now);
  void resume_charge(TimePoint now);
  void send_charger_commands(TimePoint now, Decisions& out);
  [[nodiscard]] ChargerOrder order_of_unit(std::size_t unit, TimePoint now) const;
  void follow_plug(TimePoint now);
  [[nodiscard]] bool may_request_mains() const;
  [[nodiscard]] bool is_hands_off(TimePoint now) const;
  [[nodiscard]] bool clears_charger_errors(std::size_t unit, TimePoint now);
  [[nodiscard]] bool has_way(Port port, TimePoint now) const;
  [[nodiscard]] bool asks_nobody() const { return rest_.is_resting() || !claim_.may_command(); }
  [[nodiscard]] bool has_to_balance() const;
  [[nodiscard]] bool is_bleeding() const;
  void send_contactor_command(TimePoint now, Decisions& out);
  void ask_sensor(SensorSetup& setup, TimePoint now, Decisions& out);
  void send_polls(TimePoint now, Decisions& out);
  void ask_foreign(TimePoint now, Decisions& out);
  void assign_node(TimePoint now, Decisions& out);
  [[nodiscard]] bool ask_again(TimePoint now, Decisions& out);
  void ask_missing(TimePoint now, Decisions& out);
  void ask_identity(std::uint8_t node, TimePoint now, Decisions& out);
  void balance(TimePoint now, Decisions& out);
  void order(const BalancingOrder& order, TimePoint now, Decisions& out);
  void send_waiting_orders(TimePoint now, Decisions& out);
  void send_broadcasts(TimePoint now, Decisions& out);
  void ask_alone(std::uint8_t node, AskAgain what, TimePoint now, Decisions& out);
  void send_report(TimePoint now, Decisions& out);
  void send_cell_data(TimePoint now, Decisions& out);
  void answer_request(TimePoint now, Decisions& out);
  void tell_inverter(TimePoint now, Decisions& out);

  void start_over(TimePoint at);
  TimePoint advance_tick(TimePoint now);
  [[nodiscard]] bool end_shut_down(TimePoint now);
  void update_bus_state(TimePoint at);
  void note_fault_changes(const FaultChanges& changes, TimePoint now);
  void note_phase(TimePoint now, const SequenceState& before, PrechargeFailure failure);
  void remember_closing(TimePoint now, bool has_moved);
  void record_opening(TimePoint now, Phase from, PrechargeFailure failure);
  [[nodiscard]] OpeningRecord opening_record(TimePoint now, Phase from, PrechargeFailure failure) const;
  void record_precharge(TimePoint now, TimePoint began_at, PrechargeFailure failure);
  void record_confirmed(FaultId id, TimePoint now);
  void record_cleared(FaultId id, TimePoint now);
  void touch_persistent() { ++persistent_generation_; }
  /// Sends a frame through the gate. False: not sent; a caller that depends on it must handle this.
  bool send(Port port, const CanFrame& frame, Decisions& out);
  [[nodiscard]] InverterLimits inverter_bounds() const;
  [[nodiscard]] FaultInputs fault_inputs(TimePoint now) const;
  [[nodiscard]] VehicleView vehicle_view(TimePoint now) const;
  [[nodiscard]] InverterView inverter_view(TimePoint now) const;
  [[nodiscard]] SequenceInputs sequence_inputs(TimePoint now) const;
  [[nodiscard]] bool link_follows_though_open() const;
  [[nodiscard]] bool pdu_fresh(TimePoint now) const;
  [[nodiscard]] bool inputs_healthy(TimePoint now) const;
  [[nodiscard]] bool insulation_known(TimePoint now) const;
  [[nodiscard]] bool wants_close() const { return request_.is_present() && !shutting_down_; }
  [[nodiscard]] bool has_started(TimePoint now) const;
  [[nodiscard]] bool could_ask(TimePoint now) const;
  [[nodiscard]] bool identities_known() const;
  [[nodiscard]] bool is_roster_in_order(TimePoint now) const;
  [[nodiscard]] ModeWish mode_wish(TimePoint now) const;
  [[nodiscard]] BalancingConditions balancing_conditions() const;

  CoreConfig config_;
  TimePoint started_at_;
  TimePoint view_began_at_;  // start, or when all values were last invalidated
  TimePoint decided_at_{};
  TimePoint next_tick_;
  std::uint64_t ticks_ = 0;

  ReceiveCheck check_;
  ReceiveCheck foreign_check_;
  ModuleTable modules_;
  SensorTable sensors_;
  CoulombCounter counter_;
  PackEstimate estimate_;
  TimePoint estimate_kept_at_{};  // zero: not yet in this session
  bool has_kept_last_ = false;    // the record at the end
  bool has_memory_ = false;       // the persistent state is saved
  PackTotals former_totals_;
  bool is_start_counted_ = false;
  ChargePause charge_pause_;
  CellChargeBook cell_charges_;
  TimePoint charges_looked_at_{};  // last check whether they are worth a record
  TimePoint charges_kept_at_{};    // zero: not yet in this session
  PackState pack_;
  FaultMemory faults_;
  PackMode mode_before_ = PackMode::open;  // before the faults of this tick
  CoreFlags flags_;
  Watchers watchers_;
  Permission permission_;
  SequenceState sequence_;
  ContactorWatch contactor_watch_;
  PrechargeGuard guard_;
  ContactorLedger ledger_;
  RestMode rest_;
  MasterClaim claim_;
  Auxiliary auxiliary_;
  ContactorOutputs outputs_;
  ContactorOutputs commanded_before_;  // with the last tick, auxiliary outputs included
  PackForecaster forecaster_;
  LimitRamps limit_ramps_;
  CurrentLimits limits_;
  PollSchedule poll_;
  ModuleRounds rounds_;
  PollPacer pace_;
  AgeConfig configured_ages_;
  TimePoint ages_slow_until_{};  // values polled at the `parked` rate are not yet replaced
  ModuleSetup setup_;
  CommandTurns turns_;
  ModuleBroadcasts broadcasts_;
  ModuleAssignment assignment_;
  BalancingControl balancing_;
  std::array<std::optional<BalancingOrder>, modules_max> waiting_orders_{};  // until the module is free
  VehicleReporter reporter_;
  CellReporter cell_reporter_;
  CellRequests requests_;
  SecondPack second_pack_;
  SensorSetup sensor_setup_;
  SensorSetup second_sensor_setup_;  // of a second one at 531h
  InsulationTable insulation_;
  ChargerTable chargers_;
  ChargerWatch charger_watch_;
  ChargeControl charge_;
  InverterWatch inverter_;
  InverterReporter inverter_reporter_;
  TimePoint charger_command_at_{};                            // the last; zero: none yet
  std::array<std::int32_t, charger_units_max> ordered_mA_{};  // of each unit, in that command
  bool was_enabled_ = false;                                  // in that command
  bool was_in_progress_ = false;                              // in that command
  bool is_plugged_in_ = false;                                // in the last fresh status
  TimePoint errors_cleared_at_{};                             // of chargers that latch them
  std::uint8_t errors_cleared_ = 0;                           // attempts, since it was plugged in
  ChargeResume charge_resume_;
  OpeningRecord last_opening_;
  RefusalRecord last_refusal_;
  PrechargeRecord last_precharge_;
  std::array<PortStatus, port_count> ports_{};
  EventQueue events_;  // raised in observe or decide, returned in order with the next decisions

  bool seen_complete_ = false;
  CloseRequest request_;
  bool clear_ours_ = false;                     // clear latched faults with the next decision
  CommandGiven clear_given_;                    // and its authority and user
  std::optional<CommandGiven> accept_given_{};  // with the next decision
  std::optional<CommandGiven> assign_given_{};
  TimePoint stranger_asked_at_{};
  bool balancing_off_ = false;  // by command
  bool is_bus_off_ = false;
  bool shutting_down_ = false;
  TimePoint shut_down_at_{};
  bool shut_down_told_ = false;
  TimePoint locked_out_until_{};
  Duration lockout_{};            // its full length when it started
  bool link_shows_weld_ = false;  // until the fault is confirmed
  TimePoint request_over_at_{};   // the last opening because the close request ended
  TimePoint outputs_changed_at_{};
  CommandLink command_link_;
  std::uint8_t command_counter_ = 0;
  std::uint8_t pdu_counter_ = 0;
  bool pdu_words_lost_ = false;  // possibly, on this host, since the last one
  std::uint64_t gate_refusals_ = 0;
  bool is_clock_known_ = false;
  Duration clock_offset_{};  // wall clock minus monotonic clock
  PersistentState persistent_;
  std::uint32_t persistent_generation_ = 0;
  /// The configuration is not restored, and the ages at the present poll rate follow from it.
  void after_reading_fields() { config_.ages = ages_now(decided_at_); }
  [[nodiscard]] bool are_fields_possible() const;
  BMU_FIELDS(skipped(config_), started_at_, view_began_at_, decided_at_, next_tick_, ticks_, check_, foreign_check_,
             modules_, sensors_, counter_, estimate_, estimate_kept_at_, has_kept_last_, has_memory_, former_totals_,
             is_start_counted_, charge_pause_, cell_charges_, charges_looked_at_, charges_kept_at_, pack_, faults_,
             mode_before_, flags_, watchers_, permission_, sequence_, contactor_watch_, guard_, ledger_, rest_, claim_,
             auxiliary_, outputs_, commanded_before_, forecaster_, limit_ramps_, limits_, poll_, rounds_, pace_,
             skipped(configured_ages_), ages_slow_until_, setup_, turns_, broadcasts_, assignment_, balancing_,
             waiting_orders_, reporter_, cell_reporter_, requests_, second_pack_, sensor_setup_, second_sensor_setup_,
             insulation_, chargers_, charger_watch_, charge_, inverter_, inverter_reporter_, charger_command_at_,
             ordered_mA_, was_enabled_, was_in_progress_, is_plugged_in_, errors_cleared_at_, errors_cleared_,
             charge_resume_, last_opening_, last_refusal_, last_precharge_, ports_, events_, seen_complete_, request_,
             clear_ours_, clear_given_, accept_given_, assign_given_, stranger_asked_at_, balancing_off_, is_bus_off_,
             shutting_down_, shut_down_at_, shut_down_told_, locked_out_until_, lockout_, link_shows_weld_,
             request_over_at_, outputs_changed_at_, command_link_, command_counter_, pdu_counter_, pdu_words_lost_,
             gate_refusals_, is_clock_known_, clock_offset_, persistent_, persistent_generation_)
};

}  // namespace bmu
