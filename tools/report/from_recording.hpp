// A report of recordings or black boxes (daemon/recording/record_line.hpp): the recording is replayed, and the state of
// the core is read after each of its decisions. The reader of the files reports missing lines (recording_files.hpp).
//
//   RecordingReport reading({});
//   reading.begin_file("drive.log");
//   for each line: if (!reading.take(line)) reading.break_off(reading.trouble(number)), and continue with the next part
//   ReportData data = std::move(reading).finish();
//
// A recording starts a part every 30 s with the complete state of the core: the drive continues. There is a gap only
// after lines that are missing or modified, or a time without any recording. Data that several files have of the same
// time is shown once.
//
// Times are those of the clock as it was set last. A change of the clock while the daemon runs, back or forward, is
// known from the recording, which also has the daemon's own time: earlier times are moved, so that the change is no gap
// and no time goes back. A clock that has not been set since the computer started (it shows 1970) does not move the
// records of other sessions of the daemon; until it is set its times are shown after theirs. --from and --to are
// compared with the times as known when a line is read.
//
// Cost: that of the replay, and a few microseconds per decision. Memory: at most about 9000 samples of every cell; a
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
  std::optional<std::int64_t> from_us;  // since 1970: lines outside of both are replayed, but not shown
  std::optional<std::int64_t> to_us;
  std::size_t samples_max = 9'000;
};

class RecordingReport {
 public:
  explicit RecordingReport(const RecordingOptions& options) : options_(options) {}
  RecordingReport(const RecordingReport&) = delete;
  RecordingReport& operator=(const RecordingReport&) = delete;

  /// Starts the next file; in the order of their times.
  void begin_file(const std::string& name);
  /// Handles the next line, without its line feed. False: reading cannot continue, as trouble() explains, before the
  /// head of another part.
  [[nodiscard]] bool take(std::string_view line);
  /// The error with the number of the line in its file: "line 4711: column 9: wanted ...", or the range of lines before
  /// it that are modified.
  [[nodiscard]] std::string trouble(std::uint64_t line) const;
  /// Marks missing lines from here on, with the reason. The next line must be the head of a part.
  void break_off(const std::string& why);
  /// Lines resume from here on: "line 4711".
  void go_on(const std::string& from_where);
  /// The data read so far; is_empty() if it includes no decision.
  [[nodiscard]] ReportData finish() &&;

 private:
  struct File {
    std::string name;
    bool has_tick = false;
    std::int64_t overlap_begin_us = 0;  // overlap with the files before it; 0: none
    std::int64_t overlap_end_us = 0;
    bool has_own = false;  // ticks that no other file has
  };
  /// A gap that no tick has ended yet.
  struct OpenHole {
    HoleReport hole;
    std::size_t file = 0;  // number of files when it started
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
  SampleMeans means_;  // of the incomplete sample
  std::vector<File> files_;
  std::uint64_t ticks_ = 0;
  std::uint64_t part_ = 0;
  RecordPartId part_id_;             // of the part that was shown last
  bool is_part_new_ = false;         // no tick of it was shown yet
  std::size_t file_of_last_ = 0;     // file of the tick shown last
  bool is_tick_shown_ = false;       // the latest one
  bool is_other_pack_ = false;       // the part is of a pack with other modules
  std::uint64_t ticks_back_ = 0;     // not shown, because the clock was set back by a second or more
  std::uint64_t ticks_foreign_ = 0;  // not shown, because they are of another pack
  std::uint64_t ticks_different_ = 0;
  std::optional<std::int64_t> held_us_;   // time of a tick that was replayed and is not taken yet
  std::vector<std::string> held_events_;  // and its events
  std::optional<RecordProblem> altered_;  // the lines before the tick taken last are modified
  std::uint64_t tick_line_ = 0;           // of the latest tick, as the replay counts
  std::uint64_t altered_line_ = 0;        // of the latest one that was decided from modified lines
  std::size_t events_before_last_ = 0;    // count without those of the latest tick: their own lines may be modified
  std::vector<OpenHole> holes_;           // sorted by their files
  bool is_over_ = false;                  // the following ticks are after the shown span
  std::int64_t sample_us_ = 0;            // start of the incomplete sample
  std::int64_t last_us_ = 0;              // the latest time of all ticks
  std::int64_t life_ = 0;                 // session of the current ticks
  std::vector<std::int64_t> lives_;       // all sessions, in order of appearance
  std::int64_t life_from_us_ = 0;         // its first time that is shown
  std::int64_t life_last_core_us_ = 0;    // its latest tick on the core's clock, which is never set
  std::int64_t recorded_ahead_us_ = 0;    // recorded clock minus the core's
  std::int64_t shown_ahead_us_ = 0;       // shown clock minus the core's
  std::uint64_t clock_settings_ = 0;
  ChargeState flow_;  // as of the latest tick
  double out_mWh_ = 0;
  double in_mWh_ = 0;
  double out_uAs_ = 0;
  double in_uAs_ = 0;
  std::vector<std::int64_t> bled_begin_uAs_;
  std::vector<std::int64_t> bled_last_uAs_;
  std::vector<std::int64_t> bled_uAs_;  // of the completed parts
};

}  // namespace bmu::report
