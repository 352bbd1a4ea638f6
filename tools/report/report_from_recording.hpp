// A report of a recording or a black box (daemon/recording/record_line.hpp): what was recorded is run again, and the
// core is looked at after each of its decisions.
//
//   RecordingReport reading({.name = "drive.log"});
//   for each line: if (!reading.take(line)) break;      // reading.problem() says why
//   ReportData data = std::move(reading).finish();
//
// Cost: that of the replay, and a few microseconds a decision. Memory: some 9000 samples of every cell at most; a
// longer recording has longer samples, with their extremes.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/recording/replay.hpp"
#include "tools/report/report_data.hpp"

namespace bmu::report {

struct RecordingOptions {
  std::string name;                     // of the file, for people
  std::optional<std::int64_t> from_us;  // since 1970: what is before or after them is run, and not shown
  std::optional<std::int64_t> to_us;
  std::size_t samples_max = 9'000;
};

class RecordingReport {
 public:
  explicit RecordingReport(RecordingOptions options);
  ~RecordingReport();
  RecordingReport(const RecordingReport&) = delete;
  RecordingReport& operator=(const RecordingReport&) = delete;

  /// The next line, without its line feed. False: it cannot go on.
  [[nodiscard]] bool take(std::string_view line);
  [[nodiscard]] const std::optional<RecordProblem>& problem() const { return replay_.problem(); }
  /// What was read so far; is_empty() if no decision was among it.
  [[nodiscard]] ReportData finish() &&;

 private:
  struct Open;   // what is so at the moment, and since when
  struct Means;  // of the sample that is not over yet

  void take_tick(std::int64_t at_us);
  void begin_part();
  void end_part();
  void close_sample();
  void look_at_flow();
  void look_at_state(std::int64_t at_us);
  void name_cells();
  void fill_figures();

  RecordingOptions options_;
  Replay replay_{ReplayOptions{}};
  ReportData data_;
  std::unique_ptr<Open> open_;
  std::unique_ptr<Means> means_;
  std::uint64_t ticks_ = 0;
  std::uint64_t part_ = 0;
  std::uint64_t ticks_back_ = 0;  // not shown, because the clock had gone back
  std::int64_t sample_us_ = 0;    // begin of the sample that is not over yet
  std::int64_t last_us_ = 0;      // of the latest tick
  ChargeState flow_;              // as of the latest tick
  double out_mWh_ = 0;
  double in_mWh_ = 0;
  double out_uAs_ = 0;
  double in_uAs_ = 0;
  std::vector<std::int64_t> bled_begin_uAs_;
  std::vector<std::int64_t> bled_last_uAs_;
  std::vector<std::int64_t> bled_uAs_;  // of the parts that are over
};

}  // namespace bmu::report
