// What would have happened with another configuration: a second core hears what the recording's core heard, decides
// when it wants to, and what it does otherwise is told.
//
// It takes the recorded state at the start, and goes on as it is from part to part. The world does not follow: what the
// recording says of currents, voltages and contacts is what was; only the frames that the second core sends come back
// to it as its own, while the bus took frames then, and the modules answer its questions, with what they said to the
// recording's core (module_answers.hpp). So when the contactors of both part, that is told, and what would
// have come then nobody knows: the second core begins again with the state of the next part.
//
// A core with the recorded configuration takes the recorded observations and ticks. From the time at which it wants to
// decide until the recorded tick the machine gave the daemon no processor, and the second core does not decide either.
// So a run costs what two cores cost.
//
// What is told: each command of the contactors that only one of both gives, each event that only one of both has within
// half a second, and each report to the vehicle whose bytes are others. Polls and commands on the internal bus are not
// compared: they carry counters, and what they are for shows in the rest.
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

/// Something that only one of both courses has. Times are those of the recording's wall clock less what it was set by,
/// a second or more, since the first part that the run goes on from.
struct WhatIfMove {
  std::int64_t log_us = 0;
  bool is_recorded = false;
  bool parts = false;  // the contactors: nothing is known of what would have followed
  bool opens = false;  // at least one of them
  std::string text;    // "fault: ...", "contactors: main_negative main_positive"
};

/// A report of an identifier, where both differ.
struct WhatIfReport {
  std::int64_t log_us = 0;
  CanFrame recorded;
  CanFrame other;
};

struct WhatIfOptions {
  /// The configuration to decide with, or why it cannot take over the recorded state.
  std::function<Result<CoreConfig, std::string>(const PackConfig& recorded)> other{};
  std::function<void(const WhatIfMove& move)> moves{};
  std::function<void(const WhatIfReport& report)> reports{};
  /// Lines before a tick are not as they were written; it goes on all the same.
  std::function<void(const RecordProblem& alteration)> altered{};
};

class WhatIf {
 public:
  explicit WhatIf(WhatIfOptions options) : options_(std::move(options)) {}

  /// The next line, without its line feed. False: it cannot go on; problem() says why.
  [[nodiscard]] bool take(std::string_view line);
  void end();
  /// Something may be missing before the next part: its state is taken then. Behind a problem it goes on so, too.
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
  std::int64_t clock_ahead_us_ = 0;   // of the recording, as it was taken last
  std::int64_t clock_set_by_us_ = 0;  // above 0: forward
  std::unique_ptr<Core> core_;
  std::unique_ptr<Core> recorded_core_;  // with the recorded configuration
  TimePoint wake_at_{};
  TimePoint recorded_due_at_{};  // from then on the recording's loop owes a tick; zero: it has had none yet
  TimePoint latest_at_{};        // of the lines so far
  bool has_waited_ = false;      // the observation being taken: for the machine to give the daemon its processor
  ContactorOutputs outputs_;     // of the second core
  ContactorOutputs recorded_outputs_;
  bool has_parted_ = false;
  TimePoint urgent_at_{};                        // zero: nothing is; max: at the recording's next tick
  std::deque<Echo> echoes_;                      // sent, and not yet seen back
  std::array<bool, port_count> takes_frames_{};  // by what became of the recorded ones
  ModuleAnswers answers_;
  std::deque<WhatIfMove> unmatched_;
  std::map<std::uint32_t, CanFrame> reports_;  // of the second core, the latest of each identifier
  ReplayCounts counts_;
  std::optional<RecordProblem> problem_;
};

}  // namespace bmu
