// Records what the daemon is told and decides, on a thread of its own: at full length into files if that is wanted, and
// always the last minutes into the memory of the black box.
//
//   auto recorder = Recorder::open(options, core);
//   LoopParts{..., .taps = {&recorder->feed()}}
//   recorder->start();                       // after prepare_signals(), whose mask the thread inherits
//   ... the loop runs ...
//   recorder->end(500ms);
//
// A disk that hangs or is full never reaches the loop: what waits is bounded, what is lost is counted and told.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <thread>

#include "daemon/recording/record_writer.hpp"
#include "daemon/shell/recorder/black_box.hpp"
#include "daemon/shell/recorder/record_feed.hpp"
#include "daemon/shell/recorder/record_files.hpp"

namespace bmu {

struct RecorderOptions {
  RecordHead head;
  RecordFilesOptions files;   // without a folder: no recording at full length
  BlackBoxOptions black_box;  // without a folder: none
  Duration part_length = 30s;
  Duration retry = 5s;  // of a black box that the disk did not take; at the end much sooner
};

struct RecorderStatus {
  std::string record_path;  // of the file that grows; "" for none
  std::uint64_t recorded_bytes = 0;
  std::uint64_t frames_lost = 0;  // seconds that the disk did not take
  std::string record_error;
  std::uint64_t black_boxes = 0;
  std::uint64_t black_boxes_lost = 0;  // openings and latched faults that no file tells of, or not to its end
  std::uint64_t black_box_tries_failed = 0;
  std::string black_box_path;  // the last one
  std::string black_box_error;
  std::size_t memory_bytes = 0;
  Duration memory_length{};
};

/// How it ended.
enum class RecorderEnd : std::uint8_t {
  all_written,
  some_lost,      // the disk, or the time that was left, did not take all; status() and pieces_lost() say what
  still_writing,  // the thread hangs in the disk, and was left behind: nobody knows what it will write
};

/// A folder for recordings, with those above it; none where the name is empty. What open() does first, for who wants to
/// know before whether it would.
[[nodiscard]] Result<void, OsError> make_record_folder(const std::string& folder);

class Recorder {
 public:
  /// The error: a folder that is wanted is not there and cannot be made.
  [[nodiscard]] static Result<std::unique_ptr<Recorder>, OsError> open(const RecorderOptions& options,
                                                                       const Core& core);
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;
  /// Gives the thread up if it hangs in a disk.
  ~Recorder();

  /// For the loop; the same for as long as this lives.
  [[nodiscard]] RecordFeed& feed() { return feed_; }
  void start();
  /// After the loop: what is left is written, and tried again where a disk takes it not at once; given up, and counted,
  /// after so long.
  RecorderEnd end(Duration at_most);

  /// Never waits: the one before while the thread holds its lock.
  [[nodiscard]] RecorderStatus status() const;
  /// Observations and decisions that no recording has, as the thread was held up.
  [[nodiscard]] std::uint64_t pieces_lost() const { return feed_.pieces_lost(); }

 private:
  struct Shared;

  Recorder(const RecorderOptions& options, const Core& core, std::shared_ptr<Shared> shared);

  std::shared_ptr<Shared> shared_;  // the thread's, too: it may outlive us
  RecordFeed feed_;
  std::thread thread_;
  mutable RecorderStatus status_;
};

}  // namespace bmu
