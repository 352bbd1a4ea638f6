// Reads a pack file for a running daemon: on a thread of its own, since a disk may take seconds and the control loop
// has none. With it comes what else is read of files when a life begins.
//
//   begin(...)        once; then is_reading() until take()
//   fd() readable     take()
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "config/pack_config.hpp"
#include "daemon/shell/serial/cell_count_setting.hpp"
#include "daemon/shell/status/access.hpp"
#include "daemon/shell/status/user_names.hpp"
#include "daemon/shell/system/os_error.hpp"
#include "protocol/result.hpp"

namespace bmu {

/// What a life begins with, as files have it.
struct PackRead {
  PackConfig file_pack;
  std::shared_ptr<CellCountSetting> cell_count;  // of that file; its pack() is what counts
  ConfigProblems warnings;
  AccessGroups groups;
  UserNames users;
};

/// What is read beside a pack file. Waits for the disk, as load_pack_config() does.
[[nodiscard]] PackRead read_beside(PackConfig file_pack, const std::string& config, const std::string& state_path);

class PackReader {
 public:
  [[nodiscard]] static Result<std::unique_ptr<PackReader>, OsError> make();
  PackReader(const PackReader&) = delete;
  PackReader& operator=(const PackReader&) = delete;
  /// Gives the thread up if it hangs in a disk.
  ~PackReader();

  /// After prepare_signals(), whose mask the thread inherits.
  [[nodiscard]] Result<void, OsError> begin(const std::string& config, const std::string& state_path);
  [[nodiscard]] bool is_reading() const { return thread_.joinable(); }
  /// Readable (level) once there is something to take. Stable.
  [[nodiscard]] int fd() const;
  /// Nothing: not yet.
  [[nodiscard]] std::optional<Result<PackRead, ConfigProblems>> take();

 private:
  struct Shared;

  explicit PackReader(std::shared_ptr<Shared> shared) : shared_(std::move(shared)) {}

  std::shared_ptr<Shared> shared_;  // the thread's, too: it may outlive us
  std::thread thread_;
};

}  // namespace bmu
