// bmureplay: runs recordings again and compares every decision.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <string>
#include <thread>

#include <unistd.h>

#include "config/pack_config.hpp"
#include "tools/bmureplay/options.hpp"
#include "tools/bmureplay/print.hpp"
#include "tools/bmureplay/run.hpp"
#include "tools/common/standard_output.hpp"

namespace {

using namespace bmu;
using namespace bmu::replay;

/// One line on a terminal, at most ten times a second.
class Progress {
 public:
  explicit Progress(bool is_shown) : is_shown_(is_shown) {}
  ~Progress() {
    if (has_shown_) std::fputs("\r\033[K", stderr);
  }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void show(Duration covered) {
    const auto now = std::chrono::steady_clock::now();
    if (!is_shown_ || now - shown_at_ < std::chrono::milliseconds(100)) return;
    shown_at_ = now;
    has_shown_ = true;
    std::fprintf(stderr, "\r%.0f s of the recording run\033[K", to_s(covered));
  }

 private:
  bool is_shown_;
  bool has_shown_ = false;
  std::chrono::steady_clock::time_point shown_at_{};
};

int show_config(const Options& options) {
  PartReader reader(options.files);
  const auto part = reader.next();
  Replay replay({});
  std::string_view text = part ? std::string_view(part->text) : std::string_view{};
  // Only up to the end of the head: whether this version can run the recording does not matter here.
  while (!text.empty() && replay.core() == nullptr && replay.take(text.substr(0, text.find('\n')))) {
    text.remove_prefix(text.find('\n') + 1);
  }
  if (replay.reader().sources().pack_text.empty()) {
    std::fprintf(stderr, "bmureplay: %s: no recording with a pack file\n", options.files.front().c_str());
    return exit_not_replayable;
  }
  write_out(replay.reader().sources().pack_text);
  return exit_ok;
}

int run_files(const Options& options) {
  RunOptions wanted{
      .differences_max = options.differences_max,
      .threads = options.threads != 0 ? options.threads : std::max(1U, std::thread::hardware_concurrency())};
  if (!options.config.empty()) {
    auto other = load_pack_config(options.config);
    if (!other) {
      for (const ConfigProblem& problem : other.error()) std::fprintf(stderr, "%s\n", to_text(problem).c_str());
      return exit_config;
    }
    wanted.other = std::move(*other);
  }
  PartReader reader(options.files);
  Outcome outcome;
  {
    Progress progress(!options.is_quiet && ::isatty(STDERR_FILENO) != 0);
    wanted.progress = [&](Duration covered) { progress.show(covered); };
    outcome = run(reader, wanted);
  }
  if (!outcome.misfit.empty()) {
    std::fprintf(stderr, "bmureplay: %s: %s\n", options.config.c_str(), outcome.misfit.c_str());
  }
  if (options.is_json) {
    write_out(outcome_json(outcome, options.config));
  } else if (outcome.misfit.empty() || outcome.counts.ticks > 0) {
    write_out(outcome_text(outcome, options.config));
  }
  return exit_code_of(outcome);
}

}  // namespace

int main(int argc, char** argv) {
  const ParsedOptions parsed = parse_options(argc, argv);
  if (!parsed.options) return end_output("bmureplay", parsed.exit_code);
  const int status = parsed.options->shows_config ? show_config(*parsed.options) : run_files(*parsed.options);
  return end_output("bmureplay", status);
}
