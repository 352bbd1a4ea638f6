// Environment of a simulated run: the core with the emulated pack and its bus (wired_pack.hpp), a wire with faults,
// another bus with a charger or an inverter if the pack has one, a store that saves the core's state with a delay, and
// a wall clock that can be set.
#pragma once

#include <optional>

#include "tests/simulation/faulty_wire.hpp"
#include "tests/simulation/outer_bus.hpp"
#include "tests/support/wired_pack.hpp"

namespace bmu::test {

/// The state file of the daemon: it holds a recent state of the core, complete, or the one before it.
class StateStore {
 public:
  explicit StateStore(std::uint64_t seed) : random_(seed) {}

  /// After each decision. A change is written within `write_time_max`; changes meanwhile are written afterwards.
  void follow(const Core& core, TimePoint now);
  /// The machine has lost its power: a write in progress is lost.
  void cut_power() { writing_.reset(); }
  /// A core starts: its whole state counts as changed.
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
  /// Feeds the wall clock as the daemon's shell would: once a second and at the start of a session.
  void tell_wall_clock();
  /// Whether the core can receive observations now.
  [[nodiscard]] bool is_alive() const { return pack.has_power() && !pack.is_stalled(); }

  WiredPack pack;
  FaultyWire wire;
  OuterBus outer;
  StateStore store;
  std::int64_t wall_offset_ms = 0;  // error of the wall clock

 private:
  TimePoint began_at_;
  RandomSource random_;
};

}  // namespace bmu::test
