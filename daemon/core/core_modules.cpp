// Stages of the core for the modules: their identities, poll rate, polls and commands.
#include <algorithm>
#include <utility>

#include "daemon/core/core.hpp"
#include "protocol/tables/internal_bus.hpp"

namespace bmu {

namespace {

/// A current changes quickly if it moves by this much within this time: a tenth of the continuous current, and at least
/// an ampere, as for a current step that shows resistances.
constexpr Duration current_change_within = 200ms;
std::int64_t current_change_mA(const CoreConfig& config) {
  return std::max(1'000, config.current.discharge_continuous_mA / 10);
}

}  // namespace

/// The faults are those of the last tick, which is soon enough: a pending fault causes single polls by itself.
void Core::follow_pace(TimePoint now) {
  const auto any_fault = [this](auto holds) {
    return std::any_of(faults_.states().begin(), faults_.states().end(), holds);
  };
  const PollPace before = pace_.pace();
  const PollPace pace = pace_.step(
      {.now = now,
       .is_open = !outputs_.any_contactor(),
       .is_wanted = request_.is_present() || could_ask(now) || assignment_.is_asking(),
       .is_bleeding = watchers_.switches.is_any_told() || watchers_.switches.is_any_on(),
       .is_settled = seen_complete_ && pack_.is_complete() && identities_known() && setup_.is_complete(),
       .is_suspected = any_fault([](const FaultState& state) { return state.is_doubtful(); }),
       .is_near_limit = any_fault([](const FaultState& state) { return state.is_warning; }),
       .changes_current = sensors_.current_window.swing_mA(now - current_change_within) >= current_change_mA(config_)});
  if (before == PollPace::parked && pace != PollPace::parked) {
    modules_.requalify();
    poll_.hurry();
    ages_slow_until_ = now + std::max(configured_ages_.cell_voltage, configured_ages_.module_status);
  }
  config_.ages = ages_now(now);
}

AgeConfig Core::ages_now(TimePoint now) const {
  const bool is_slow = now < ages_slow_until_;
  return ages_at(is_slow ? PollPace::parked : pace_.pace(), configured_ages_, config_.poll);
}

void Core::follow_modules(TimePoint now) {
  if (accept_given_) accept_modules(now);
  if (assign_given_) begin_assignment(now);
  // A module that may have been registered is not replaced by the one that is present.
  const bool may_remember = !flags_.health.store_unreadable && !assignment_.is_asking() &&
                            !faults_.state(FaultId::store_unreadable).is_present();
  if (may_remember && watchers_.roster.remember(modules_, now)) keep_roster();
  flags_.module_not_set_up = flags_.balancing_refused = 0;
  for (std::size_t index = modules_.modules().size(); index-- > 0;) {
    const std::uint8_t node = modules_.modules()[index].config.node;
    if (setup_.stage(index) != SetupStage::done) flags_.module_not_set_up = node;
    if (balancing_.has_failed(index)) flags_.balancing_refused = node;
  }
}

void Core::accept_modules(TimePoint now) {
  const CommandGiven given = *std::exchange(accept_given_, std::nullopt);
  if (given.authority != Authority::service || !may_change_modules()) return;
  for (const ModuleRecord& module : modules_.modules()) {
    const bool is_meant = given.node == 0 || given.node == module.config.node;
    if (!is_meant || finding(module).place == ModulePlace::expected) continue;
    if (!watchers_.roster.accept(module, now)) continue;
    forget_cells_of(module.config.node);
    events_.push({.id = EventId::module_accepted,
                  .at = now,
                  .reading = {.element = {.module_node = module.config.node}},
                  .number = module.identity.value.serial_number});
  }
  keep_roster();
}

void Core::begin_assignment(TimePoint now) {
  const CommandGiven given = *std::exchange(assign_given_, std::nullopt);
  if (given.authority != Authority::service) return;
  const ModuleRoster& roster = watchers_.roster;
  const std::uint8_t node = given.node;
  const ModuleRecord* there = modules_.find(node);
  const bool is_module_there =
      there != nullptr && there->last_answer_at != TimePoint{} && now - there->last_answer_at <= stranger_memory;
  const KnownModule named = node <= internal_bus::node_count_max ? roster.named_by_file(node) : KnownModule{};
  const AssignmentRefusal refusal = assignment_.ask(
      {.serial_number = given.serial_number, .node = node, .is_unheard_allowed = given.is_unheard_allowed},
      {.is_shutting_down = shutting_down_,
       .is_open = !outputs_.any_contactor(),
       .is_close_requested = request_.is_present() || could_ask(now),
       .is_bus_up = flags_.internal_bus_up,
       .is_resting = rest_.is_resting(),
       .node_now = roster.node_of(given.serial_number, modules_, now),
       .is_node_taken = is_module_there || (node <= internal_bus::node_count_max && roster.is_stranger(node, now)),
       .is_named_otherwise = named.is_known && named.serial_number != given.serial_number,
       .are_modules_ours = are_modules_ours(config_)},
      now);
  if (refusal == AssignmentRefusal::none) modules_.forget_identity(node);
}

void Core::keep_roster() {
  if (persistent_.modules == watchers_.roster.known()) return;
  persistent_.modules = watchers_.roster.known();
  touch_persistent();
}

/// Polls all modules in one tick, as the manufacturer's master does.
void Core::ask_foreign(TimePoint now, Decisions& out) {
  const ModuleDriver& driver = *config_.foreign.driver;
  if (!flags_.internal_bus_up || !rounds_.is_due(now, pace_.period())) return;
  ModuleQuestion question{.is_start = rounds_.is_start()};
  if (!question.is_start) question.bleed_above_uV = bleed_above_uV();
  const bool is_idle = !question.is_start && !question.bleed_above_uV;
  if (is_idle && pack_.cell_voltage_uV.is_complete()) question.idle_target_uV = pack_.cell_voltage_uV.min;
  modules_.begin_round(now, question.is_start);
  const std::size_t questions = driver.asks_each ? modules_.modules().size() : 1;
  bool have_left = true;
  for (std::size_t index = 0; index < questions; ++index) {
    if (driver.asks_each) question.node = modules_.modules()[index].config.node;
    const CanFrame frame = driver.ask(question, rounds_.count(), config_.foreign.options);
    have_left = send(Port::internal, frame, out) && have_left;
  }
  rounds_.begin(now, question.bleed_above_uV.has_value());
  if (!have_left) rounds_.note_failed();
}

void Core::send_polls(TimePoint now, Decisions& out) {
  if (command_link_.is_stuck(now) || asks_nobody()) return;
  if (!are_modules_ours(config_)) return ask_foreign(now, out);
  assign_node(now, out);
  const Poll poll = poll_.step(now, pace_.period(), identities_known());
  if (poll.is_due) {
    modules_.begin_cycle(now, poll.wants);
    check_.note_sent(poll.frame);
    send(Port::internal, poll.frame, out);
  } else if (!ask_again(now, out)) {
    ask_missing(now, out);
  }
  send_waiting_orders(now, out);
  for (const CanFrame& command : setup_.step(now, modules_, mode_wish(now), turns_)) {
    check_.note_sent(command);
    send(Port::internal, command, out);
  }
}

BalancingConditions Core::balancing_conditions() const {
  const bool has_fault = std::any_of(fault_table().begin(), fault_table().end(), [this](const FaultRow& row) {
    return faults_.state(row.id).is_present() &&
           reaction_of(row, config_.stricter_reactions).reaction != Reaction::warn;
  });
  return {.config = &config_,
          .pack = &pack_,
          .modules = &modules_,
          .phase = sequence_.phase,
          .is_switched_off = balancing_off_,
          .is_shutting_down = shutting_down_,
          .is_resting = rest_.is_resting(),
          .internal_bus_up = flags_.internal_bus_up,
          .has_fault = has_fault,
          .modules_set_up = setup_.is_complete()};
}

/// After contactors and polls, and only if a COMMAND can be sent: otherwise the commanded state must not change.
void Core::balance(TimePoint now, Decisions& out) {
  const BalancingBlockers blockers = balancing_blockers(balancing_conditions(), balancing_.blockers());
  if (command_link_.is_stuck(now) || asks_nobody()) return;
  const BalancingStep step = balancing_.step({.now = now,
                                              .modules = &modules_,
                                              .pack = &pack_,
                                              .steps = &watchers_.steps,
                                              .charges = &cell_charges_,
                                              .blockers = blockers},
                                             watchers_.switches);
  for (const BalancingOrder& wanted : step.orders) order(wanted, now, out);
  if (step.has_begun) {
    events_.push({.id = EventId::balancing_began, .at = now, .number = balancing_.cells_told()});
  }
  if (step.was_stopped) {
    events_.push({.id = EventId::balancing_stopped,
                  .at = now,
                  .number = static_cast<std::int64_t>(first_of(balancing_.blockers()))});
  }
  if (step.unanswered_node != 0) {
    events_.push({.id = EventId::module_ignores_balancing, .at = now, .number = step.unanswered_node});
  }
}

/// One COMMAND to a module at a time: a balancing command waits for the RESPONSE to the previous one.
void Core::order(const BalancingOrder& order, TimePoint now, Decisions& out) {
  if (order.module_index == BalancingOrder::to_all) {
    waiting_orders_ = {};
    return broadcasts_.stop();
  }
  std::optional<BalancingOrder>& waiting = waiting_orders_[order.module_index];
  waiting.reset();
  if (!turns_.is_free(order.module_index, now)) {
    waiting = order;
    return;
  }
  turns_.note_sent(order.module_index, now);
  const CanFrame frame = balancing_frame(order, modules_.modules()[order.module_index].config.node,
                                         setup_.next_counter(order.module_index));
  check_.note_sent(frame);
  send(Port::internal, frame, out);
}

/// A waiting command is stored at the index of its module.
bool Core::are_fields_possible() const {
  for (std::size_t index = 0; index < waiting_orders_.size(); ++index) {
    const std::optional<BalancingOrder>& waiting = waiting_orders_[index];
    if (waiting && (waiting->module_index != index || index >= modules_.modules().size())) return false;
  }
  return true;
}

/// Before the configuration continues: a stop waits for one RESPONSE at most.
void Core::send_waiting_orders(TimePoint now, Decisions& out) {
  for (const std::optional<BalancingOrder>& waiting : waiting_orders_) {
    if (!waiting || !turns_.is_free(waiting->module_index, now)) continue;
    const BalancingOrder due = *waiting;
    order(due, now, out);
  }
}

void Core::send_broadcasts(TimePoint now, Decisions& out) {
  // Modules of another manufacturer have no such commands; without polls they send nothing and bleed nothing.
  const bool has_bus = flags_.internal_bus_up && claim_.may_command();
  if (command_link_.is_stuck(now) || !has_bus || !are_modules_ours(config_)) return;
  const ModuleBroadcasts::Step step = broadcasts_.step(now);
  if (step.says_stop) send(Port::internal, setup_.stop_balancing(), out);
  if (step.says_clear) send(Port::internal, setup_.clear_faults(), out);
  if (step.says_sleep) send(Port::internal, setup_.sleep(), out);
  if (step.stays_awake) events_.push({.id = EventId::modules_stay_awake, .at = now});
  if (!step.asks) return;
  const CanFrame frame =
      poll_.single(0, {.status = true, .cells = false, .temperatures = false, .module = false, .identity = false});
  check_.note_sent(frame);
  send(Port::internal, frame, out);
}

/// A module with a pending value is polled singly and immediately: two samples confirm, without waiting for the next
/// cycle. So is one with an implausible temperature, as soon as it has taken another sample.
bool Core::ask_again(TimePoint now, Decisions& out) {
  for (const FaultRow& row : fault_table()) {
    const FaultState& state = faults_.state(row.id);
    const std::uint8_t node = state.latest.element.module_node;
    const bool is_asked =
        row.ask_again != AskAgain::no && state.is_doubtful() && state.latest.is_known && modules_.find(node) != nullptr;
    if (!is_asked || now - modules_.polled_at(node) < ask_again_after) continue;
    ask_alone(node, row.ask_again, now, out);
    return true;  // one a tick
  }
  const std::uint8_t node = modules_.node_in_doubt(now);
  if (node == 0 || now - modules_.polled_at(node) < ask_again_after) return false;
  ask_alone(node, AskAgain::temperatures, now, out);
  return true;
}

/// A module with a missing answer after all others have answered is polled singly, so that one lost frame does not lose
/// the cycle. An unknown module is polled for its identity.
void Core::ask_missing(TimePoint now, Decisions& out) {
  const ModuleRecord* silent = modules_.next_silent(now);
  if (silent != nullptr && poll_.may_ask_silent(now, pace_.period())) {
    modules_.note_asked_alone(silent->config.node);
    return ask_alone(silent->config.node, AskAgain::no, now, out);
  }
  if (modules_.is_silent() && poll_.is_answer_over(now)) poll_.hurry();
  const std::uint8_t stranger = watchers_.roster.unidentified_stranger(now);
  // Only with the fault confirmed: a poll ends the answer in progress, by which the module is detected.
  const bool is_told = faults_.state(FaultId::unknown_module).is_present();
  if (stranger == 0 || !is_told || now - stranger_asked_at_ < ask_stranger_every) return;
  stranger_asked_at_ = now;
  ask_identity(stranger, now, out);
}

void Core::assign_node(TimePoint now, Decisions& out) {
  const AssignmentRequest& request = assignment_.request();
  const ModuleAssignment::Step step = assignment_.step(now);
  if (step.sends_command) send(Port::internal, setup_.set_node(request.serial_number, request.node), out);
  if (step.asks_node) ask_identity(request.node, now, out);
  if (!step.has_ended) return;
  events_.push({.id = EventId::module_node_not_taken,
                .at = now,
                .reading = {.element = {.module_node = request.node}},
                .number = request.serial_number});
}

void Core::ask_identity(std::uint8_t node, TimePoint now, Decisions& out) {
  PollWants wants = modules_.outstanding(node);
  wants.identity = true;
  const CanFrame frame = poll_.single(node, wants);
  modules_.begin_single(node, now);
  check_.note_sent(frame);
  send(Port::internal, frame, out);
}

/// Also requests the parts that are missing from the module's last answer.
void Core::ask_alone(std::uint8_t node, AskAgain what, TimePoint now, Decisions& out) {
  PollWants wants = modules_.outstanding(node);
  wants.status = true;
  wants.cells = wants.cells || what == AskAgain::cells;
  wants.temperatures = wants.temperatures || what == AskAgain::temperatures;
  const CanFrame frame = poll_.single(node, wants);
  modules_.begin_single(node, now);
  check_.note_sent(frame);
  send(Port::internal, frame, out);
}

/// Modules that never send an identity are not waited for.
bool Core::identities_known() const {
  if (!are_modules_ours(config_)) return true;
  return std::all_of(modules_.modules().begin(), modules_.modules().end(),
                     [](const ModuleRecord& module) { return module.identity.is_valid(); });
}

/// Each module has reported the serial number that is expected on its node, and is alone there.
bool Core::is_roster_in_order(TimePoint now) const {
  return std::all_of(modules_.modules().begin(), modules_.modules().end(), [&](const ModuleRecord& module) {
    return watchers_.roster.finding(module, modules_, now).place == ModulePlace::expected && !has_rival(module, now);
  });
}

/// A module without master acts by the last permission: none is given before the identities are known.
ModeWish Core::mode_wish(TimePoint now) const {
  const bool is_wanted = config_.balancing.is_autonomous_allowed;
  return {.may_tell = !is_wanted || identities_known(),
          .is_autonomous_balancing_allowed = is_wanted && is_roster_in_order(now)};
}

}  // namespace bmu
