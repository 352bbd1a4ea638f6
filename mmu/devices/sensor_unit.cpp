#include "mmu/devices/sensor_unit.hpp"

#include <utility>

namespace bmu {

void SensorUnit::observe(const CanFrame& frame, TimePoint now) {
  if (!is_there() || starts_at_ != TimePoint{} || frame.is_extended || frame.id != command_id_) return;
  CanFrame as_delivered = frame;
  as_delivered.id = driver_->command_id;
  const std::optional<SetUpOrder> order = driver_->order_of(as_delivered);
  if (!order) return;
  const SetUpAnswer answer = obey(*order);
  if (!answers) return;
  answers_at_ = now + answer_after;
  waiting_ = answer_of(answer);
}

CanFrame SensorUnit::answer_of(const SetUpAnswer& answer) const {
  CanFrame frame = driver_->answer(answer);
  frame.id = response_id_;
  return frame;
}

SetUpAnswer SensorUnit::obey(const SetUpOrder& order) {
  SensorSetting& setting = settings_.at(order.channel);
  switch (order.kind) {
    case SetUpOrderKind::read: break;
    case SetUpOrderKind::set:
      if (!is_running_) setting = order.setting;
      return {SetUpWord::setting, order.channel, order.setting};
    case SetUpOrderKind::stop: is_running_ = false; return {.word = SetUpWord::stopped};
    case SetUpOrderKind::run: is_running_ = true; return {.word = SetUpWord::running};
    case SetUpOrderKind::store: stored_ = settings_; return {.word = SetUpWord::stored};
  }
  return {SetUpWord::setting, order.channel, setting};
}

std::optional<CanFrame> SensorUnit::tick(TimePoint now) {
  if (starts_at_ != TimePoint{}) {
    if (now < starts_at_) return std::nullopt;
    starts_at_ = {};
    return answers ? std::optional(answer_of({.word = SetUpWord::alive})) : std::nullopt;
  }
  if (now < answers_at_) return std::nullopt;
  return std::exchange(waiting_, std::nullopt);
}

void SensorUnit::restart(TimePoint now) {
  settings_ = stored_;
  is_running_ = true;
  starts_at_ = now + restart_takes;
  waiting_.reset();
}

}  // namespace bmu
