// What happens to each frame, wherever it came from: judged, filtered, shown or counted.
#pragma once

#include <string>

#include "tools/bmudump/bus_table.hpp"
#include "tools/bmudump/frame_text.hpp"
#include "tools/bmudump/options.hpp"
#include "tools/bmudump/summary.hpp"

namespace bmu::dump {

class Dump {
 public:
  Dump(const Options& options, const DumpCatalogue& catalogue, const Filter& filter);

  /// False if the frame has no place: there are too many buses.
  bool show(const LogLine& line);
  /// Frames were missed: what counters and polls said before says nothing about what comes now.
  void forget_counters(std::string_view bus);
  void flush() { out_.flush(); }
  [[nodiscard]] bool is_done() const { return left_ == 0 || out_.is_closed(); }
  /// Prints what is due at the end. `code` is what the run came to so far; the worse of the two counts.
  [[nodiscard]] int finish(int code);

 private:
  void print(const SeenFrame& seen);

  const Options* options_;
  const Filter* filter_;
  BusTable buses_;
  Summary summary_;
  FrameText format_;
  TextWriter out_;
  std::uint64_t left_;
  bool needs_counts_;
};

/// Reads the logs of -r; the exit code of the reading itself.
[[nodiscard]] int dump_files(const Options& options, Dump& dump);
/// Listens on the buses until told to end.
[[nodiscard]] int dump_live(const Options& options, Dump& dump);

/// From now on SIGINT and SIGTERM end the run in order: everything shown so far reaches the output.
void catch_stop_signals();
[[nodiscard]] bool is_stop_requested();

}  // namespace bmu::dump
