// Records the observations and decisions of the core, on a thread of its own: at full length into files, and the last
// minutes into the memory of the black box, each if it has a folder.
//
//   auto recorder = Recorder::open(options, core);
//   LoopParts{..., .taps = {&recorder->feed()}}
//   recorder->start();                       // after prepare_signals(): the thread inherits its mask
//   ... the loop runs ...
//   recorder->end(500ms);
//
// A disk that hangs or is full never affects the loop: waiting data is bounded, lost data is counted and logged.
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
  Duration retry = 5s;  // of a black box that the disk did not accept; at the end much sooner
};

struct RecorderStatus {
  std::string record_path;  // of the open file; "" for none
  std::uint64_t recorded_bytes = 0;
  std::uint64_t frames_lost = 0;  // seconds that the disk, or the memory, did not accept
  std::string record_error;
  std::uint64_t black_boxes = 0;
  std::uint64_t black_boxes_lost = 0;  // openings and latched faults without a complete file
  std::uint64_t black_box_tries_failed = 0;
  std::string black_box_path;  // the last one
  std::string black_box_error;
  std::size_t memory_bytes = 0;
  Duration memory_length{};
};

/// Result of end().
enum class RecorderEnd : std::uint8_t {
  all_written,
  some_lost,      // the disk or the time left did not suffice; status() and pieces_lost() have the numbers
  still_writing,  // the thread hangs in the disk and is detached: its further writes are unknown
};

/// Creates a folder for recordings, with its parents; nothing if the name is empty. open() starts with this; for
/// callers that need to know before whether it would succeed.
[[nodiscard]] Result<void, OsError> make_record_folder(const std::string& folder);

class Recorder {
 public:
  /// The error: a required folder does not exist and cannot be created.
  [[nodiscard]] static Result<std::unique_ptr<Recorder>, OsError> open(const RecorderOptions& options,
                                                                       const Core& core);
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;
  /// Detaches the thread if it hangs in a disk access.
  ~Recorder();

  /// For the loop; the same object for the lifetime of the recorder.
  [[nodiscard]] RecordFeed& feed() { return feed_; }
  /// Starts the thread. The error: the system refuses it; nothing is written then.
  [[nodiscard]] Result<void, OsError> start();
  /// After the loop: writes the remaining data, with retries where a disk does not accept it at once; abandons the data
  /// left after `at_most`, and counts it.
  RecorderEnd end(Duration at_most);

  /// Never waits: returns the previous status while the thread holds its mutex.
  [[nodiscard]] RecorderStatus status() const;
  /// Observations and decisions that are in no recording because the thread was held up.
  [[nodiscard]] std::uint64_t pieces_lost() const { return feed_.pieces_lost(); }

 private:
  struct Shared;

  Recorder(const RecorderOptions& options, const Core& core, std::shared_ptr<Shared> shared);

  std::shared_ptr<Shared> shared_;  // shared with the thread, which may outlive this object
  RecordFeed feed_;
  std::thread thread_;
  mutable RecorderStatus status_;
};

}  // namespace bmu
