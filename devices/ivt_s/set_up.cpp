// Driver that reads and writes the settings of an IVT-S.
#include "devices/ivt_s/ivt_s.hpp"
#include "protocol/receive_check.hpp"

namespace bmu::ivt_s {

namespace {

bool is_data_of(const MessageSpec& message, const CanFrame& frame) {
  return frame.id == message.base_id && !frame.is_extended && !frame.is_error;
}

template <const MessageSpec& Message>
void write_setting(const SensorSetting& setting, CanFrame& frame) {
  write<Message, "sign_inverted">(frame, setting.is_inverted ? 1 : 0);
  write<Message, "little_endian">(frame, setting.is_little_endian ? 1 : 0);
  write<Message, "trigger">(frame, static_cast<std::int64_t>(setting.trigger));
  write<Message, "period_ms">(frame, setting.period_ms);
}

/// None if the trigger is none of the three.
template <const MessageSpec& Message>
std::optional<SensorSetting> setting_in(const CanFrame& frame) {
  const std::int64_t trigger = read_raw<Message, "trigger">(frame);
  if (trigger > static_cast<std::int64_t>(SensorTrigger::cyclic)) return std::nullopt;
  return SensorSetting{.trigger = static_cast<SensorTrigger>(trigger),
                       .is_little_endian = read_raw<Message, "little_endian">(frame) != 0,
                       .is_inverted = read_raw<Message, "sign_inverted">(frame) != 0,
                       .period_ms = static_cast<std::int32_t>(read_raw<Message, "period_ms">(frame))};
}

std::uint8_t number_of(SetUpOrderKind kind, std::uint8_t channel) {
  switch (kind) {
    case SetUpOrderKind::read: return static_cast<std::uint8_t>(first_read_command + channel);
    case SetUpOrderKind::set: return static_cast<std::uint8_t>(first_set_command + channel);
    case SetUpOrderKind::stop:
    case SetUpOrderKind::run: return mode_command;
    case SetUpOrderKind::store: break;
  }
  return store_command;
}

CanFrame command_of(const SetUpOrder& order) {
  CanFrame frame = make_frame(command);
  write<command, "command">(frame, number_of(order.kind, order.channel));
  if (order.kind == SetUpOrderKind::set) write_setting<command>(order.setting, frame);
  const bool is_mode = order.kind == SetUpOrderKind::stop || order.kind == SetUpOrderKind::run;
  if (is_mode) {
    write<command, "mode">(frame, order.kind == SetUpOrderKind::run ? 1 : 0);
    write<command, "mode_at_start">(frame, 1);
  }
  return frame;
}

bool is_of_channel(std::int64_t number, std::uint8_t first) {
  return number >= first && number < first + sensor_channels_max;
}

SetUpAnswer take(const CanFrame& frame) {
  if (!is_data_of(response, frame)) return {};
  if (frame.is_remote || content_fault(response, frame)) return {.word = SetUpWord::refused};
  const std::int64_t number = read_raw<response, "response">(frame);
  constexpr std::uint8_t first_setting = first_set_command + answered;
  if (is_of_channel(number, first_setting)) {
    const std::optional<SensorSetting> setting = setting_in<response>(frame);
    if (!setting) return {.word = SetUpWord::refused};
    return {SetUpWord::setting, static_cast<std::uint8_t>(number - first_setting), *setting};
  }
  if (number == mode_command + answered) {
    return {.word = read_raw<response, "mode">(frame) != 0 ? SetUpWord::running : SetUpWord::stopped};
  }
  if (number == store_command + answered) return {.word = SetUpWord::stored};
  if (number == alive_response) return {.word = SetUpWord::alive};
  if (number == wrong_command_response) return {.word = SetUpWord::not_understood};
  return {.word = SetUpWord::other};
}

std::optional<SetUpOrder> order_of(const CanFrame& frame) {
  if (!is_data_of(command, frame) || frame.is_remote || content_fault(command, frame)) return std::nullopt;
  const std::int64_t number = read_raw<command, "command">(frame);
  SetUpOrder order;
  if (is_of_channel(number, first_read_command)) {
    order.channel = static_cast<std::uint8_t>(number - first_read_command);
  } else if (is_of_channel(number, first_set_command)) {
    const std::optional<SensorSetting> setting = setting_in<command>(frame);
    if (!setting) return std::nullopt;
    order = {SetUpOrderKind::set, static_cast<std::uint8_t>(number - first_set_command), *setting};
  } else if (number == mode_command) {
    order.kind = read_raw<command, "mode">(frame) != 0 ? SetUpOrderKind::run : SetUpOrderKind::stop;
  } else if (number == store_command) {
    order.kind = SetUpOrderKind::store;
  } else {
    return std::nullopt;
  }
  return order;
}

std::uint8_t number_of(SetUpWord word, std::uint8_t channel) {
  switch (word) {
    case SetUpWord::setting: return static_cast<std::uint8_t>(first_set_command + answered + channel);
    case SetUpWord::stopped:
    case SetUpWord::running: return mode_command + answered;
    case SetUpWord::stored: return store_command + answered;
    case SetUpWord::alive: return alive_response;
    default: return wrong_command_response;
  }
}

CanFrame answer(const SetUpAnswer& said) {
  CanFrame frame = make_frame(response);
  write<response, "response">(frame, number_of(said.word, said.channel));
  if (said.word == SetUpWord::setting) write_setting<response>(said.setting, frame);
  const bool is_mode = said.word == SetUpWord::stopped || said.word == SetUpWord::running;
  if (is_mode) {
    write<response, "mode">(frame, said.word == SetUpWord::running ? 1 : 0);
    write<response, "mode_at_start">(frame, 1);
  }
  return frame;
}

}  // namespace

const SensorSetUpDriver set_up{.name = "ivt_s",
                               .command_id = command.base_id,
                               .response_id = response.base_id,
                               .command_pause = command_pause,
                               .response_time_max = response_time_max,
                               .command = command_of,
                               .take = take,
                               .order_of = order_of,
                               .answer = answer};

}  // namespace bmu::ivt_s
