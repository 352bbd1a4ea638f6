#include "tools/common/virtual_run.hpp"

#include <algorithm>
#include <iterator>
#include <utility>
#include <variant>

namespace bmu {

// --- the core in the words of a script ------------------------------------------------------------------------------

namespace {

/// Causes of opening other than faults; a fault has its own name.
constexpr OpeningCause other_causes[] = {OpeningCause::none, OpeningCause::request_over, OpeningCause::shut_down,
                                         OpeningCause::precharge_retry, OpeningCause::permission};

std::vector<std::string_view> phase_words() {
  std::vector<std::string_view> words;
  words.reserve(all_phases.size());
  for (const Phase phase : all_phases) words.push_back(to_text(phase));
  return words;
}

std::vector<std::string_view> cause_words() {
  std::vector<std::string_view> words;
  words.reserve(std::size(other_causes) + fault_table().size());
  for (const OpeningCause cause : other_causes) words.push_back(to_text(cause));
  for (const FaultRow& row : fault_table()) words.push_back(row.name);
  return words;
}

std::uint16_t cause_index(const OpeningRecord& opening) {
  if (opening.cause == OpeningCause::fault) {
    return static_cast<std::uint16_t>(std::size(other_causes) + static_cast<std::size_t>(opening.fault));
  }
  const auto* const cause = std::find(std::begin(other_causes), std::end(other_causes), opening.cause);
  return static_cast<std::uint16_t>(cause - std::begin(other_causes));
}

CommandGiven command_of(const MasterOrder& order) {
  switch (order.property) {
    case Property::master_clear: return {.command = Command::clear_faults};
    case Property::master_clear_authorised: return {.command = Command::clear_faults, .authority = Authority::service};
    case Property::master_wake: return {.command = Command::wake};
    case Property::master_balancing:
      return {.command = order.word == 0 ? Command::balancing_off : Command::balancing_on};
    case Property::master_accept_modules: return {.command = Command::accept_modules, .authority = Authority::service};
    default: break;
  }
  BMU_ASSERT(false);
  return {};
}

bool is_frame(const Observation& observation) {
  return std::holds_alternative<FrameReceived>(observation.what) ||
         std::holds_alternative<FrameEchoed>(observation.what);
}

}  // namespace

MasterVocabulary core_vocabulary() {
  static const std::vector<std::string_view> phases = phase_words();
  static const std::vector<std::string_view> causes = cause_words();
  return {phases, causes};
}

MasterReport report_of(const Core& core) {
  return {.phase = static_cast<std::uint16_t>(core.sequence().phase), .opened_by = cause_index(core.last_opening())};
}

// --- the run --------------------------------------------------------------------------------------------------------

VirtualRun::VirtualRun(const SimulatorConfig& pack, Scenario scenario) : simulator_(pack, std::move(scenario), start) {}

VirtualRun::VirtualRun(const CoreConfig& master, const SimulatorConfig& pack, Scenario scenario)
    : VirtualRun(pack, std::move(scenario)) {
  core_.emplace(master, start);
  observe(PortChanged{Port::internal, true});
  observe(PortChanged{Port::vehicle, true});
  if (master.charger.driver != nullptr) observe(PortChanged{Port::charger, true});
  if (master.inverter.driver != nullptr) observe(PortChanged{Port::inverter, true});
  if (master.second_pack.base_id != 0) observe(PortChanged{Port::second_pack, true});
}

Urgency VirtualRun::give(const Observation& observation) {
  if (tap_ != nullptr) tap_->observed(observation);
  latest_at_ = observation.at;
  return core_->observe(observation);
}

void VirtualRun::observe(const ObservedThing& what) {
  const Observation observation{now_, what};
  if (stopped_at_ != TimePoint{}) return waiting_.push_back(observation);
  if (give(observation) == Urgency::decide_now) decide();
}

Port VirtualRun::serving(Port port) const {
  return core_->config().served_by[static_cast<std::size_t>(port)];
}

void VirtualRun::observe_guest(Port port, std::span<const SentFrame> frames) {
  for (const SentFrame& one : frames) observe(FrameReceived{serving(port), one.frame});
}

void VirtualRun::stop() {
  stopped_at_ = now_;
}

/// Delivers frames first, with the time before the stop; then the other observations with the present time.
void VirtualRun::go_on() {
  constexpr Duration lateness_max = 20ms;  // as in daemon/shell/loop.cpp
  const TimePoint stopped_at = std::exchange(stopped_at_, TimePoint{});
  const TimePoint before = latest_at_;
  const bool is_late = now_ - stopped_at > lateness_max;
  const bool discards = now_ - core_->decided_at() > loop_gap_max;
  std::vector<Observation> waiting = std::exchange(waiting_, {});
  const auto others = std::stable_partition(waiting.begin(), waiting.end(), is_frame);
  const auto frame_count = static_cast<std::uint64_t>(others - waiting.begin());
  if (discards) {
    waiting.erase(waiting.begin(), others);
    if (frame_count > 0) waiting.insert(waiting.begin(), {before, FramesLost{Port::internal, frame_count}});
  }
  bool is_due = now_ >= wake_at_;
  for (Observation& observation : waiting) {
    const bool is_of_stop = is_frame(observation) || std::holds_alternative<FramesLost>(observation.what);
    if (is_late) observation.at = is_of_stop ? before : now_;
    is_due = give(observation) == Urgency::decide_now || is_due;
  }
  if (is_due) decide();
}

void VirtualRun::give_orders() {
  for (const MasterOrder& order : simulator_.world().orders) observe(command_of(order));
  simulator_.world().orders.clear();
}

void VirtualRun::decide() {
  const Decisions decisions = core_->decide(now_);
  latest_at_ = now_;
  if (tap_ != nullptr) tap_->decided(now_, decisions);
  wake_at_ = decisions.wake_at;
  for (const Event& event : decisions.events) events_.push_back(event);
  for (const OutgoingFrame& out : decisions.frames) {
    if (out.port == Port::internal) {
      simulator_.observe(out.frame, now_);
      echoes_.push_back(out.frame);
    } else {
      simulator_.observe_elsewhere(serving(out.port), out.frame, now_);
    }
  }
  simulator_.script().note_master(report_of(*core_));
}

void VirtualRun::step() {
  now_ += Plant::step_length;
  for (const CanFrame& frame : std::exchange(echoes_, {})) observe(FrameEchoed{Port::internal, frame});
  const std::span<const SentFrame> sent = simulator_.advance(now_);
  if (!core_) return;
  give_orders();
  for (const SentFrame& one : sent) observe(FrameReceived{Port::internal, one.frame});
  observe_guest(Port::charger, simulator_.sent_by_charger());
  observe_guest(Port::inverter, simulator_.sent_by_inverter());
  observe_guest(Port::second_pack, simulator_.sent_by_second_pack());
  observe_guest(Port::vehicle, simulator_.sent_by_vehicle());
  if (now_ >= wake_at_ && stopped_at_ == TimePoint{}) decide();
}

}  // namespace bmu
