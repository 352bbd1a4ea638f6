// Lets a scenario happen: its events to the world, its conditions against the world and the frames on the bus.
//
//   ScenarioPlayer player(scenario, seed, start, internal_bus::catalogue);
//   player.take_due(now, world);       before each step of the world: events and conditions whose time has come
//   player.look(now, world);           after it: what is waited for, what must always or never be
//   player.see(frame, now);            every frame on the bus, whoever sent it
//   player.conclude(now);              at the end of the run, if the script has not ended it itself
//
// The first condition that does not hold ends the script: nothing more of it happens, and failure() says why. A wait
// that is met at once costs no time: what follows it happens in the same step. A frame counts if its length and, where
// it has one, its checksum are right.
//
// No allocation after the construction but for the text of a failure. Cost: a few compares a step and condition; the
// states that look at every cell (pack cell_voltage_min_mV, ...) cost about 1 us for 756 cells.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "mmu/scenario/scenario_plan.hpp"
#include "mmu/scenario/scenario_state.hpp"
#include "protocol/message.hpp"

namespace bmu {

enum class ScriptVerdict : std::uint8_t {
  open,        // it goes on
  passed,      // `pass`, or the run ended and everything held
  failed,      // a condition did not hold, or `fail`
  unfinished,  // the run ended before the script: something was not tried
};
[[nodiscard]] std::string_view to_text(ScriptVerdict verdict);

/// What became of a condition.
struct ScenarioOutcome {
  const ScenarioStep* step = nullptr;
  bool has_held = false;
  TimePoint began_at{};
  TimePoint ended_at{};
};

/// What has just happened: an event, or a condition that was decided.
struct ScenarioNews {
  const ScenarioStep* step = nullptr;
  TimePoint at{};
};

class ScenarioPlayer {
 public:
  /// `catalogue` says how this bus's frames are read.
  ScenarioPlayer(Scenario scenario, std::uint64_t seed, TimePoint started_at, const Catalogue& catalogue);

  void take_due(TimePoint now, World& world);
  void look(TimePoint now, const World& world);
  void see(const CanFrame& frame, TimePoint now);
  ScriptVerdict conclude(TimePoint now);

  /// What the master last said of itself; conditions about it look at this.
  void note_master(const MasterReport& report) { master_ = report; }

  [[nodiscard]] ScriptVerdict verdict() const { return verdict_; }
  /// The line that decided a failure or ended the run; null: none did.
  [[nodiscard]] const ScenarioLine* deciding_line() const { return deciding_line_; }
  /// "at 12.345 s: waited 0.3 s for contactor main_positive open; found closed"; empty unless failed or unfinished.
  [[nodiscard]] const std::string& failure() const { return failure_; }
  /// Everything has happened that will, ramps to their end, but for what must hold to the end of the run.
  [[nodiscard]] bool is_over() const;
  [[nodiscard]] const Scenario& scenario() const { return scenario_; }
  [[nodiscard]] const ScenarioLine& line_of(const ScenarioStep& step) const { return scenario_.lines[step.line_index]; }
  [[nodiscard]] const ScenarioPlan& plan() const { return plan_; }
  [[nodiscard]] TimePoint started_at() const { return started_at_; }
  /// In the order in which they were decided. Those that hold to the end of the run come with conclude().
  [[nodiscard]] std::span<const ScenarioOutcome> outcomes() const { return outcomes_; }
  /// Since forget_news().
  [[nodiscard]] std::span<const ScenarioNews> news() const { return news_; }
  void forget_news() { news_.clear(); }

 private:
  /// A section that has begun and has steps left.
  struct Cursor {
    std::size_t next = 0;
    std::size_t end = 0;
    TimePoint begins{};
  };
  /// A condition that is being watched.
  struct Watch {
    const ScenarioStep* step = nullptr;
    TimePoint began_at{};
    std::optional<TimePoint> ends_at{};
    std::optional<CanFrame> last_frame{};  // the last that could have been it
    TimePoint last_frame_at{};
  };

  [[nodiscard]] Cursor* due_cursor(TimePoint now);
  void begin_section(std::size_t section, TimePoint now);
  void take(const ScenarioStep& step, TimePoint at, TimePoint now, World& world);
  void take_wait(const ScenarioStep& step, TimePoint at, TimePoint now, const World& world);
  void look_at_wait(TimePoint now, const World& world);
  void look_at_lasting(TimePoint now, const World& world);
  void decide(const Watch& watch, bool has_held, TimePoint now);
  void met(TimePoint now);
  void fail(const Watch& watch, TimePoint now, const std::string& found);
  void end(ScriptVerdict verdict, const ScenarioStep& step);
  [[nodiscard]] bool is_so(const ScenarioCondition& condition, const World& world) const;
  [[nodiscard]] std::string found_state(const ScenarioCondition& condition, const World& world) const;
  [[nodiscard]] std::string found_frame(const Watch& watch, TimePoint now) const;
  [[nodiscard]] const ScenarioCondition& condition_of(const Watch& watch) const {
    return line_of(*watch.step).condition;
  }
  [[nodiscard]] std::size_t untried_conditions() const;

  Scenario scenario_;
  ScenarioPlan plan_;
  TimePoint started_at_;
  TimePoint looked_at_;
  TimePoint ramps_end_at_;  // of all that have begun
  MasterReport master_;
  std::vector<Cursor> cursors_;
  std::optional<Watch> wait_;
  std::vector<Watch> lasting_;
  std::vector<ScenarioOutcome> outcomes_;
  std::vector<ScenarioNews> news_;
  ScriptVerdict verdict_ = ScriptVerdict::open;
  const ScenarioLine* deciding_line_ = nullptr;
  std::string failure_;
};

}  // namespace bmu
