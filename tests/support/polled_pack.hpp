// A core and modules on a bus with exact frame lengths, to measure the duration of a poll cycle: from the first bit of
// a POLL to the last answer received. The master, its PDU and its sensor send their usual frames.
//
//   prompt modules   answer as soon as the POLL is through, and give their controller all frames at once
//   ticked ones      answer with their next millisecond, and give it all frames at once: mmusim --frame-spacing-us 0
//   paced ones       answer with their next millisecond and go on at one frame per 250 us, as mmusim's do by default
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "daemon/core/core.hpp"
#include "mmu/devices/current_sensor.hpp"
#include "mmu/devices/mmu.hpp"
#include "mmu/devices/pdu.hpp"
#include "tests/support/can_bus.hpp"

namespace bmu::test {

enum class Pace : std::uint8_t { prompt, ticked, paced };

struct PollCycle {
  TimePoint began_at{};     // first bit of the POLL
  Duration took{};          // to the last answer received
  Duration minimum{};       // POLL and answers with their own bits, in immediate succession
  Duration others{};        // of that, other frames in between
  std::size_t answers = 0;  // frames
};

class PolledPack {
 public:
  PolledPack(const CoreConfig& config, std::int64_t bits_per_s, Pace pace);

  /// Complete cycles with cells and temperatures, without identities, that ended in this time.
  std::vector<PollCycle> run(Duration duration);
  [[nodiscard]] Duration busy() const { return bus_.busy(now_); }
  [[nodiscard]] const CanBus& bus() const { return bus_; }

 private:
  void step(TimePoint end);
  void take_heard(const BusEvent& event);
  void follow_cycle(const BusEvent& event);
  void tick_devices();
  void tick_module(std::size_t module);
  void observe(const ObservedThing& what);
  void decide();

  Pace pace_;
  Core core_;
  std::vector<Mmu> modules_;
  std::vector<FrontEndTransfer> transfers_;  // of each module's front end, constant
  Pdu pdu_;
  CurrentSensor sensor_;
  CanBus bus_;
  Duration bit_time_;
  std::size_t answers_wanted_ = 0;  // frames, to a POLL for cells and temperatures
  TimePoint now_{1s};
  TimePoint devices_tick_at_{1s};
  TimePoint wake_at_{1s};
  std::optional<PollCycle> cycle_;
  std::vector<PollCycle> done_;
};

}  // namespace bmu::test
