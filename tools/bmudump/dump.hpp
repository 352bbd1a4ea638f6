// Processing of each frame, from any source: checked, filtered, shown or counted.
#pragma once

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "tools/bmudump/bus_table.hpp"
#include "tools/bmudump/clock_jumps.hpp"
#include "tools/bmudump/follow.hpp"
#include "tools/bmudump/frame_text.hpp"
#include "tools/bmudump/options.hpp"

namespace bmu::dump {

/// One catalogue for each dialect that can be decoded, and the initial one of a bus; after them one for each bus with
/// its own devices.
class Catalogues {
 public:
  /// `wanted`: the name of a dialect, or "auto", which selects the first one for a bus with its own devices.
  Catalogues(const DumpCatalogue::Choice& choice, std::span<const Dialect> rows, const std::string& wanted,
             const std::vector<DeviceWord>& devices = {});

  [[nodiscard]] const DumpCatalogue& at(std::size_t reader) const { return *readers_[reader]; }
  [[nodiscard]] std::size_t size() const { return readers_.size(); }
  [[nodiscard]] std::size_t first() const { return first_; }
  [[nodiscard]] std::span<const Dialect> dialects() const { return dialects_; }
  [[nodiscard]] std::span<const DeviceBus> device_buses() const { return device_buses_; }
  /// True if it decodes a bus that was declared by name. `any` declares no bus.
  [[nodiscard]] bool is_declared(std::size_t reader) const;
  /// The catalogue of this dialect, if buses may change to it; else size().
  [[nodiscard]] std::size_t reader_of(const Dialect& dialect) const;

 private:
  std::span<const Dialect> dialects_;
  std::vector<std::unique_ptr<DumpCatalogue>> readers_;
  std::size_t dialect_count_ = 0;
  std::vector<DeviceBus> device_buses_;
  std::size_t first_ = 0;
  bool is_auto_ = true;
};

class Dump {
 public:
  /// `choices`: the buses to show, empty for all. Output goes to `fd`.
  Dump(const Options& options, const Catalogues& catalogues, const Filter& filter, std::span<const BusChoice> choices,
       int fd);

  /// False if the frame cannot be stored: there are too many buses.
  bool show(const LogLine& line);
  /// Change of the log's clock before the frame that was shown last.
  [[nodiscard]] const ClockJump& clock_jump() const { return clock_jump_; }
  /// True if a frame on a line that may be truncated has all its bytes: as many as its row has, or the maximum of any
  /// frame.
  [[nodiscard]] bool is_whole(const LogLine& line);
  /// Counts frames of this bus that were not received. False if there are too many buses.
  bool count_lost(std::string_view bus, std::uint64_t frames);
  /// Called after missed frames: earlier counters and polls do not apply to the next frames.
  void forget_counters(std::string_view bus);
  /// All frames on the buses until then, on a monotonic clock, have been shown.
  void heard_until(std::int64_t time_us) { heard_until_us_ = std::max(heard_until_us_, time_us); }
  void flush() { out_.flush(); }
  [[nodiscard]] bool is_done() const { return left_ == 0 || out_.is_closed(); }
  /// Prints the final output. `code`: exit code of the run so far; returns the worse of the two.
  [[nodiscard]] int finish(int code);

  /// The table of --follow; null without.
  [[nodiscard]] Follow* follow() { return follow_.get(); }

 private:
  [[nodiscard]] bool has_doubtful_seal(const Bus& bus, std::size_t row) const;
  [[nodiscard]] bool is_doubtful(const Bus& bus, std::size_t row) const;
  [[nodiscard]] Fit fit_in(const Bus& bus, std::size_t row, const CanFrame& frame) const;
  [[nodiscard]] CheckedFrame judge(Bus& bus, const LogLine& line) const;
  void note_vehicle(Bus& bus, const CheckedFrame& verdict, const CanFrame& frame) const;
  void note_clock(const Bus& bus, const LogLine& line);
  void print(const Bus& bus, const SeenFrame& seen);
  void print_lost(const Bus& bus, std::uint64_t frames);
  void note_dialect(Bus& bus);
  void tell_hints() const;
  void tell_doubts() const;

  const Options* options_;
  const Catalogues* catalogues_;
  const Filter* filter_;
  BusTable buses_;
  ClockJumps clock_;
  ClockJump clock_jump_;
  LineStart start_;
  std::vector<FrameText> formats_;  // by reader
  TextWriter out_;
  std::unique_ptr<Follow> follow_;
  std::int64_t heard_until_us_ = 0;
  std::uint64_t left_;
  bool is_of_log_;  // false: of a live bus, with times of a clock that is never set
  bool shows_lines_;
  bool needs_counts_;
};

/// Reads the logs of -r; returns the exit code of the reading itself.
[[nodiscard]] int dump_files(const Options& options, Dump& dump);
/// Receives from the buses until a stop condition is met.
[[nodiscard]] int dump_live(const Options& options, Dump& dump);

/// The exit code of the worse one of two results.
[[nodiscard]] int worse(int one, int other);

/// From this call on SIGINT and SIGTERM end the run in order: everything shown so far reaches the output.
void catch_stop_signals();
void request_stop();
[[nodiscard]] bool is_stop_requested();

}  // namespace bmu::dump
