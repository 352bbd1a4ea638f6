// A pack on a bus of its own, one session after another: a new daemon is started, the key is turned, the pack closes,
// and after 300 to 800 ms drawn by lot a fault is injected (injected_fault.hpp). The latency is measured from just
// before the frame that completes the fault's confirmation is written to the bus until the receiving thread (ear.hpp)
// has the command that opens. Then the daemon is killed and the next session starts: within a session nothing closes
// for ten seconds after a fault. So each opening is the first of its daemon, as in a vehicle.
//
// Frames of the same millisecond are written back to back, without the 0.25 ms that each takes on a bus of 500 kbit/s.
// A CELLS frame may so be preceded and followed by all other frames of an answer to a broadcast POLL: the daemon reads
// more at a time than on a real bus.
//
//   begin()   from a thread that may wait: starts the daemon. Only while `is_waiting`.
//   step()    from the thread that emulates, each millisecond
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "config/pack_config.hpp"
#include "daemon/shell/can/bus_port.hpp"
#include "mmu/devices/random.hpp"
#include "mmu/scenario/simulator.hpp"
#include "tests/bench/latency/child.hpp"
#include "tests/bench/latency/ear.hpp"
#include "tests/bench/latency/injected_fault.hpp"

namespace bmu::latency {

enum class Outcome : std::uint8_t {
  none,
  measured,
  never_closed,
  opened_by_itself,
  completed_by_time,  // not by a frame (injected_fault.hpp)
  no_answer,
};

/// The command of a session: a program and its options, for this bus and with this folder for its files.
using CommandFor = std::function<std::vector<std::string>(const std::string& bus, const std::filesystem::path& folder)>;

class EmulatedPack {
 public:
  EmulatedPack(std::size_t number, const PackConfig& pack, FaultChoice fault, CommandFor command,
               const std::filesystem::path& folder, Ear& ear);
  EmulatedPack(const EmulatedPack&) = delete;
  EmulatedPack& operator=(const EmulatedPack&) = delete;
  ~EmulatedPack();

  void begin();
  void step(TimePoint now);

  /// True until the next begin(); then outcome() is the result of the session before, and took() its latency if it was
  /// measured.
  [[nodiscard]] bool is_waiting() const { return stage_.load(std::memory_order_acquire) == Stage::waiting; }
  [[nodiscard]] Outcome outcome() const { return outcome_; }
  [[nodiscard]] Duration took() const { return took_; }
  [[nodiscard]] std::string log() const { return (folder_ / "bmud.log").string(); }

 private:
  enum class Stage : std::uint8_t { waiting, starting, settling, closing, closed, asking, injected };

  void read_frames(bool is_living);
  void advance(TimePoint now);
  void follow(TimePoint now);
  void inject_when_due(TimePoint now);
  void look_for_answer(TimePoint now);
  void apply(const char* event);
  void enter(Stage stage, TimePoint due);
  void end(Outcome outcome);

  std::string bus_;
  CoreConfig pack_;
  FaultChoice fault_;
  SimulatorConfig config_;
  CommandFor command_;
  std::filesystem::path folder_;
  Ear& ear_;
  std::size_t place_;  // index in the ear
  RandomSource random_;
  std::unique_ptr<BusPort> port_;
  std::unique_ptr<Simulator> simulator_;
  Child daemon_;
  std::atomic<Stage> stage_{Stage::waiting};
  TimePoint due_{};
  bool is_commanded_ = false;              // a command of this session was received
  bool is_closed_ = false;                 // according to the last one
  std::optional<InjectedFault> injected_;  // in the present session
  TimePoint completed_at_{};               // zero: its confirmation is not complete
  bool is_completed_by_time_ = false;
  Outcome outcome_ = Outcome::none;
  Duration took_{};
};

}  // namespace bmu::latency
