#include "tests/simulation/stage.hpp"

namespace bmu::test {

namespace {

constexpr std::int64_t unix_time_at_start_ms = 1'700'000'000'000;
constexpr std::int32_t cell_noise_uV = 300;      // without any, a pack at rest would be one whose values stand still
constexpr std::size_t device_queue_length = 16;  // as a controller has, for a module's whole answer

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
      store(seed ^ 0x570EULL),
      began_at_(starts_at),
      random_(seed ^ 0xB007ULL) {
  pack.device_queue_length = device_queue_length;
  pack.cut_power();
  boot();
}

void Stage::cut_power() {
  pack.cut_power();
  store.cut_power();
}

void Stage::boot() {
  pack.boot(store.kept(), static_cast<std::uint8_t>(random_.next()));
  store.begin_life();
  tell_wall_clock();
}

void Stage::tell_wall_clock() {
  const std::int64_t since_start_ms = to_ms(pack.now() - began_at_);
  pack.observe(WallClockSeen{unix_time_at_start_ms + since_start_ms + wall_offset_ms});
}

}  // namespace bmu::test
