#include "tools/bmureplay/run.hpp"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstdlib>
#include <deque>
#include <future>
#include <type_traits>
#include <utility>

#include "config/checks/bus_rate.hpp"
#include "tools/bmureplay/run_spans.hpp"

namespace bmu::replay {

namespace {

/// Result of one part.
struct PartOutcome {
  Part part;
  std::string version;
  std::string pack_name;
  std::optional<BlackBoxHead> black_box;
  ReplayCounts counts;
  std::int64_t first_log_us = 0;  // of the first tick that was run at all
  std::int64_t from_log_us = 0;   // of the part
  std::int64_t until_log_us = 0;
  TimePoint from{};
  TimePoint until{};
  std::vector<ClockSetting> clock_settings;
  std::uint64_t checksum_at_begin = 0;
  std::uint64_t checksum_at_end = 0;  // 0: the end was not reached
  RecordPartId id;
  std::vector<Difference> differences;
  std::vector<Damage> alterations;
  std::optional<RecordProblem> problem;
  std::int64_t end_log_us = 0;  // after a problem: of the latest following line with a time; 0: none has a time
};

/// Reads the head of a black box from the lines before the first head.
std::optional<BlackBoxHead> black_box_of(const std::string& file, std::string_view text) {
  constexpr std::string_view mark = "# black-box ";
  if (!text.starts_with(mark)) return std::nullopt;
  return BlackBoxHead{.file = file, .cause = std::string(text.substr(mark.size(), text.find('\n') - mark.size()))};
}

constexpr std::string_view clock_line_begin = "# ahead_us ";

/// Change of the wall clock in these lines.
std::int64_t set_in(std::string_view text, const RecordReader& reader) {
  const std::size_t at = text.rfind(std::string("\n").append(clock_line_begin));
  if (at == std::string_view::npos) return 0;
  std::int64_t ahead_us = reader.clock().ahead_us;
  std::from_chars(text.data() + at + 1 + clock_line_begin.size(), text.data() + text.size(), ahead_us);
  return ahead_us - reader.clock().ahead_us;
}

/// Time of the latest line that has one, by the clock at the position where reading ended; 0: none has one.
std::int64_t end_log_us_of(std::string_view text, const RecordReader& reader) {
  const std::int64_t set_by_us = set_in(text, reader);
  while (!text.empty()) {
    text.remove_suffix(1);  // its line feed
    const std::size_t begin = text.rfind('\n') + 1;
    const auto parsed = parse_record_line(text.substr(begin), reader.clock(), reader.buses());
    if (parsed) {
      if (const auto* const tick = std::get_if<RecordTick>(&*parsed))
        return reader.clock().to_log_us(tick->at) - set_by_us;
      if (const auto* const seen = std::get_if<Observation>(&*parsed))
        return reader.clock().to_log_us(seen->at) - set_by_us;
    }
    text = text.substr(0, begin);
  }
  return 0;
}

/// Feeds the lines of a part to a replay, and collects the differences.
class PartRun {
 public:
  explicit PartRun(const RunOptions& options) : options_(options) {}

  template <class Runner>
  [[nodiscard]] PartOutcome run(Part part, Runner& replay) {
    outcome_ = {};
    lines_before_ = replay.counts().lines;
    const ReplayCounts before = replay.counts();
    const std::string text = std::move(part.text);
    part.text.clear();
    outcome_.part = std::move(part);
    outcome_.black_box = black_box_of(outcome_.part.file, text);
    const std::string_view rest = take_lines(text, replay);
    if constexpr (std::is_same_v<Runner, Replay>) replay.end();
    outcome_.counts = difference(replay.counts(), before);
    outcome_.problem = replay.problem();
    outcome_.first_log_us = replay.counts().first_log_us;
    const RecordReader& reader = replay.reader();
    if (outcome_.problem) {
      outcome_.problem->line = line_in_file(outcome_.problem->line);
      outcome_.end_log_us = end_log_us_of(rest, reader);
    }
    if (outcome_.counts.begun > 0) {
      outcome_.from_log_us = reader.part_from_log_us();
      outcome_.until_log_us = reader.part_until_log_us();
      outcome_.from = reader.part_from();
      outcome_.until = reader.part_until();
    }
    outcome_.version = reader.version();
    outcome_.pack_name = reader.pack() ? reader.pack()->name : "";
    outcome_.id = reader.part_id();
    outcome_.checksum_at_begin = reader.checksum();
    return std::move(outcome_);
  }

  void take(const RecordProblem& alteration) {
    if (outcome_.alterations.size() == damages_max) return;
    outcome_.alterations.push_back(
        {.file = outcome_.part.file, .line = line_in_file(alteration.line), .text = alteration.text});
  }

  void take(const ReplayDifference& difference) {
    if (outcome_.differences.size() == options_.differences_max) return;
    outcome_.differences.push_back({.file = outcome_.part.file,
                                    .line = line_in_file(difference.line),
                                    .log_us = difference.log_us,
                                    .at = difference.at,
                                    .recorded = difference.recorded,
                                    .replayed = difference.replayed});
  }

 private:
  /// Returns the remaining text, from the line that could not be processed.
  template <class Runner>
  std::string_view take_lines(std::string_view text, Runner& replay) {
    while (!text.empty()) {
      const std::size_t end = text.find('\n');
      if (!replay.take(text.substr(0, end))) break;
      if (text.starts_with(clock_line_begin)) note_clock(replay);
      text.remove_prefix(end + 1);
    }
    return text;
  }
  /// Stores changes within a part; the clock of its head is compared with that of the part before (Joins).
  template <class Runner>
  void note_clock(const Runner& replay) {
    const RecordReader& reader = replay.reader();
    const std::int64_t ahead_us = reader.clock().ahead_us;
    const std::int64_t set_by_us = ahead_us - std::exchange(clock_ahead_us_, ahead_us);
    const bool is_in_part = reader.part_from_log_us() != 0;
    if (is_in_part && std::llabs(set_by_us) >= Joins::clock_setting_min_us) {
      outcome_.clock_settings.push_back({.line = line_in_file(replay.counts().lines), .by_us = set_by_us});
    }
  }
  static ReplayCounts difference(ReplayCounts now, const ReplayCounts& before) {
    now.lines -= before.lines;
    now.observations -= before.observations;
    now.ticks -= before.ticks;
    now.ticks_different -= before.ticks_different;
    now.begun -= before.begun;
    now.covered -= before.covered;
    return now;
  }
  [[nodiscard]] std::uint64_t line_in_file(std::uint64_t line) const {
    return outcome_.part.first_line + (line - lines_before_) - 1;
  }

  const RunOptions& options_;
  PartOutcome outcome_;
  std::uint64_t lines_before_ = 0;
  std::int64_t clock_ahead_us_ = 0;
};

PartOutcome run_alone(Part part, const RunOptions& options) {
  PartRun run(options);
  Replay replay({.differs = [&](const ReplayDifference& difference) { run.take(difference); },
                 .altered = [&](const RecordProblem& alteration) { run.take(alteration); }});
  PartOutcome outcome = run.run(std::move(part), replay);
  if (!outcome.problem && !outcome.part.ends_torn) outcome.checksum_at_end = replay.checksum();
  return outcome;
}

void add(ReplayCounts& all, const ReplayCounts& one) {
  all.lines += one.lines;
  all.observations += one.observations;
  all.ticks += one.ticks;
  all.ticks_different += one.ticks_different;
  all.begun += one.begun;
  all.covered += one.covered;
}

std::string line_of(const Damage& damage) {
  return damage.file + (damage.line == 0 ? "" : ":" + std::to_string(damage.line)) + ": " + damage.text;
}

/// Merges the results of the parts, in their order.
class Merger {
 public:
  Merger(Outcome& outcome, const RunOptions& options) : outcome_(outcome), options_(options) {}

  void take(PartOutcome part) {
    if (outcome_.version.empty()) outcome_.version = part.version;
    if (outcome_.pack_name.empty()) outcome_.pack_name = part.pack_name;
    if (outcome_.first_log_us == 0) outcome_.first_log_us = part.first_log_us;
    if (part.black_box) outcome_.black_boxes.push_back(*part.black_box);
    add(outcome_.counts, part.counts);
    follow_life(part);
    take_differences(part);
    take_span(part);
    take_problem(part);
    const bool is_next = part.part.file == file_before_ && part.id.follows(id_before_) && checksum_before_ != 0 &&
                         part.checksum_at_begin != 0;
    if (is_next && !options_.other) {
      ++outcome_.states_compared;
      if (part.checksum_at_begin != checksum_before_) ++outcome_.states_different;
    }
    checksum_before_ = part.checksum_at_end;
    id_before_ = part.id;
    file_before_ = part.part.file;
    if (options_.progress) options_.progress(outcome_.counts.covered);
  }

  /// Called after the last part.
  void end(const PartReader& reader) {
    for (const Problem& problem : problems_) take_at_end(problem);
    for (Damage damage : reader.damages()) {
      if (damage.goes_on_line != 0) spans_.complete(damage);
      outcome_.damages.push_back(std::move(damage));
    }
    outcome_.joins = joins_.found();
    outcome_.has_unreadable_file = reader.has_failed();
  }

 private:
  /// The line at which the file resumes is determined later.
  struct Problem {
    Damage damage;
    RecordProblemKind kind = RecordProblemKind::damaged;
    std::size_t span = 0;  // of its part
  };

  /// Keeps the clock of the session's start: later changes of the clock are not elapsed time.
  void follow_life(const PartOutcome& part) {
    if (part.from_log_us == 0) return;
    const bool goes_on = part.id.life != 0 && part.id.life == life_;
    life_ = part.id.life;
    if (!goes_on) life_clock_.ahead_us = part.from_log_us - RecordClock{}.to_log_us(part.from);
  }
  void take_differences(PartOutcome& part) {
    for (Difference& difference : part.differences) {
      if (outcome_.differences.size() == options_.differences_max) break;
      difference.since_begin = std::chrono::microseconds(life_clock_.to_log_us(difference.at) - outcome_.first_log_us);
      for (const Damage& alteration : part.alterations) {
        if (alteration.line <= difference.line) difference.altered_line = alteration.line;
      }
      outcome_.differences.push_back(std::move(difference));
    }
  }
  void take_span(const PartOutcome& part) {
    const bool is_other_file = part.part.file != file_before_;
    is_black_box_ = part.black_box || (!is_other_file && is_black_box_);
    const PartSpan span{.file = part.part.file,
                        .first_line = part.part.first_line,
                        .id = part.id,
                        .from_log_us = part.from_log_us,
                        .until_log_us = part.until_log_us,
                        .from = part.from,
                        .until = part.until,
                        .is_black_box = is_black_box_,
                        .clock_settings = part.clock_settings};
    joins_.take(span);
    spans_.take(span, part.end_log_us);
  }
  void take_problem(const PartOutcome& part) {
    outcome_.damages.insert(outcome_.damages.end(), part.alterations.begin(), part.alterations.end());
    if (!part.problem) return;
    const RecordProblem& problem = *part.problem;
    if (problem.kind == RecordProblemKind::other_pack) {
      outcome_.misfit = "does not fit " + part.part.file + ": " + problem.text;
      return;
    }
    if (problems_.size() == damages_max) return;
    problems_.push_back({.damage = {.file = part.part.file, .line = problem.line, .text = problem.text},
                         .kind = problem.kind,
                         .span = spans_.size() - 1});
  }
  /// A recording with a missing beginning counts as damaged only if other parts of its file could be run.
  void take_at_end(Problem problem) {
    const bool is_damage = problem.kind == RecordProblemKind::damaged ||
                           (problem.kind == RecordProblemKind::no_recording && spans_.has_run(problem.damage.file));
    if (!is_damage) return outcome_.not_replayable.push_back(line_of(problem.damage));
    spans_.complete(problem.damage, problem.span);
    outcome_.damages.push_back(std::move(problem.damage));
  }

  Outcome& outcome_;
  const RunOptions& options_;
  std::uint64_t checksum_before_ = 0;
  RecordPartId id_before_;
  std::int64_t life_ = 0;
  RecordClock life_clock_;
  std::string file_before_;  // a file has no gaps; between two files there may be one
  bool is_black_box_ = false;
  Joins joins_;
  RunSpans spans_;
  std::vector<Problem> problems_;
};

void run_beside_each_other(PartReader& reader, const RunOptions& options, Merger& merger) {
  std::deque<std::future<PartOutcome>> running;
  const auto take_first = [&] {
    merger.take(running.front().get());
    running.pop_front();
  };
  while (auto part = reader.next()) {
    if (running.size() >= options.threads) take_first();
    running.push_back(std::async(std::launch::async, run_alone, std::move(*part), std::cref(options)));
  }
  while (!running.empty()) take_first();
}

/// "" if the recorded state fits the other pack; else the reason.
std::string misfit(const CoreConfig& recorded, const CoreConfig& other) {
  if (recorded.modules.size() != other.modules.size()) {
    const std::size_t count = other.modules.size();
    return "it has " + std::to_string(count) + (count == 1 ? " module" : " modules") + ", the recorded pack " +
           std::to_string(recorded.modules.size());
  }
  for (std::size_t index = 0; index < recorded.modules.size(); ++index) {
    const ModuleConfig& then = recorded.modules[index];
    const ModuleConfig& now = other.modules[index];
    if (then.node != now.node || then.cell_count != now.cell_count) {
      return "its module " + std::to_string(index + 1) + " has node " + std::to_string(now.node) + " and " +
             std::to_string(now.cell_count) + " cells, that of the recorded pack node " + std::to_string(then.node) +
             " and " + std::to_string(then.cell_count);
    }
  }
  return "";
}

/// Uses the recorded bit rate, which is independent of the limits.
Result<CoreConfig, std::string> instead_of(const PackConfig& recorded, const PackConfig& other) {
  CoreConfig config = at_rate(other, std::int64_t{recorded.buses.internal_kbit_per_s} * 1000).core;
  std::string reason = misfit(recorded.core, config);
  if (!reason.empty()) return failure(std::move(reason));
  return config;
}

void run_otherwise(PartReader& reader, const RunOptions& options, Merger& merger, DecisionChanges& changes) {
  PartRun run(options);
  WhatIf what_if({.other = [&](const PackConfig& recorded) { return instead_of(recorded, *options.other); },
                  .moves = [&](const WhatIfMove& move) { changes.take(move); },
                  .reports = [&](const WhatIfReport& report) { changes.take(report); },
                  .altered = [&](const RecordProblem& alteration) { run.take(alteration); }});
  std::string file_before;
  bool is_torn = false;
  while (auto part = reader.next()) {
    const bool is_other_file = std::exchange(file_before, part->file) != part->file;
    if (is_other_file || is_torn) what_if.break_off();
    is_torn = part->ends_torn;
    merger.take(run.run(std::move(*part), what_if));
    if (what_if.problem() && what_if.problem()->kind == RecordProblemKind::other_pack) break;
    is_torn = is_torn || what_if.problem().has_value();
  }
  what_if.end();
}

}  // namespace

Outcome run(PartReader& reader, const RunOptions& options) {
  Outcome outcome;
  Merger merger(outcome, options);
  const auto began = std::chrono::steady_clock::now();
  if (options.other) {
    run_otherwise(reader, options, merger, outcome.changes);
  } else {
    run_beside_each_other(reader, options, merger);
  }
  outcome.took = std::chrono::steady_clock::now() - began;
  merger.end(reader);
  return outcome;
}

}  // namespace bmu::replay
