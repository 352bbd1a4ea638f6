#include "mmu/scenario/scenario_player.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "mmu/scenario/scenario_text.hpp"
#include "mmu/scenario/world.hpp"

namespace bmu {

using scenario_text::number_text;

std::string_view to_text(ScriptVerdict verdict) {
  switch (verdict) {
    case ScriptVerdict::open: return "open";
    case ScriptVerdict::passed: return "passed";
    case ScriptVerdict::failed: return "failed";
    case ScriptVerdict::unfinished: return "unfinished";
  }
  return "?";
}

// --- frames ---------------------------------------------------------------------------------------------------------

namespace {

/// `selected_by` is a value of the message's first signal.
bool has_signal(const SignalSpec& signal, const MessageSpec& message, const CanFrame& frame) {
  return is_selected(signal, raw_of(message.signals.front(), frame.data));
}

/// Whether it is the frame of the condition and undamaged, regardless of its signal.
bool is_about(const ScenarioCondition& condition, const CanFrame& frame) {
  if (frame.is_extended || frame.is_remote || frame.is_error) return false;
  if (condition.message == nullptr) return frame.id == condition.frame_id;
  const MessageSpec& message = *condition.message;
  const std::uint32_t last_id =
      condition.is_any_node ? message.base_id + std::uint32_t{message.node_max} : condition.frame_id;
  if (frame.id < condition.frame_id || frame.id > last_id || frame.length != message.length) return false;
  if (has_crc(message) && frame.data[7] != frame_crc(frame)) return false;
  return !condition.signal || has_signal(message.signals[*condition.signal], message, frame);
}

bool is_frame(const ScenarioCondition& condition, const CanFrame& frame) {
  if (!condition.signal) return true;
  const SignalValue value = decode_signal(condition.message->signals[*condition.signal], frame.data);
  if (condition.wants_not_known) return value.is_valid() == (condition.comparison == Comparison::not_equal);
  return value.is_valid() && holds(condition.comparison, static_cast<double>(value.value), condition.wanted);
}

/// Row of the same message in this bus's catalogue, with its signals in the byte order of this bus.
const MessageSpec* as_on_bus(const MessageSpec* message, const Catalogue& catalogue) {
  if (message == nullptr) return nullptr;
  const MessageMatch match = catalogue.find(message->base_id + std::uint32_t{message->node_min});
  return match.message != nullptr ? match.message : message;
}

bool is_condition(ScenarioVerb verb) {
  return verb == ScenarioVerb::wait || verb == ScenarioVerb::expect || verb == ScenarioVerb::always ||
         verb == ScenarioVerb::never;
}

std::string seconds_text(Duration duration) {
  return number_text(std::round(to_s(duration) * 1e3) / 1e3) + " s";
}

std::string value_text(const SignalSpec& signal, const CanFrame& frame) {
  const SignalValue value = decode_signal(signal, frame.data);
  if (!value.is_valid()) return std::string(to_text(value.validity));
  for (const RawName& name : signal.names) {
    if (name.raw * signal.scale == value.value) return scenario_text::said({&name.name, 1});
  }
  return std::to_string(value.value);
}

}  // namespace

// --- execution -------------------------------------------------------------------------------------------------------

ScenarioPlayer::ScenarioPlayer(Scenario scenario, std::uint64_t seed, TimePoint started_at, const Catalogue& catalogue)
    : scenario_(std::move(scenario)),
      plan_(plan_scenario(scenario_, seed)),
      started_at_(started_at),
      looked_at_(started_at),
      ramps_end_at_(started_at) {
  for (ScenarioLine& line : scenario_.lines) line.condition.message = as_on_bus(line.condition.message, catalogue);
  const auto conditions = std::count_if(plan_.steps.begin(), plan_.steps.end(),
                                        [this](const ScenarioStep& step) { return is_condition(line_of(step).verb); });
  outcomes_.reserve(static_cast<std::size_t>(conditions));
  lasting_.reserve(static_cast<std::size_t>(conditions));
  cursors_.reserve(plan_.section_begins.size());
  news_.reserve(plan_.steps.size());
  begin_section(0, started_at);
}

void ScenarioPlayer::begin_section(std::size_t section, TimePoint now) {
  const Cursor cursor{plan_.section_begins[section], plan_.section_begins[section + 1], now};
  if (cursor.next != cursor.end) cursors_.push_back(cursor);
}

/// The one with the earliest step among those that are due; the older section first.
ScenarioPlayer::Cursor* ScenarioPlayer::due_cursor(TimePoint now) {
  Cursor* first = nullptr;
  TimePoint first_at{};
  for (Cursor& cursor : cursors_) {
    const TimePoint at = cursor.begins + plan_.steps[cursor.next].at;
    if (at > now || (first != nullptr && at >= first_at)) continue;
    first = &cursor;
    first_at = at;
  }
  return first;
}

void ScenarioPlayer::take_due(TimePoint now, World& world) {
  while (verdict_ == ScriptVerdict::open) {
    Cursor* const cursor = due_cursor(now);
    if (cursor == nullptr) return;
    const ScenarioStep& step = plan_.steps[cursor->next];
    const TimePoint at = cursor->begins + step.at;
    if (++cursor->next == cursor->end) cursors_.erase(cursors_.begin() + (cursor - cursors_.data()));
    take(step, at, now, world);
  }
}

void ScenarioPlayer::take(const ScenarioStep& step, TimePoint at, TimePoint now, World& world) {
  const ScenarioLine& line = line_of(step);
  switch (line.verb) {
    case ScenarioVerb::event:
      world.apply(step.event, now);
      ramps_end_at_ = std::max(ramps_end_at_, now + step.event.value.over);
      news_.push_back({&step, now});
      break;
    case ScenarioVerb::wait: take_wait(step, at, now, world); break;
    case ScenarioVerb::expect: {
      const Watch watch{.step = &step, .began_at = at};
      const bool has_held = is_so(line.condition, world);
      decide(watch, has_held, now);
      if (!has_held) fail(watch, now, found_state(line.condition, world));
      break;
    }
    case ScenarioVerb::always:
    case ScenarioVerb::never:
      lasting_.push_back({.step = &step, .began_at = at});
      if (line.limit > Duration::zero()) lasting_.back().ends_at = at + line.limit;
      look_at_lasting(now, world);
      break;
    case ScenarioVerb::pass: end(ScriptVerdict::passed, step); break;
    case ScenarioVerb::fail:
      failure_ = "at " + seconds_text(now - started_at_) + ": " + line.text;
      end(ScriptVerdict::failed, step);
      break;
    case ScenarioVerb::repeat:
    case ScenarioVerb::end: break;  // expanded by the plan
  }
}

void ScenarioPlayer::take_wait(const ScenarioStep& step, TimePoint at, TimePoint now, const World& world) {
  wait_ = Watch{.step = &step, .began_at = at, .ends_at = at + line_of(step).limit};
  look_at_wait(now, world);
}

void ScenarioPlayer::look(TimePoint now, const World& world) {
  looked_at_ = now;
  if (verdict_ == ScriptVerdict::open) look_at_lasting(now, world);
  if (verdict_ == ScriptVerdict::open) look_at_wait(now, world);
}

void ScenarioPlayer::look_at_wait(TimePoint now, const World& world) {
  if (!wait_) return;
  const ScenarioCondition& condition = condition_of(*wait_);
  const bool is_about_state = condition.state != nullptr;
  if (is_about_state && is_so(condition, world)) return met(now);
  if (now < *wait_->ends_at) return;
  decide(*wait_, false, now);
  fail(*wait_, now, is_about_state ? found_state(condition, world) : found_frame(*wait_, now));
}

void ScenarioPlayer::met(TimePoint now) {
  decide(*wait_, true, now);
  const std::size_t section = wait_->step->section;
  wait_.reset();
  begin_section(section + 1, now);
}

void ScenarioPlayer::look_at_lasting(TimePoint now, const World& world) {
  for (const Watch& watch : lasting_) {
    const ScenarioLine& line = line_of(*watch.step);
    if (line.condition.state == nullptr) continue;
    if (is_so(line.condition, world) == (line.verb == ScenarioVerb::always)) continue;
    decide(watch, false, now);
    return fail(watch, now, found_state(line.condition, world));
  }
  std::erase_if(lasting_, [&](const Watch& watch) {
    const bool is_done = watch.ends_at && now >= *watch.ends_at;
    if (is_done) decide(watch, true, now);
    return is_done;
  });
}

void ScenarioPlayer::see(const CanFrame& frame, TimePoint now) {
  if (verdict_ != ScriptVerdict::open) return;
  for (const Watch& watch : lasting_) {
    const ScenarioCondition& condition = condition_of(watch);
    if (condition.state != nullptr || !is_about(condition, frame) || !is_frame(condition, frame)) continue;
    decide(watch, false, now);
    return fail(watch, now, "it");
  }
  if (!wait_ || condition_of(*wait_).state != nullptr || !is_about(condition_of(*wait_), frame)) return;
  if (is_frame(condition_of(*wait_), frame) && now <= *wait_->ends_at) return met(now);
  wait_->last_frame = frame;
  wait_->last_frame_at = now;
}

bool ScenarioPlayer::is_over() const {
  const bool has_bounded =
      std::any_of(lasting_.begin(), lasting_.end(), [](const Watch& watch) { return watch.ends_at.has_value(); });
  const bool is_ramping = looked_at_ < ramps_end_at_;
  return verdict_ != ScriptVerdict::open || (cursors_.empty() && !wait_ && !has_bounded && !is_ramping);
}

// --- result ----------------------------------------------------------------------------------------------------------

void ScenarioPlayer::decide(const Watch& watch, bool has_held, TimePoint now) {
  outcomes_.push_back({watch.step, has_held, watch.began_at, now});
  news_.push_back({watch.step, now});
}

void ScenarioPlayer::end(ScriptVerdict verdict, const ScenarioStep& step) {
  verdict_ = verdict;
  deciding_line_ = &line_of(step);
}

void ScenarioPlayer::fail(const Watch& watch, TimePoint now, const std::string& found) {
  const ScenarioLine& line = line_of(*watch.step);
  failure_ = "at " + seconds_text(now - started_at_) + ": ";
  const std::string since = ", from " + seconds_text(watch.began_at - started_at_) + " on; found ";
  switch (line.verb) {
    case ScenarioVerb::wait:
      failure_ += "waited " + seconds_text(now - watch.began_at) + " for " + line.condition.text + "; found " + found;
      break;
    case ScenarioVerb::always: failure_ += "expected always " + line.condition.text + since + found; break;
    case ScenarioVerb::never: failure_ += "expected never " + line.condition.text + since + found; break;
    default: failure_ += "expected " + line.condition.text + "; found " + found; break;
  }
  end(ScriptVerdict::failed, *watch.step);
}

std::size_t ScenarioPlayer::untried_conditions() const {
  const auto is_untried = [this](const ScenarioStep& step) {
    const ScenarioVerb verb = line_of(step).verb;
    return is_condition(verb) || verb == ScenarioVerb::pass;
  };
  const auto count = std::count_if(plan_.steps.begin(), plan_.steps.end(), is_untried);
  return static_cast<std::size_t>(count) - outcomes_.size();
}

ScriptVerdict ScenarioPlayer::conclude(TimePoint now) {
  const ScenarioStep* const failed = outcomes_.empty() || outcomes_.back().has_held ? nullptr : outcomes_.back().step;
  // A condition until the end of the run was met up to here; one with a time was not monitored for as long.
  for (const Watch& watch : std::exchange(lasting_, {})) {
    const bool has_held = (!watch.ends_at || verdict_ == ScriptVerdict::passed) && watch.step != failed;
    if (has_held) outcomes_.push_back({watch.step, true, watch.began_at, now});
  }
  if (verdict_ != ScriptVerdict::open) return verdict_;
  const std::size_t untried = untried_conditions();
  verdict_ = untried == 0 ? ScriptVerdict::passed : ScriptVerdict::unfinished;
  if (untried > 0) {
    failure_ =
        "the run ended at " + seconds_text(now - started_at_) + ", conditions not decided: " + std::to_string(untried);
    if (wait_) deciding_line_ = &line_of(*wait_->step);
  }
  return verdict_;
}

// --- present state ---------------------------------------------------------------------------------------------------

bool ScenarioPlayer::is_so(const ScenarioCondition& condition, const World& world) const {
  return holds(condition.comparison, condition.state->get(world, master_, condition.place), condition.wanted);
}

std::string ScenarioPlayer::found_state(const ScenarioCondition& condition, const World& world) const {
  const StateSpec& state = *condition.state;
  const double found = state.get(world, master_, condition.place);
  if (!condition.words.empty()) return scenario_text::said(condition.words.subspan(static_cast<std::size_t>(found), 1));
  if (state.kind == StateKind::number) return number_text(std::round(found * 1e3) / 1e3);
  for (const StateSpec& other : state_table()) {
    const bool is_flag_of_target = other.target == state.target && other.kind == StateKind::flag;
    if (is_flag_of_target && other.get(world, master_, condition.place) != 0.0) return std::string(other.name);
  }
  return "not " + std::string(state.name);
}

std::string ScenarioPlayer::found_frame(const Watch& watch, TimePoint now) const {
  if (!watch.last_frame) return "no such frame";
  const SignalSpec& signal = condition_of(watch).message->signals[*condition_of(watch).signal];
  return std::string(signal.name) + " = " + value_text(signal, *watch.last_frame) + ", " +
         seconds_text(now - watch.last_frame_at) + " ago";
}

}  // namespace bmu
