#include "tests/simulation/stage.hpp"

#include <algorithm>
#include <array>

namespace bmu::test {

namespace {

constexpr std::int64_t unix_time_at_start_ms = 1'700'000'000'000;
constexpr std::int32_t cell_noise_uV = 300;      // without any, a pack at rest would have stuck values
constexpr std::size_t device_queue_length = 16;  // as a controller has, for a module's whole answer

constexpr Station devices = Station::module_first;  // all of them have one controller

Port port_of(const CoreConfig& config) {
  const Port guest = config.charger.driver != nullptr ? Port::charger : Port::inverter;
  return config.served_by[static_cast<std::size_t>(guest)];
}

}  // namespace

void StateStore::follow(const Core& core, TimePoint now) {
  if (writing_ && now >= writing_->done_at) {
    kept_ = writing_->state;
    writing_.reset();
  }
  if (writing_ || generation_ == core.persistent_generation()) return;
  const std::uint64_t most_ms = static_cast<std::uint64_t>(to_ms(write_time_max));
  generation_ = core.persistent_generation();
  writing_.emplace(Writing{now + std::chrono::milliseconds{random_.next() % most_ms}, core.persistent()});
}

Stage::Stage(const CoreConfig& config, std::uint64_t seed, Duration devices_ahead, TimePoint starts_at)
    : pack(config, devices_ahead, slowest_bus, starts_at, cell_noise_uV),
      wire(seed ^ 0x3117EULL),
      outer(pack.config(), seed ^ 0x0E75ULL),
      store(seed ^ 0x570EULL),
      began_at_(starts_at),
      random_(seed ^ 0xB007ULL) {
  pack.device_queue_length = device_queue_length;
  pack.cut_power();
  boot();
}

void Stage::cut_power() {
  pack.cut_power();
  outer.set_power(false, pack.now());
  store.cut_power();
}

void Stage::boot() {
  pack.boot(store.kept(), static_cast<std::uint8_t>(random_.next()));
  outer.set_power(true, pack.now());
  store.begin_life();
  tell_wall_clock();
}

void Stage::tell_wall_clock() {
  const std::int64_t since_start_ms = to_ms(pack.now() - began_at_);
  pack.observe(WallClockSeen{unix_time_at_start_ms + since_start_ms + wall_offset_ms});
}

// --- the other bus --------------------------------------------------------------------------------------------------

OuterBus::OuterBus(const CoreConfig& config, std::uint64_t seed)
    : wire(seed), config_(&config), port_(port_of(config)), bus_(slowest_bus) {
  for (const Station station : {Station::master, Station::stranger, devices}) bus_.connect(station);
}

void OuterBus::put(Station station, const CanFrame& frame) {
  bus_.put(station, frame);
  is_idle_ = false;
}

void OuterBus::take_decided(const Decisions& decisions, WiredPack& pack) {
  for (const OutgoingFrame& out : decisions.frames) {
    if (!serves(*config_, port_, out.port)) continue;
    if (bus_.waiting(Station::master) >= pack.queue_length) {
      pack.observe(SendFailed{out.port, out.frame});
    } else {
      put(Station::master, out.frame);
    }
  }
}

void OuterBus::carry(const CanFrame& frame, TimePoint now) {
  CanFrame sent = frame;
  const Fate fate = wire.carry(sent);
  if (fate.is_lost) return;
  late_.push_back({now + fate.delay, sent});
  if (fate.twin) late_.push_back({now, *fate.twin});
}

void OuterBus::tick(WiredPack& pack) {
  const TimePoint now = pack.now();
  for (const SentFrame& word : pack.simulator().sent_by_charger()) carry(word.frame, now);
  for (const SentFrame& word : pack.simulator().sent_by_inverter()) carry(word.frame, now);
  std::erase_if(late_, [this, now](const Due& due) {
    if (due.at > now) return false;
    if (bus_.waiting(devices) < device_queue_length) put(devices, due.frame);
    return true;
  });
  if (flood && bus_.waiting(Station::stranger) == 0) put(Station::stranger, *flood);
  if (is_idle_) return;
  for (const BusEvent& event : bus_.take_due(now)) {
    if (event.kind == BusEvent::Kind::heard) take_heard(event, pack);
  }
  bus_.start_if_idle(now);
  is_idle_ = bus_.next_at() == TimePoint::max();
}

void OuterBus::take_heard(const BusEvent& event, WiredPack& pack) {
  const bool is_ours = event.station == Station::master;
  const bool are_deaf = is_ours && wire.loses();
  if (is_ours && on_carried) on_carried(event.frame, !are_deaf);
  pack.carry_elsewhere(port_, event.frame, is_ours, are_deaf);
}

void OuterBus::set_power(bool is_on, TimePoint now) {
  is_port_up_ = true;
  bus_.drop_queue(Station::master);
  if (!is_on) return bus_.disconnect(Station::master);
  bus_.connect(Station::master);
  bus_.restart(Station::master, now);
}

/// All ports that the interface serves go with it.
void OuterBus::set_port(bool is_up, WiredPack& pack) {
  is_port_up_ = is_up;
  if (!is_up) bus_.drop_queue(Station::master);
  for (const Port port : all_ports) {
    if (serves(*config_, port_, port)) pack.observe(PortChanged{port, is_up});
  }
}

bool OuterBus::is_disturbed() const {
  return wire.lost_permille > 0 || flood.has_value() || !is_port_up_;
}

void OuterBus::send_as_stranger(const CanFrame& frame) {
  put(Station::stranger, frame);
}

}  // namespace bmu::test
