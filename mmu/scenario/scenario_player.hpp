// Executes a scenario: applies its events to the world, checks its conditions on the world and on the frames on the
// bus.
//
//   ScenarioPlayer player(scenario, seed, start, internal_bus::catalogue);
//   player.take_due(now, world);       before each step of the world: events and conditions that are due
//   player.look(now, world);           after it: the present wait, and what must always or never be met
//   player.see(frame, now);            every frame on the bus, of any sender
//   player.conclude(now);              at the end of the run, if the script has not ended it itself
//
// The first condition that is not met ends the script: no further line is executed, and failure() gives the reason. A
// wait that is met at once takes no time: the lines after it are executed in the same step. A frame counts if its
// length and, if it has one, its checksum are right.
//
// No allocation after the construction except for the text of a failure. Cost: a few comparisons per step and
// condition; the states that read every cell (pack cell_voltage_min_mV, ...) take about 1 us for 756 cells.
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
  open,        // in progress
  passed,      // `pass`, or the run ended and all conditions were met
  failed,      // a condition was not met, or `fail`
  unfinished,  // the run ended before the script: at least one condition was not tested
};
[[nodiscard]] std::string_view to_text(ScriptVerdict verdict);

/// Result of a condition.
struct ScenarioOutcome {
  const ScenarioStep* step = nullptr;
  bool has_held = false;
  TimePoint began_at{};
  TimePoint ended_at{};
};

/// Progress of the script: an event, or a condition that was decided.
struct ScenarioNews {
  const ScenarioStep* step = nullptr;
  TimePoint at{};
};

class ScenarioPlayer {
 public:
  /// `catalogue`: rows with which this bus's frames are decoded.
  ScenarioPlayer(Scenario scenario, std::uint64_t seed, TimePoint started_at, const Catalogue& catalogue);

  void take_due(TimePoint now, World& world);
  void look(TimePoint now, const World& world);
  void see(const CanFrame& frame, TimePoint now);
  ScriptVerdict conclude(TimePoint now);

  /// Stores the last report of the master, which its conditions use.
  void note_master(const MasterReport& report) { master_ = report; }

  [[nodiscard]] ScriptVerdict verdict() const { return verdict_; }
  /// The line that decided a failure or ended the run; null: none did.
  [[nodiscard]] const ScenarioLine* deciding_line() const { return deciding_line_; }
  /// "at 12.345 s: waited 0.3 s for contactor main_positive open; found closed"; empty unless failed or unfinished.
  [[nodiscard]] const std::string& failure() const { return failure_; }
  /// Whether all lines and ramps are complete, except conditions that apply until the end of the run.
  [[nodiscard]] bool is_over() const;
  [[nodiscard]] const Scenario& scenario() const { return scenario_; }
  [[nodiscard]] const ScenarioLine& line_of(const ScenarioStep& step) const { return scenario_.lines[step.line_index]; }
  [[nodiscard]] const ScenarioPlan& plan() const { return plan_; }
  [[nodiscard]] TimePoint started_at() const { return started_at_; }
  /// In the order in which they were decided. Those that apply until the end of the run are added by conclude().
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
  /// A condition that is being monitored.
  struct Watch {
    const ScenarioStep* step = nullptr;
    TimePoint began_at{};
    std::optional<TimePoint> ends_at{};
    std::optional<CanFrame> last_frame{};  // the last frame of this message with another value
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
  TimePoint ramps_end_at_;  // of all that have started
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
