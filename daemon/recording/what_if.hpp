// Runs a recording with another configuration: a second core receives the observations of the recording's core, decides
// at its own times, and its differences are reported.
//
// It takes over the recorded state at the start, and keeps its own from part to part. The environment does not follow
// it: currents, voltages and contacts are the recorded ones; only the frames that the second core sends are echoed to
// it, while the bus accepted frames in the recording, and the modules answer its polls, with their answers to the
// recording's core (module_answers.hpp). So when the contactors of both diverge that is reported, and the further
// course is unknown: the second core starts again with the state of the next part.
//
// A core with the recorded configuration receives the recorded observations and ticks. From the time at which its
// decision is due until the recorded tick the host gave the daemon no CPU time, and the second core does not decide
// either. So a run costs as much as two cores.
//
// It reports each contactor command that only one of both cores gives, each event that only one of both has within half
// a second, and each message to the vehicle with different bytes. Polls and commands on the internal bus are not
// compared: they carry counters, and their effect shows in the others.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "daemon/recording/module_answers.hpp"
#include "daemon/recording/replay.hpp"

namespace bmu {

/// A difference: something that only one of both courses has. Times are those of the recording's wall clock, less the
/// settings of it by a second or more since the first part from which the run continues.
struct WhatIfMove {
  std::int64_t log_us = 0;
  bool is_recorded = false;
  bool parts = false;  // of the contactors: the further course is unknown
  bool opens = false;  // at least one of them
  std::string text;    // "fault: ...", "contactors: main_negative main_positive"
};

/// A message to the vehicle in which both differ.
struct WhatIfReport {
  std::int64_t log_us = 0;
  CanFrame recorded;
  CanFrame other;
};

struct WhatIfOptions {
  /// The configuration of the second core, or the reason for which it cannot take over the recorded state.
  std::function<Result<CoreConfig, std::string>(const PackConfig& recorded)> other{};
  std::function<void(const WhatIfMove& move)> moves{};
  std::function<void(const WhatIfReport& report)> reports{};
  /// Lines before a tick were modified after writing; the run continues nevertheless.
  std::function<void(const RecordProblem& alteration)> altered{};
};

class WhatIf {
 public:
  explicit WhatIf(WhatIfOptions options) : options_(std::move(options)) {}

  /// Handles the next line, without its line feed. False: it cannot continue; problem() gives the reason.
  [[nodiscard]] bool take(std::string_view line);
  void end();
  /// Lines may be missing before the next part: its state is taken over then. Also to continue after a problem.
  void break_off();

  /// Ticks are those of the second core.
  [[nodiscard]] const ReplayCounts& counts() const { return counts_; }
  [[nodiscard]] const std::optional<RecordProblem>& problem() const { return problem_; }
  [[nodiscard]] const RecordReader& reader() const { return reader_; }

 private:
  struct Echo {
    TimePoint at;
    OutgoingFrame sent;
  };

  [[nodiscard]] bool begin_part();
  void take_observation(const Observation& observation);
  void observe(const Observation& observation);
  void take_frame(const Observation& observation, const FrameReceived& received);
  void observe_as_recorded(const Observation& observation);
  void decide_as_recorded(TimePoint at);
  void give_answers(TimePoint now);
  void take_echo(const Observation& observation, const FrameEchoed& echo);
  void give_late_echoes(TimePoint now);
  void decide_if_left_alone(TimePoint now);
  void take_tick(TimePoint at);
  void decide(TimePoint at);
  void take_of_tick();
  void part_from(std::int64_t at_log_us, bool is_recorded);
  void compare_report(const OutgoingFrame& recorded);
  void add(WhatIfMove move);
  void add_outputs(const ContactorOutputs& now, ContactorOutputs& before, WhatIfMove move);
  void tell_unmatched(std::int64_t before_log_us);
  void follow_clock(bool goes_on);
  [[nodiscard]] std::int64_t log_us(TimePoint at) const { return reader_.clock().to_log_us(at) - clock_set_by_us_; }

  WhatIfOptions options_;
  RecordReader reader_;
  std::int64_t clock_ahead_us_ = 0;   // of the recording, as read last
  std::int64_t clock_set_by_us_ = 0;  // above 0: forward
  std::unique_ptr<Core> core_;
  std::unique_ptr<Core> recorded_core_;  // with the recorded configuration
  TimePoint wake_at_{};
  TimePoint recorded_due_at_{};  // a tick of the recording's loop is due from then on; zero: it has had none yet
  TimePoint latest_at_{};        // of the lines so far
  bool has_waited_ = false;      // the observation in progress, until the host gave the daemon CPU time
  ContactorOutputs outputs_;     // of the second core
  ContactorOutputs recorded_outputs_;
  bool has_parted_ = false;
  TimePoint urgent_at_{};                        // zero: no decision is; max: at the recording's next tick
  std::deque<Echo> echoes_;                      // sent, and not yet echoed
  std::array<bool, port_count> takes_frames_{};  // by the result of the recorded ones
  ModuleAnswers answers_;
  std::deque<WhatIfMove> unmatched_;
  std::map<std::uint32_t, CanFrame> reports_;  // of the second core, the latest of each identifier
  ReplayCounts counts_;
  std::optional<RecordProblem> problem_;
};

}  // namespace bmu
