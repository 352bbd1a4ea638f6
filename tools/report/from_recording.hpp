// A report of recordings or black boxes (daemon/recording/record_line.hpp): what was recorded is run again, and the
// core is looked at after each of its decisions. Who reads the files says where lines are missing
// (recording_files.hpp).
//
//   RecordingReport reading({});
//   reading.begin_file("drive.log");
//   for each line: if (!reading.take(line)) reading.break_off(reading.trouble(number)), and on with the next part
//   ReportData data = std::move(reading).finish();
//
// A recording begins anew every 30 s with all that the core knows: that is the same drive going on. Only behind lines
// that are missing or are not as they were written, or a time of which nothing was recorded, is there a hole. What
// several files have of the same time is shown once.
//
// Times are those of the clock as it was set last. A clock that is set while the daemon runs, back or forward, is known
// from the recording, which has the daemon's own time beside it: what came before is moved, so that a setting is no
// hole and no time goes back. A clock that has not been set since the computer started (it shows 1970) moves nothing
// that other lives of the daemon have recorded; until it is set its times are shown behind theirs. --from and --to
// compare with the times as they were known when a line was read.
//
// Cost: that of the replay, and a few microseconds a decision. Memory: some 9000 samples of every cell at most; a
// longer recording has longer samples, with their extremes.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/recording/replay.hpp"
#include "tools/report/data.hpp"
#include "tools/report/open_spans.hpp"
#include "tools/report/sample_means.hpp"

namespace bmu::report {

struct RecordingOptions {
  std::optional<std::int64_t> from_us;  // since 1970: what is before or after them is run, and not shown
  std::optional<std::int64_t> to_us;
  std::size_t samples_max = 9'000;
};

class RecordingReport {
 public:
  explicit RecordingReport(const RecordingOptions& options) : options_(options) {}
  RecordingReport(const RecordingReport&) = delete;
  RecordingReport& operator=(const RecordingReport&) = delete;

  /// Another file; in the order of their times.
  void begin_file(const std::string& name);
  /// The next line, without its line feed. False: it cannot go on, as trouble() says, before the head of another part.
  [[nodiscard]] bool take(std::string_view line);
  /// With the number that the line has in its file: "line 4711: column 9: wanted ...", or the lines before it that are
  /// not as they were written.
  [[nodiscard]] std::string trouble(std::uint64_t line) const;
  /// Lines are missing from here on, and why. What follows has to be the head of a part.
  void break_off(const std::string& why);
  /// Lines come again, from here on: "line 4711".
  void go_on(const std::string& from_where);
  /// What was read so far; is_empty() if no decision was among it.
  [[nodiscard]] ReportData finish() &&;

 private:
  struct File {
    std::string name;
    bool has_tick = false;
    std::int64_t overlap_begin_us = 0;  // of what the files before it have, too; 0: nothing
    std::int64_t overlap_end_us = 0;
    bool has_own = false;  // something that no other file has
  };
  /// That no tick has ended yet.
  struct OpenHole {
    HoleReport hole;
    std::size_t file = 0;  // how many files there were when it began
  };

  void settle();
  void take_tick(std::int64_t recorded_us);
  [[nodiscard]] std::int64_t shown_time(std::int64_t recorded_us);
  void begin_life(std::int64_t recorded_us);
  void follow_clock(std::int64_t set_by_us, std::int64_t recorded_us);
  void move_shown(std::int64_t from_us, std::int64_t by_us);
  void note_clock(const std::string& text);
  [[nodiscard]] bool is_of_before(std::int64_t at_us);
  [[nodiscard]] bool is_shown(std::int64_t at_us) const;
  void begin_part();
  void add_bled();
  void follow(std::int64_t at_us);
  [[nodiscard]] OpenHole* open_hole_of_file();
  void end_holes(std::optional<std::int64_t> at_us);
  void add_hole(HoleReport hole);
  void end_shown(bool goes_on);
  [[nodiscard]] bool has_same_modules() const;
  void close_sample();
  void note(std::uint64_t count, const std::string& what);
  void note_overlaps();
  void look_at_flow();
  void name_cells();
  void take_figures();

  RecordingOptions options_;
  Replay replay_{ReplayOptions{
      .differs = [this](const ReplayDifference& difference) { ticks_different_ += difference.line != altered_line_; },
      .altered = [this](const RecordProblem& alteration) { altered_ = alteration; },
  }};
  ReportData data_;
  OpenSpans spans_;
  SampleMeans means_;  // of the sample that is not over yet
  std::vector<File> files_;
  std::uint64_t ticks_ = 0;
  std::uint64_t part_ = 0;
  RecordPartId part_id_;             // of the part that was shown last
  bool is_part_new_ = false;         // nothing of it was shown yet
  std::size_t file_of_last_ = 0;     // tick that was shown
  bool is_tick_shown_ = false;       // the latest
  bool is_other_pack_ = false;       // the part is of a pack with other modules
  std::uint64_t ticks_back_ = 0;     // not shown, because the clock had gone back, by a second or more
  std::uint64_t ticks_foreign_ = 0;  // not shown, because they are of another pack
  std::uint64_t ticks_different_ = 0;
  std::optional<std::int64_t> held_us_;   // time of a tick that was run and is not taken yet
  std::vector<std::string> held_events_;  // and its events
  std::optional<RecordProblem> altered_;  // the lines before the tick taken last are not as they were written
  std::uint64_t tick_line_ = 0;           // of the latest tick, as the replay counts
  std::uint64_t altered_line_ = 0;        // of the latest one that decided by altered lines
  std::size_t events_before_last_ = 0;    // those of the latest tick are among the lines that may be altered
  std::vector<OpenHole> holes_;           // rising by their files
  bool is_over_ = false;                  // what comes is behind what is shown
  std::int64_t sample_us_ = 0;            // begin of the sample that is not over yet
  std::int64_t last_us_ = 0;              // of the latest tick that is not behind another
  std::int64_t life_ = 0;                 // of the daemon, whose ticks come now
  std::vector<std::int64_t> lives_;       // all, as they came
  std::int64_t life_from_us_ = 0;         // the first time of it that is shown
  std::int64_t life_last_core_us_ = 0;    // its latest tick on the core's clock, which is not set
  std::int64_t recorded_ahead_us_ = 0;    // the recorded clock less the core's
  std::int64_t shown_ahead_us_ = 0;       // what is shown less the core's
  std::uint64_t clock_settings_ = 0;
  ChargeState flow_;  // as of the latest tick
  double out_mWh_ = 0;
  double in_mWh_ = 0;
  double out_uAs_ = 0;
  double in_uAs_ = 0;
  std::vector<std::int64_t> bled_begin_uAs_;
  std::vector<std::int64_t> bled_last_uAs_;
  std::vector<std::int64_t> bled_uAs_;  // of the parts that are over
};

}  // namespace bmu::report
