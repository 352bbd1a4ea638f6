// Where a simulated life takes place: the core with the emulated pack and its bus (wired_pack.hpp), a wire that fails,
// another bus with a charger or an inverter where the pack has one, a store that keeps the core's state some time after
// it was told, and a wall clock that anybody may set.
#pragma once

#include <optional>

#include "tests/simulation/faulty_wire.hpp"
#include "tests/simulation/outer_bus.hpp"
#include "tests/support/wired_pack.hpp"

namespace bmu::test {

/// The state file of the daemon: it holds what the core wanted kept a moment ago, whole, or what was there before.
class StateStore {
 public:
  explicit StateStore(std::uint64_t seed) : random_(seed) {}

  /// After each decision. What has changed is written within `write_time_max`; what changes meanwhile comes afterwards.
  void follow(const Core& core, TimePoint now);
  /// The machine has no power any more: what was being written is lost.
  void cut_power() { writing_.reset(); }
  /// A core begins: all of it is news.
  void begin_life() { generation_.reset(); }
  [[nodiscard]] const PersistentState& kept() const { return kept_; }

  static constexpr Duration write_time_max = 200ms;

 private:
  struct Writing {
    TimePoint done_at;
    PersistentState state;
  };
  RandomSource random_;
  std::optional<std::uint32_t> generation_;
  std::optional<Writing> writing_;
  PersistentState kept_;
};

class Stage {
 public:
  Stage(const CoreConfig& config, std::uint64_t seed, Duration devices_ahead, TimePoint starts_at);

  void cut_power();
  void boot();
  /// The wall clock as the daemon's shell would tell it: once a second and as a life begins.
  void tell_wall_clock();
  /// The core can be told something now and takes it in.
  [[nodiscard]] bool is_alive() const { return pack.has_power() && !pack.is_stalled(); }

  WiredPack pack;
  FaultyWire wire;
  OuterBus outer;
  StateStore store;
  std::int64_t wall_offset_ms = 0;  // how far the wall clock is off

 private:
  TimePoint began_at_;
  RandomSource random_;
};

}  // namespace bmu::test
