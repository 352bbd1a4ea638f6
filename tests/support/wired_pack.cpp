#include "tests/support/wired_pack.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "protocol/tables/internal_bus.hpp"

namespace bmu::test {

Station station_of(const CanFrame& frame) {
  const MessageMatch match = internal_bus::catalogue.find(frame.id);
  if (match.message == nullptr) return Station::stranger;
  if (match.message->sender == Sender::mmu) return static_cast<Station>(match.node);
  return match.message->base_id == internal_bus::pdu_status.base_id ? Station::pdu : Station::sensor;
}

WiredPack::WiredPack(const CoreConfig& config, Duration devices_ahead)
    : devices_tick_at_(start - devices_ahead % Plant::step_length + Plant::step_length),
      core_(config, start),
      simulator_(simulator_config(config), {}, start - devices_ahead) {
  static_cast<void>(simulator_.advance(start));  // nobody heard that
  observe(PortChanged{Port::internal, true});
  observe(PortChanged{Port::vehicle, true});
}

std::uint8_t WiredPack::last_node() const {
  return config().modules[config().modules.size() - 1].node;
}

bool WiredPack::coils_are_driven() const {
  const ContactorFlags& coils = simulator_.pdu().outputs().contactors;
  return std::any_of(coils.begin(), coils.end(), [](bool is_driven) { return is_driven; });
}

// --- time -----------------------------------------------------------------------------------------------------------

void WiredPack::run(Duration duration) {
  const TimePoint end = now_ + duration;
  while (now_ < end) advance_to(end);
}

bool WiredPack::run_until(const std::function<bool(const WiredPack&)>& condition, Duration at_most) {
  const TimePoint end = now_ + at_most;
  while (now_ < end && !condition(*this)) advance_to(end);
  return condition(*this);
}

/// To whatever happens next, at most to `end`.
void WiredPack::advance_to(TimePoint end) {
  const TimePoint wakes_at = std::max(wake_at_, stalled_until_);
  now_ = std::min({end, devices_tick_at_, wire_.done_at(), wakes_at});
  for (const Told& one : told_) now_ = std::min(now_, one.at);
  take_from_wire();
  tell_due();
  if (now_ >= devices_tick_at_) tick_devices();
  if (now_ >= wakes_at) {
    if (const std::uint64_t lost = std::exchange(lost_while_stalled_, 0); lost > 0) {
      observe(FramesLost{Port::internal, lost});
    }
    decide();
  }
  if (flood && wire_.waiting(Station::stranger) == 0) wire_.put(Station::stranger, *flood);
  wire_.start_if_idle(now_);
}

void WiredPack::tick_devices() {
  devices_tick_at_ += Plant::step_length;
  if (each_ms) each_ms(*this);
  std::erase_if(late_, [this](const Due& due) {
    if (due.at > now_) return false;
    wire_.put(station_of(due.frame), due.frame);
    return true;
  });
  for (const SentFrame& sent : simulator_.advance(now_)) {
    CanFrame frame = sent.frame;
    const Station station = station_of(frame);
    const Fate fate = on_sent ? on_sent(frame, *this) : Fate{};
    last_sent_[sent.frame.id] = sent.frame;
    if (fate.is_lost) continue;
    if (fate.delay > Duration{}) {
      late_.push_back({now_ + fate.delay, frame});
    } else {
      wire_.put(station, frame);
    }
    if (fate.twin) wire_.put(station, *fate.twin);
  }
}

void WiredPack::stall(Duration duration) {
  stalled_until_ = now_ + duration;
  run(duration);
}

// --- frames ---------------------------------------------------------------------------------------------------------

void WiredPack::take_from_wire() {
  const std::optional<CanWire::Carried> carried = wire_.take_done(now_);
  if (!carried) return;
  const CanFrame& frame = carried->frame;
  const bool is_ours = carried->from == Station::master;
  if (is_ours && !is_cut) simulator_.observe(frame, now_);
  if (carried->from == Station::stranger) simulator_.observe(frame, now_);
  if (is_ours && frame.id == internal_bus::contactor_command.base_id) commanded_ = outputs_of(frame);
  if (is_ours && frame.id == internal_bus::poll.base_id) poll_counter_ = frame.data[6];
  if (is_ours) {
    tell(FrameEchoed{Port::internal, frame});
  } else if (!is_cut && !is_swallowing && core_.port(Port::internal).is_up) {
    tell(FrameReceived{Port::internal, frame});
  }
}

void WiredPack::tell(const ObservedThing& what) {
  if (now_ < stalled_until_) {
    ++lost_while_stalled_;
  } else if (latency > Duration{}) {
    told_.push_back({now_ + latency, what});
  } else {
    observe(what);
  }
}

void WiredPack::tell_due() {
  while (!told_.empty() && told_.front().at <= now_) {
    const ObservedThing what = told_.front().what;
    told_.erase(told_.begin());
    observe(what);
  }
}

void WiredPack::observe(const ObservedThing& what) {
  if (core_.observe({now_, what}) == Urgency::decide_now) decide();
}

void WiredPack::decide() {
  const Phase before = phase();
  const Decisions decisions = core_.decide(now_);
  wake_at_ = decisions.wake_at;
  if (phase() != before) ++entered_[static_cast<std::size_t>(phase())];
  for (const OutgoingFrame& out : decisions.frames) {
    if (out.port != Port::internal || is_swallowing) continue;
    if (sends_fail || wire_.waiting(Station::master) >= queue_length) {
      static_cast<void>(core_.observe({now_, SendFailed{out.port, out.frame}}));
    } else {
      wire_.put(Station::master, out.frame);
    }
  }
}

void WiredPack::set_port(bool is_up) {
  if (!is_up) wire_.drop_queue(Station::master);
  observe(PortChanged{Port::internal, is_up});
}

// --- what tests do with it ------------------------------------------------------------------------------------------

void WiredPack::apply(std::string_view events) {
  const ModuleConfig& module = config().modules[config().modules.size() - 1];
  const std::string node = std::to_string(module.node);
  std::string text(events);
  const auto replace = [&text](std::string_view what, const std::string& with) {
    for (auto at = text.find(what); at != std::string::npos; at = text.find(what)) text.replace(at, what.size(), with);
  };
  replace("$N", node);
  replace("$C", node + "." + std::to_string(module.cell_count));
  replace("$T", node + "." + std::to_string(module.temperature_sensor_count));
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find(';', begin), text.size());
    const std::size_t first = text.find_first_not_of(' ', begin);
    const std::string event = text.substr(first, end - first);
    if (!simulator_.apply(event)) throw std::runtime_error("event '" + event + "' is not understood");
    begin = end + 1;
  }
}

bool WiredPack::close() {
  run(1500ms);
  apply("vehicle on");
  return run_until([](const WiredPack& pack) { return pack.phase() == Phase::closed; }, 4s);
}

}  // namespace bmu::test
