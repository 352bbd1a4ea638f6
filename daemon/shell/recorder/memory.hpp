// Data logging of the daemon, besides its state: the history of minutes, the black box, the recording. Each has a
// thread of its own, and receives observations and decisions as a tap of the loop.
//
//   auto memory = Memory::open({...}, pack, core, journal);
//   LoopParts{..., .taps = memory->taps(), .each_second = {...}}    // each second: log of the changes
//   ... the loop runs ...
//   memory->end();
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "config/pack_config.hpp"
#include "daemon/history/history_tap.hpp"
#include "daemon/shell/recorder/recorder.hpp"
#include "daemon/shell/recorder/recorder_teller.hpp"
#include "daemon/shell/system/journal.hpp"

namespace bmu {

/// Empty path or folder: not used.
struct MemoryOptions {
  std::string history_path;
  std::string black_box_folder;
  std::string record_folder;
  std::uint64_t record_file_bytes = 0;
  std::uint64_t record_total_bytes = 0;
};

class Memory {
 public:
  /// Creates the required folders: the errors of open(), for a caller that still has an alternative.
  [[nodiscard]] static Result<void, OsError> make_folders(const MemoryOptions& options);
  /// Starts with the core as it is: before its first observation. Precondition: prepare_signals(), because the threads
  /// that start here inherit its mask. Core and journal must outlive it. The error: a required folder cannot be
  /// created.
  [[nodiscard]] static Result<std::unique_ptr<Memory>, OsError> open(const MemoryOptions& options,
                                                                     const PackConfig& pack, const Core& core,
                                                                     Journal& journal);
  Memory(const Memory&) = delete;
  Memory& operator=(const Memory&) = delete;
  ~Memory() = default;

  [[nodiscard]] std::vector<CoreTap*> taps();
  /// Logs the changes of the recorder's state. Never waits.
  void tell();
  /// After the loop: writes the remaining data, in 500 ms (recorder) and 200 ms (history) at most.
  void end();

  [[nodiscard]] const HistoryStore& history() const { return history_; }
  /// Null: nothing is recorded.
  [[nodiscard]] const Recorder* recorder() const { return recorder_.get(); }

 private:
  Memory(const MemoryOptions& options, const PackConfig& pack, const Core& core, Journal& journal);

  Journal& journal_;
  HistoryStore history_;
  HistoryTap history_tap_;
  std::unique_ptr<Recorder> recorder_;
  RecorderTeller teller_;
};

/// 16 digits, as logs and recordings show it.
[[nodiscard]] std::string hash_text(const PackConfig& pack);

}  // namespace bmu
