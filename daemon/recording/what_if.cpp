#include "daemon/recording/what_if.hpp"

#include <algorithm>
#include <cstdlib>
#include <initializer_list>
#include <limits>

namespace bmu {

namespace {

/// Equal events within this time are the same event: one core may be a sample or two behind the other.
constexpr std::int64_t match_us = 500'000;
/// A smaller change is an adjustment of the clock.
constexpr std::int64_t clock_setting_min_us = 1'000'000;
/// Contactors that close later than this close at another time: the recorded measurements no longer match.
constexpr std::int64_t closing_match_us = 50'000;
/// Contactors that open at another tick may open for another reason, e.g. because the recorded ones have opened.
constexpr std::int64_t opening_match_us = 5'000;
/// A tick that the recording's core also has follows within this time after it is due.
constexpr Duration tick_late_max = 20ms;
constexpr Duration urgent_late_max = 1ms;
/// 620h to 628h, or as shifted by the configuration.
constexpr std::uint32_t vehicle_report_count = 9;
/// An echo that the recording also has follows within this time.
constexpr Duration echo_late_max = 5ms;

bool same_contactors(const ContactorOutputs& one, const ContactorOutputs& other) {
  return one.main_positive == other.main_positive && one.main_negative == other.main_negative &&
         one.precharge == other.precharge && one.charge == other.charge;
}

/// Not the precharge contactor, which opens while the pack closes.
bool opens_one(const ContactorOutputs& now, const ContactorOutputs& before) {
  return (before.main_positive && !now.main_positive) || (before.main_negative && !now.main_negative) ||
         (before.charge && !now.charge);
}

/// "contactors opened from closed: a cell's voltage is too low", without the cell and its value; "" for other texts.
std::string_view cause_of_opening(std::string_view text) {
  if (!text.starts_with("contactors opened ")) return "";
  const std::size_t cause = text.find(": ");
  return cause == std::string_view::npos ? text : text.substr(0, text.find(": ", cause + 2));
}

/// An opening for this cause, or the fault that caused it. Others may result from the recorded contacts, which moved
/// before.
bool is_about(std::string_view cause, std::string_view text) {
  constexpr std::string_view fault = "fault: ";
  if (!text.starts_with(fault)) return cause_of_opening(text) == cause;
  return cause.ends_with(text.substr(fault.size(), text.find(": ", fault.size()) - fault.size()));
}

std::size_t index_of(Port port) {
  return static_cast<std::size_t>(port);
}

using NamedOutput = std::pair<bool, const char*>;

std::string words_of(std::string text, std::initializer_list<NamedOutput> outputs, const char* none) {
  bool is_any_on = false;
  for (const auto& [is_on, word] : outputs) {
    if (is_on) text += word;
    is_any_on = is_any_on || is_on;
  }
  return is_any_on ? text : text + none;
}

std::string contactors_text(const ContactorOutputs& outputs) {
  return words_of("contactors:",
                  {{outputs.main_negative, " main_negative"},
                   {outputs.precharge, " precharge"},
                   {outputs.main_positive, " main_positive"},
                   {outputs.charge, " charge"}},
                  " all open");
}

std::string others_text(const ContactorOutputs& outputs) {
  return words_of("outputs:", {{outputs.auxiliary, " auxiliary"}, {outputs.fan, " fan"}, {outputs.heater, " heater"}},
                  " all off");
}

}  // namespace

bool WhatIf::take(std::string_view line) {
  const RecordReader::Took took = reader_.take(line);
  counts_.lines = reader_.lines();
  switch (took) {
    case RecordReader::Took::nothing: break;
    case RecordReader::Took::part: return begin_part();
    case RecordReader::Took::tick:
      if (reader_.alteration() && options_.altered) options_.altered(*reader_.alteration());
      follow_clock(true);
      take_tick(reader_.tick().at);
      break;
    case RecordReader::Took::of_tick: take_of_tick(); break;
    case RecordReader::Took::observation:
      follow_clock(true);
      take_observation(reader_.observation());
      break;
    case RecordReader::Took::problem: problem_ = reader_.problem(); return false;
  }
  return true;
}

/// Differences of both courses are matched by their times: a setting of the clock between them is no elapsed time.
void WhatIf::follow_clock(bool goes_on) {
  const std::int64_t set_by_us = reader_.clock().ahead_us - clock_ahead_us_;
  if (set_by_us == 0) return;
  clock_ahead_us_ += set_by_us;
  if (!goes_on) clock_set_by_us_ = 0;
  if (goes_on && std::abs(set_by_us) >= clock_setting_min_us) clock_set_by_us_ += set_by_us;
}

bool WhatIf::begin_part() {
  follow_clock(counts_.begun > 0 && reader_.continues());
  ++counts_.begun;
  if (core_ != nullptr && reader_.continues() && !has_parted_) return true;
  const auto config = options_.other(*reader_.pack());
  if (!config) {
    problem_ = {.kind = RecordProblemKind::other_pack, .line = reader_.lines(), .text = config.error()};
    return false;
  }
  auto core = reader_.make_core(*config);
  if (!core) {
    problem_ = core.error();
    return false;
  }
  auto recorded_core = reader_.make_core(reader_.pack()->core);
  if (!recorded_core) {
    problem_ = recorded_core.error();
    return false;
  }
  core_ = std::move(*core);
  recorded_core_ = std::move(*recorded_core);
  outputs_ = recorded_outputs_ = core_->outputs();
  has_parted_ = false;
  unmatched_.clear();
  wake_at_ = TimePoint{};
  recorded_due_at_ = latest_at_ = TimePoint{};
  urgent_at_ = TimePoint{};
  echoes_.clear();
  reports_.clear();
  takes_frames_.fill(true);
  answers_.begin(reader_.pack()->core.poll);
  counts_.last = TimePoint{};
  return true;
}

// --- observations of both --------------------------------------------------------------------------------------------

void WhatIf::take_observation(const Observation& observation) {
  ++counts_.observations;
  if (has_parted_) return;
  // An observation that waited while the host was stalled has the time of the one before (loop.cpp).
  has_waited_ = observation.at <= latest_at_;
  latest_at_ = std::max(latest_at_, observation.at);
  decide_if_left_alone(observation.at);
  give_late_echoes(observation.at);
  give_answers(observation.at);
  observe_as_recorded(observation);
  if (const auto* const received = std::get_if<FrameReceived>(&observation.what)) {
    return take_frame(observation, *received);
  }
  if (const auto* const echo = std::get_if<FrameEchoed>(&observation.what)) {
    return take_echo(observation, *echo);
  }
  if (const auto* const failed = std::get_if<SendFailed>(&observation.what)) {
    takes_frames_[index_of(failed->port)] = false;
    return;
  }
  if (const auto* const lost = std::get_if<FramesLost>(&observation.what)) {
    std::erase_if(echoes_, [lost](const Echo& own) { return own.sent.port == lost->port; });
  }
  if (const auto* const port = std::get_if<PortChanged>(&observation.what)) {
    takes_frames_[index_of(port->port)] = port->is_up;
  }
  observe(observation);
}

/// An observation that waited is known no sooner than at the recording's next tick.
void WhatIf::observe(const Observation& observation) {
  if (core_->observe(observation) == Urgency::decide_now && urgent_at_ == TimePoint{}) {
    urgent_at_ = has_waited_ ? TimePoint::max() : observation.at;
  }
}

void WhatIf::observe_as_recorded(const Observation& observation) {
  if (recorded_core_->observe(observation) == Urgency::decide_now) {
    recorded_due_at_ = std::min(recorded_due_at_, observation.at);
  }
}

void WhatIf::take_frame(const Observation& observation, const FrameReceived& received) {
  if (received.port != Port::internal) return observe(observation);
  if (const auto heard = answers_.hear(received.frame, observation.at)) {
    observe({.at = observation.at, .what = FrameReceived{.port = received.port, .frame = *heard}});
  }
}

/// Answers of modules that only the second core polled.
void WhatIf::give_answers(TimePoint now) {
  if (!takes_frames_[index_of(Port::internal)]) return;
  while (const auto frame = answers_.next_due(now)) {
    observe({.at = now, .what = FrameReceived{.port = Port::internal, .frame = *frame}});
  }
}

/// The echo of a frame that the second core has sent as well has its recorded time; others are not passed on.
void WhatIf::take_echo(const Observation& observation, const FrameEchoed& echo) {
  takes_frames_[index_of(echo.port)] = true;
  const auto same =
      std::find_if(echoes_.begin(), echoes_.end(), [&](const Echo& own) { return own.sent.frame == echo.frame; });
  if (same == echoes_.end()) return;
  echoes_.erase(same);
  observe(observation);
}

void WhatIf::give_late_echoes(TimePoint now) {
  while (!echoes_.empty() && now - echoes_.front().at > echo_late_max) {
    const OutgoingFrame sent = echoes_.front().sent;
    echoes_.pop_front();
    if (takes_frames_[index_of(sent.port)]) {
      observe({.at = now, .what = FrameEchoed{.port = sent.port, .frame = sent.frame}});
    } else {
      observe({.at = now, .what = SendFailed{.port = sent.port, .frame = sent.frame}});
    }
  }
}

// --- decisions -------------------------------------------------------------------------------------------------------

/// Together with the recording's core where both have to decide, so that the same observations precede both decisions.
void WhatIf::take_tick(TimePoint at) {
  if (has_parted_) return;
  decide_if_left_alone(at);
  if (wake_at_ <= at || urgent_at_ != TimePoint{}) decide(at);
  decide_as_recorded(at);
  latest_at_ = std::max(latest_at_, at);
  tell_unmatched(log_us(at) - match_us);
}

/// A loop that waits longer than loop_gap_max was stalled, whatever wake-up time the core of a damaged recording
/// requests: a file with times years apart ends as soon as any other.
void WhatIf::decide_as_recorded(TimePoint at) {
  at = std::max(at, recorded_core_->decided_at());
  recorded_due_at_ = std::min(recorded_core_->decide(at).wake_at, at + loop_gap_max);
}

/// Only until a tick of the recording's loop is due: from then on its host is stalled, and that of this core would have
/// been, too. Both decide with the recording's next tick, and with its first one.
void WhatIf::decide_if_left_alone(TimePoint now) {
  const bool is_urgent = urgent_at_ != TimePoint{} && urgent_at_ < recorded_due_at_;
  if (is_urgent && now - urgent_at_ > urgent_late_max) decide(urgent_at_ + urgent_late_max);
  while (wake_at_ != TimePoint{} && wake_at_ < recorded_due_at_ && now - wake_at_ > tick_late_max) decide(wake_at_);
}

void WhatIf::decide(TimePoint at) {
  at = std::max(at, core_->decided_at());
  const Decisions decisions = core_->decide(at);
  count_tick(counts_, at, reader_.clock());
  urgent_at_ = TimePoint{};
  wake_at_ = decisions.wake_at;
  for (const OutgoingFrame& sent : decisions.frames) {
    echoes_.push_back({.at = at, .sent = sent});
    reports_[sent.frame.id] = sent.frame;
    if (sent.port == Port::internal) answers_.note_now(sent.frame, at);
  }
  add_outputs(decisions.outputs, outputs_, {.log_us = log_us(at)});
  for (const Event& event : decisions.events) add({.log_us = log_us(at), .text = to_text(event)});
}

// --- differences -----------------------------------------------------------------------------------------------------

void WhatIf::take_of_tick() {
  if (has_parted_) return;
  const std::int64_t at_us = log_us(reader_.tick().at);
  if (const auto* const sent = std::get_if<RecordSent>(&reader_.line())) {
    if (sent->sent.port == Port::internal) answers_.note_then(sent->sent.frame, reader_.tick().at);
    compare_report(sent->sent);
  }
  if (const auto* const outputs = std::get_if<RecordOutputs>(&reader_.line())) {
    add_outputs(outputs->outputs, recorded_outputs_, {.log_us = at_us, .is_recorded = true});
  }
  if (const auto* const event = std::get_if<RecordEvent>(&reader_.line())) {
    add({.log_us = at_us, .is_recorded = true, .text = std::string(event->text)});
  }
}

void WhatIf::compare_report(const OutgoingFrame& recorded) {
  const std::uint32_t first = core_->config().vehicle.base_id;
  const bool is_report = recorded.frame.id >= first && recorded.frame.id < first + vehicle_report_count;
  const auto other = reports_.find(recorded.frame.id);
  if (!is_report || other == reports_.end() || other->second == recorded.frame || !options_.reports) return;
  options_.reports({.log_us = log_us(reader_.tick().at), .recorded = recorded.frame, .other = other->second});
}

void WhatIf::add_outputs(const ContactorOutputs& now, ContactorOutputs& before, WhatIfMove move) {
  WhatIfMove others = move;
  others.text = others_text(now);
  if (others.text != others_text(before)) add(std::move(others));
  move.parts = !same_contactors(now, before);
  move.opens = opens_one(now, before);
  move.text = contactors_text(now);
  before = now;
  if (move.parts) add(std::move(move));
}

/// The first unmatched difference of the other course with the same text is its match.
void WhatIf::add(WhatIfMove move) {
  const auto match = std::find_if(unmatched_.begin(), unmatched_.end(), [&](const WhatIfMove& other) {
    const std::int64_t near_us = move.opens ? opening_match_us : closing_match_us;
    const bool is_near = !move.parts || move.log_us - other.log_us <= near_us;
    return other.is_recorded != move.is_recorded && other.text == move.text && is_near;
  });
  if (match != unmatched_.end()) {
    unmatched_.erase(match);
  } else {
    unmatched_.push_back(std::move(move));
  }
}

void WhatIf::tell_unmatched(std::int64_t before_log_us) {
  while (!unmatched_.empty() && unmatched_.front().log_us < before_log_us) {
    const WhatIfMove move = std::move(unmatched_.front());
    unmatched_.pop_front();
    if (options_.moves) options_.moves(move);
    if (move.parts) return part_from(move.log_us, move.is_recorded);
  }
}

/// Differences of the same instant, e.g. the reason for the opening, are still reported, and those at which the other
/// core had the same reason to open, if that is soon; later ones are not comparable.
void WhatIf::part_from(std::int64_t at_log_us, bool is_recorded) {
  std::string_view cause;
  for (const WhatIfMove& move : unmatched_) {
    if (move.log_us == at_log_us && move.is_recorded == is_recorded && cause.empty())
      cause = cause_of_opening(move.text);
  }
  const auto same = std::find_if(unmatched_.begin(), unmatched_.end(), [&](const WhatIfMove& move) {
    return move.is_recorded != is_recorded && !cause.empty() && !move.parts && is_about(cause, move.text);
  });
  for (const WhatIfMove& move : unmatched_) {
    const bool came_with_it = move.log_us == at_log_us && !move.parts;
    const bool came_with_same = same != unmatched_.end() && move.log_us == same->log_us &&
                                move.is_recorded == same->is_recorded && (move.parts || is_about(cause, move.text));
    if ((came_with_it || came_with_same) && options_.moves) options_.moves(move);
  }
  unmatched_.clear();
  has_parted_ = true;
}

void WhatIf::break_off() {
  end();
  has_parted_ = true;
  problem_.reset();
}

void WhatIf::end() {
  tell_unmatched(std::numeric_limits<std::int64_t>::max());
}

}  // namespace bmu
