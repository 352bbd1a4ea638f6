#include "daemon/core/measurement/sensor_setup.hpp"

#include "protocol/row_order.hpp"

namespace bmu {

namespace {

using enum SensorSetupStage;

/// Command of a stage, for the sensor or for each channel, number of attempts, and the next stage.
struct StageRow {
  SensorSetupStage stage;
  SetUpOrderKind order = SetUpOrderKind::read;
  SetUpWord answer = SetUpWord::setting;
  bool is_each_channel = false;
  std::uint8_t tries = 3;
  SensorSetupStage next = done;
  std::string_view name;
};
constexpr std::array stage_table{
    StageRow{.stage = reading, .is_each_channel = true, .name = "asked"},
    StageRow{.stage = stopping,
             .order = SetUpOrderKind::stop,
             .answer = SetUpWord::stopped,
             .next = setting,
             .name = "being stopped"},
    StageRow{.stage = setting,
             .order = SetUpOrderKind::set,
             .is_each_channel = true,
             .next = checking,
             .name = "being configured"},
    StageRow{.stage = checking, .is_each_channel = true, .name = "asked again"},
    StageRow{.stage = storing,
             .order = SetUpOrderKind::store,
             .answer = SetUpWord::stored,
             .next = starting,
             .name = "storing"},
    StageRow{.stage = starting,
             .order = SetUpOrderKind::run,
             .answer = SetUpWord::running,
             .next = done,
             .name = "being started"},
    StageRow{.stage = done, .tries = 0, .name = "as wanted"},
    StageRow{.stage = failed, .tries = 0, .name = "not as wanted"},
};
static_assert(rows_are_in_order(stage_table, &StageRow::stage));

constexpr const StageRow& row_of(SensorSetupStage stage) {
  return stage_table[static_cast<std::size_t>(stage)];
}

/// Period of each result, as assumed by the ages of the pack file and the load of the bus.
constexpr std::array<Duration, sensor_channels_used> periods{
    internal_bus::sensor_current.period, internal_bus::sensor_u1.period, internal_bus::sensor_u2.period};

/// The first setting that differs.
SensorSetupProblem difference_of(std::uint8_t channel, const SensorSetting& found, const SensorSetting& wanted) {
  using enum SensorSetupTrouble;
  if (found.trigger != wanted.trigger) {
    return {trigger, channel, static_cast<std::int32_t>(found.trigger), static_cast<std::int32_t>(wanted.trigger)};
  }
  if (found.is_little_endian != wanted.is_little_endian) {
    return {byte_order, channel, found.is_little_endian ? 1 : 0, wanted.is_little_endian ? 1 : 0};
  }
  if (found.is_inverted != wanted.is_inverted) {
    return {sign, channel, static_cast<std::int32_t>(found.is_inverted), static_cast<std::int32_t>(wanted.is_inverted)};
  }
  if (found.period_ms != wanted.period_ms) return {period, channel, found.period_ms, wanted.period_ms};
  return {};
}

}  // namespace

std::string_view to_text(SensorSetupStage stage) {
  return row_of(stage).name;
}

bool is_possible(const SensorSetupProblem& problem) {
  const auto is_trigger = [](std::int32_t value) {
    return value >= 0 && value <= static_cast<std::int32_t>(SensorTrigger::cyclic);
  };
  const bool are_values_possible =
      problem.trouble != SensorSetupTrouble::trigger || (is_trigger(problem.found) && is_trigger(problem.wanted));
  return problem.channel < sensor_channels_told && are_values_possible;
}

SensorSetting wanted_setting(std::uint8_t channel, const SensorConfig& config) {
  return {.trigger = SensorTrigger::cyclic,
          .is_little_endian = config.little_endian,
          .period_ms = static_cast<std::int32_t>(to_ms(periods.at(channel)))};
}

void SensorSetup::init(const SensorConfig& config) {
  config_ = config;
  target_ = {.driver = config.set_up, .is_configured = config.is_configured, .is_stored = config.is_stored};
  if (!is_there()) return;
  target_.command_id = config.set_up->command_id;
  target_.response_id = config.set_up->response_id;
}

void SensorSetup::init_second(const SensorConfig& config) {
  config_ = config;
  target_ = {.command_id = config.second_command_id,
             .response_id = config.second_response_id,
             .channel_count = 1,
             .first_told = sensor_channels_used};
  if (config.has_second_at_531h() && config.second_command_id != 0) target_.driver = config.set_up;
}

void SensorSetup::start_over() {
  enter(reading);
  changed_ = {};
  trusted_since_ = {};
}

void SensorSetup::enter(SensorSetupStage stage) {
  stage_ = stage;
  channel_ = 0;
  tries_ = 0;
  asked_at_ = {};
  is_judgement_due_ = false;
}

void SensorSetup::fail(const SensorSetupProblem& problem, TimePoint at) {
  enter(failed);
  problem_ = problem;
  failed_at_ = at;
  trusted_since_ = {};
}

/// Handles the answer to the last command.
void SensorSetup::advance() {
  const StageRow& row = row_of(stage_);
  if (row.is_each_channel && channel_ + 1 < target_.channel_count) {
    ++channel_;
    tries_ = 0;
    asked_at_ = {};
    return;
  }
  // The settings that were read are compared in the next tick.
  if (stage_ == reading || stage_ == checking) {
    is_judgement_due_ = true;
    return;
  }
  enter(row.next);
  if (stage_ == done) problem_ = {};
}

bool SensorSetup::observe(const CanFrame& frame, TimePoint at, bool is_any_commanded) {
  if (!is_there()) return false;
  if (frame.id != target_.response_id) return false;
  CanFrame as_delivered = frame;
  as_delivered.id = target_.driver->response_id;
  const SetUpAnswer answer = target_.driver->take(as_delivered);
  if (answer.word == SetUpWord::none) return false;
  if (answer.word == SetUpWord::refused) ++answers_refused_;
  if (answer.word == SetUpWord::alive) take_restart(at, is_any_commanded);
  const bool is_waiting = asked_at_ != TimePoint{} && !is_judgement_due_;
  if (answer.word == SetUpWord::not_understood && is_waiting) {
    fail({SensorSetupTrouble::not_understood, told(channel_), 0, 0}, at);
  }
  if (answer.word == SetUpWord::setting) {
    take_setting(answer, at);
  } else if (is_waiting && answer.word == row_of(stage_).answer) {
    advance();
  }
  return true;
}

/// A sensor that reports another setting without a command was configured by another node.
void SensorSetup::take_setting(const SetUpAnswer& answer, TimePoint at) {
  if (answer.channel >= target_.channel_count) return;
  found_.at(answer.channel) = answer.setting;
  const SensorSetting wanted = wanted_setting(answer.channel, config_);
  // The results are no longer used, whatever the other channels still report.
  if (difference_of(answer.channel, answer.setting, wanted).trouble != SensorSetupTrouble::none) trusted_since_ = {};
  if (stage_ == done) {
    const SensorSetupProblem problem = difference();
    if (problem.trouble != SensorSetupTrouble::none) fail(problem, at);
    return;
  }
  const bool is_awaited = asked_at_ != TimePoint{} && !is_judgement_due_ && row_of(stage_).answer == SetUpWord::setting;
  if (is_awaited && answer.channel == channel_) advance();
}

void SensorSetup::take_restart(TimePoint at, bool is_any_commanded) {
  ++restarts_;
  const bool was_done = stage_ == done;
  enter(reading);
  if (was_done) changed_ = {};
  if (was_done) trusted_since_ = at;
  if (!is_any_commanded) trusted_since_ = {};
}

bool SensorSetup::are_results_good(TimePoint now) const {
  const bool is_trusted = trusted_since_ != TimePoint{} && now - trusted_since_ <= trust_max;
  return !is_there() || stage_ == done || is_trusted;
}

SensorSetupProblem SensorSetup::difference() const {
  for (std::uint8_t channel = 0; channel < target_.channel_count; ++channel) {
    SensorSetupProblem problem = difference_of(channel, found_.at(channel), wanted_setting(channel, config_));
    problem.channel = told(channel);
    if (problem.trouble != SensorSetupTrouble::none) return problem;
  }
  return {};
}

/// One for each channel that is about to be changed. Changes of an earlier attempt count, too.
void SensorSetup::note_changes() {
  for (std::uint8_t channel = 0; channel < target_.channel_count; ++channel) {
    const SensorSetupProblem problem = difference_of(channel, found_.at(channel), wanted_setting(channel, config_));
    if (problem.trouble != SensorSetupTrouble::none) changed_.at(channel) = problem;
  }
}

/// All channels have been read.
void SensorSetup::judge(TimePoint now, bool is_any_commanded) {
  const SensorSetupProblem problem = difference();
  const bool is_configured = target_.is_configured;
  if (problem.trouble == SensorSetupTrouble::none) {
    const bool has_set = stage_ == checking;
    // A previous attempt that failed may have stopped the sensor.
    enter(has_set && target_.is_stored ? storing : is_configured ? starting : done);
    if (stage_ == done) problem_ = {};
    return;
  }
  if (stage_ == reading && is_configured && !is_any_commanded) {
    trusted_since_ = {};
    note_changes();
    enter(stopping);
    return;
  }
  fail(problem, now);
}

SetUpOrder SensorSetup::order_now() const {
  SetUpOrder order{.kind = row_of(stage_).order, .channel = channel_};
  if (order.kind == SetUpOrderKind::set) order.setting = wanted_setting(channel_, config_);
  return order;
}

std::optional<CanFrame> SensorSetup::step(TimePoint now, bool is_any_commanded) {
  if (!is_there()) return std::nullopt;
  if (is_judgement_due_) judge(now, is_any_commanded);
  if (stage_ == failed && now - failed_at_ >= retry) enter(reading);
  if (stage_ == done || stage_ == failed) return std::nullopt;
  const SensorSetUpDriver& driver = *target_.driver;
  const bool has_asked = asked_at_ != TimePoint{};
  if (has_asked && now - asked_at_ < driver.response_time_max) return std::nullopt;
  if (tries_ == row_of(stage_).tries) {
    fail({SensorSetupTrouble::no_answer, told(channel_), 0, 0}, now);
    return std::nullopt;
  }
  ++tries_;
  asked_at_ = now;
  CanFrame command = driver.command(order_now());
  command.id = target_.command_id;
  return command;
}

}  // namespace bmu
