// What the daemon remembers of what it did, besides its state: the history of minutes, the black box, the recording.
// Each has a thread of its own, and hears of the loop as its taps.
//
//   auto memory = Memory::open({...}, pack, core, journal);
//   LoopParts{..., .taps = memory->taps(), .each_second = {[&] { memory->tell(); }}}
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

/// Empty: none of it.
struct MemoryOptions {
  std::string history_path;
  std::string black_box_folder;
  std::string record_folder;
  std::uint64_t record_file_bytes = 0;
  std::uint64_t record_total_bytes = 0;
};

class Memory {
 public:
  /// What open() would refuse, for who can still do something else: the folders that are wanted are there then.
  [[nodiscard]] static Result<void, OsError> make_folders(const MemoryOptions& options);
  /// Begins with the core as it is: before it is told anything. Threads start here, so after prepare_signals(), whose
  /// mask they inherit. Core and journal outlive it. The error: a folder that is wanted cannot be made.
  [[nodiscard]] static Result<std::unique_ptr<Memory>, OsError> open(const MemoryOptions& options,
                                                                     const PackConfig& pack, const Core& core,
                                                                     Journal& journal);
  Memory(const Memory&) = delete;
  Memory& operator=(const Memory&) = delete;
  ~Memory() = default;

  [[nodiscard]] std::vector<CoreTap*> taps();
  /// What has changed, into the log. Never waits.
  void tell();
  /// After the loop: what is left is written, as far as a disk takes it soon.
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
