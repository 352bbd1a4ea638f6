#include "config/checks/bus_budget.hpp"

#include <algorithm>
#include <iterator>

#include "config/checks/bus_guests.hpp"
#include "daemon/core/modules/poll_schedule.hpp"
#include "protocol/can_bits.hpp"

namespace bmu {

namespace {

constexpr std::int64_t frame_bits = bits_on_wire_max(8);

Duration time_of(std::int64_t bits, std::int32_t rate_kbit_per_s) {
  constexpr std::int64_t ns_and_kbit = 1'000'000;
  return Duration{(bits * ns_and_kbit + rate_kbit_per_s - 1) / rate_kbit_per_s};
}

/// Number of frames that poll all modules: one, or one for each module if the third-party protocol requires it.
std::int64_t question_frames(const CoreConfig& core) {
  const bool asks_each = !are_modules_ours(core) && core.foreign.driver->asks_each;
  return asks_each ? std::ssize(core.modules) : 1;
}

/// Number of frames in all answers. Third-party modules are always polled for everything.
std::int64_t answer_frames(const CoreConfig& core, const PollWants& wants) {
  if (!are_modules_ours(core)) return core.foreign.driver->frames_per_answer * std::ssize(core.modules);
  std::int64_t frames = 0;
  for (const ModuleConfig& module : core.modules) frames += bmu::answer_frames(module, wants);
  return frames;
}

std::int64_t bits_per_s(std::int64_t bits, Duration period) {
  return bits * std::int64_t{1'000'000'000} / period.count();
}
/// Bit rate of a periodic message.
std::int64_t bits_per_s(const MessageSpec& message) {
  return bits_per_s(bits_on_wire_max(message.length), message.period);
}

/// Identifier of the answer with the lowest priority.
std::uint32_t weakest_answer(const CoreConfig& core) {
  const Catalogue& answers = are_modules_ours(core) ? internal_bus::catalogue : *core.foreign.driver->catalogue;
  const Sender sender = are_modules_ours(core) ? Sender::mmu : Sender::module;
  std::uint32_t weakest = 0;
  for (const MessageSpec* message : answers.messages()) {
    if (message->sender == sender) weakest = std::max(weakest, message->id_of(message->node_max));
  }
  return weakest;
}

/// Messages with a higher priority than the weakest answer.
std::vector<GuestMessage> stronger_of(const CoreConfig& core) {
  std::vector<GuestMessage> stronger = guests_on(core, Port::internal);
  const std::uint32_t weakest = weakest_answer(core);
  std::erase_if(stronger, [weakest](const GuestMessage& message) { return !goes_ahead(message, weakest); });
  if (!core.contactors.has_pdu) return stronger;
  for (const MessageSpec* message : {&internal_bus::contactor_command, &internal_bus::pdu_status}) {
    stronger.push_back({message->base_id, message->length, message->is_extended, message->period});
  }
  if (core.intake_air.source == AirSource::pdu) {
    const MessageSpec& message = internal_bus::pdu_temperature;
    stronger.push_back({message.base_id, message.length, message.is_extended, message.period});
  }
  return stronger;
}

/// Maximum number of bits within a time: the periods that begin in it, one that began before, and a change.
std::int64_t bits_within(const std::vector<GuestMessage>& messages, Duration within) {
  std::int64_t bits = 0;
  for (const GuestMessage& message : messages) bits += bits_of(message) * (within / message.period + 2);
  return bits;
}

std::int64_t guest_bits_per_s(const CoreConfig& core, Port bus) {
  std::int64_t bits = 0;
  for (const GuestMessage& message : guests_on(core, bus)) bits += bits_per_s(bits_of(message), message.period);
  return bits;
}

std::int64_t load_permille(std::int64_t bits_each_second, std::int32_t rate_kbit_per_s) {
  return (bits_each_second + rate_kbit_per_s - 1) / rate_kbit_per_s;
}

/// Maximum time from a question to the first frame of its answer.
Duration turnaround(const CoreConfig& core) {
  return are_modules_ours(core) ? Duration{answer_delay_max} : core.foreign.driver->answer_within;
}

/// Time of the turnaround and of `own_bits`, with the higher-priority messages during it. None if the bus is saturated.
std::optional<Duration> time_with_stronger(const CoreConfig& core, std::int64_t own_bits,
                                           std::int32_t rate_kbit_per_s) {
  constexpr Duration unending = 60s;
  const std::vector<GuestMessage> stronger = stronger_of(core);
  Duration time = turnaround(core);
  while (time < unending) {
    const Duration longer = turnaround(core) + time_of(own_bits + bits_within(stronger, time), rate_kbit_per_s);
    if (longer == time) return time;
    time = longer;
  }
  return std::nullopt;
}

/// Bits of a cycle: a frame on the wire, the POLL, all answers.
std::int64_t cycle_bits(const CoreConfig& core, const PollWants& wants) {
  return frame_bits * (1 + question_frames(core) + answer_frames(core, wants));
}

/// Bits of the longest answers, each with its POLL, of as many modules as may be polled singly in a cycle.
std::int64_t single_bits(const CoreConfig& core) {
  if (!are_modules_ours(core)) return 0;
  std::int64_t answer_max = 0;
  for (const ModuleConfig& module : core.modules) {
    answer_max = std::max(answer_max, bmu::answer_frames(module, all_wants));
  }
  const std::int64_t singles = std::min<std::int64_t>(singles_per_cycle, std::ssize(core.modules));
  return frame_bits * singles * (1 + answer_max);
}

}  // namespace

std::int64_t answer_frames(const ModuleConfig& module, const PollWants& wants) {
  const std::int64_t cells =
      (module.cell_count + internal_bus::cells_per_frame - 1) / std::int64_t{internal_bus::cells_per_frame};
  return (wants.status ? 1 : 0) + (wants.cells ? cells : 0) + (wants.temperatures ? 2 : 0) + (wants.module ? 1 : 0) +
         (wants.identity ? 1 : 0);
}

std::optional<Duration> cycle_time_max(const CoreConfig& core, const PollWants& wants, std::int32_t rate_kbit_per_s) {
  return time_with_stronger(core, cycle_bits(core, wants), rate_kbit_per_s);
}

std::optional<Duration> period_min(const CoreConfig& core, std::int32_t rate_kbit_per_s) {
  return time_with_stronger(core, cycle_bits(core, all_wants) + single_bits(core), rate_kbit_per_s);
}

std::int64_t bus_load_permille(const CoreConfig& core, Duration period, std::int32_t rate_kbit_per_s) {
  const PollWants always{.temperatures = false};
  const PollWants now_and_then{.status = false, .cells = false, .temperatures = true, .module = false};
  const PollWants seldom{.status = false, .cells = false, .temperatures = false, .module = false, .identity = true};
  const Duration temperature_period = std::max(period, core.poll.period * core.poll.temperature_every);
  std::int64_t bits = bits_per_s(frame_bits * (question_frames(core) + answer_frames(core, always)), period);
  if (are_modules_ours(core)) {
    bits += bits_per_s(frame_bits * answer_frames(core, now_and_then), temperature_period) +
            bits_per_s(frame_bits * answer_frames(core, seldom), std::max(period, identity_period));
  }
  using namespace internal_bus;
  if (core.contactors.has_pdu) bits += bits_per_s(contactor_command) + bits_per_s(pdu_status);
  if (core.intake_air.source == AirSource::pdu) bits += bits_per_s(pdu_temperature);
  bits += bits_per_s(sensor_current) + bits_per_s(sensor_u1) + bits_per_s(sensor_u2);
  const SensorConfig& sensor = core.sensor;
  if (sensor.has_second_at_531h()) bits += bits_per_s(sensor_current_2);
  return load_permille(bits + guest_bits_per_s(core, Port::internal), rate_kbit_per_s);
}

std::int64_t guest_load_permille(const CoreConfig& core, Port bus, std::int32_t rate_kbit_per_s) {
  return load_permille(guest_bits_per_s(core, bus), rate_kbit_per_s);
}

}  // namespace bmu
