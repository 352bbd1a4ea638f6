#include "tools/mmusim/virtual.hpp"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <optional>
#include <string>
#include <utility>

#include <unistd.h>

#include "daemon/shell/can/bus_port.hpp"
#include "tools/common/virtual_run.hpp"
#include "tools/mmusim/recording.hpp"

namespace bmu::sim {
namespace {

/// Number of steps between two checks of the clock and the signals.
constexpr int steps_per_look = 1'000;
constexpr Duration progress_period = 500ms;

/// The name of the pending stop signal; none: there is none.
std::optional<std::string> stop_signal() {
  sigset_t pending{};
  sigpending(&pending);
  for (const int signal : {SIGINT, SIGTERM}) {
    if (sigismember(&pending, signal) == 1) return stop_signal_name(signal);
  }
  return std::nullopt;
}

/// One line on a terminal, which is overwritten.
class Progress {
 public:
  Progress(const Options& options, TimePoint began_at)
      : seconds_(options.seconds), is_wanted_(!options.is_quiet && ::isatty(STDERR_FILENO) == 1), began_at_(began_at) {}

  void show(double ran_s, TimePoint now) {
    if (!is_wanted_ || now < shown_at_ + progress_period) return;
    shown_at_ = now;
    const double speed = ran_s / to_s(now - began_at_);
    std::fprintf(stderr, "\r%.0f s", ran_s);
    if (seconds_) std::fprintf(stderr, " of %.0f s", *seconds_);
    std::fprintf(stderr, ", %.0f times real time\x1b[K", speed);
    is_shown_ = true;
  }
  void clear() {
    if (is_shown_) std::fputs("\r\x1b[K", stderr);
    is_shown_ = false;
  }

 private:
  std::optional<double> seconds_;
  bool is_wanted_;
  TimePoint began_at_;
  TimePoint shown_at_ = began_at_;
  bool is_shown_ = false;
};

class Teller {
 public:
  Teller(const Options& options, const VirtualRun& run, Progress& progress)
      : run_(&run), progress_(&progress), is_quiet_(options.is_quiet) {}

  void tell() {
    const ScenarioPlayer& script = run_->simulator().script();
    const bool has_news = !script.news().empty() || told_events_ < run_->events().size();
    if (is_quiet_ || !has_news) return;
    progress_->clear();
    for (const ScenarioNews& news : script.news()) print(news.at, news_text(script, news));
    for (; told_events_ < run_->events().size(); ++told_events_) {
      const Event& event = run_->events()[told_events_];
      if (row_of(event.id).severity != Severity::debug) print(event.at, "master: " + to_text(event));
    }
  }

 private:
  static void print(TimePoint at, const std::string& text) {
    std::fprintf(stderr, "%8.3f s  %s\n", to_s(at - VirtualRun::start), text.c_str());
  }

  const VirtualRun* run_;
  Progress* progress_;
  bool is_quiet_;
  std::size_t told_events_ = 0;
};

bool is_over(const Options& options, const VirtualRun& run) {
  const ScenarioPlayer& script = run.simulator().script();
  if (script.verdict() != ScriptVerdict::open) return true;
  return options.seconds ? to_s(run.elapsed()) >= *options.seconds : script.is_over();
}

std::vector<Opening> openings_of(const VirtualRun& run) {
  std::vector<Opening> openings;
  for (const Event& event : run.events()) {
    if (event.id == EventId::opened) openings.push_back({to_s(event.at - VirtualRun::start), to_text(event)});
  }
  return openings;
}

RunResult result_of(const VirtualRun& run, Duration took) {
  RunResult result{
      .script = &run.simulator().script(), .ran_s = to_s(run.elapsed()), .took_s = std::max(to_s(took), 1e-6)};
  const SimulatorCounts counts = run.simulator().counts();
  result.lines.push_back("frames: " + std::to_string(counts.frames_sent) + " of the pack, " +
                         std::to_string(counts.frames_observed) + " to it");
  if (run.has_core()) result.openings = openings_of(run);
  return result;
}

VirtualRun make_run(const Options& options, const PackConfig& pack, const SimulatorConfig& config, Scenario scenario) {
  if (options.has_master) return {pack.core, config, std::move(scenario)};
  return {config, std::move(scenario)};
}

}  // namespace

int run_virtual(const Options& options, const PackConfig& pack, const SimulatorConfig& config, Scenario scenario) {
  VirtualRun run = make_run(options, pack, config, std::move(scenario));
  const TimePoint began_at = monotonic_now();
  std::optional<Recording> recording;
  if (!options.record.empty()) recording.emplace(options.record, pack, run);
  Progress progress(options, began_at);
  Teller teller(options, run, progress);
  std::optional<std::string> ended_by;
  for (std::uint64_t step = 1; !ended_by && !is_over(options, run); ++step) {
    run.step();
    teller.tell();
    if (step % steps_per_look != 0) continue;
    ended_by = stop_signal();
    progress.show(to_s(run.elapsed()), monotonic_now());
  }
  progress.clear();
  if (recording && !recording->finish()) {
    std::fprintf(stderr, "mmusim: %s: cannot be written: %s\n", options.record.c_str(), std::strerror(errno));
    return exit_system;
  }
  run.simulator().script().conclude(run.now());
  RunResult result = result_of(run, monotonic_now() - began_at);
  result.ended_by_signal = std::move(ended_by);
  return tell_result(options, result);
}

}  // namespace bmu::sim
