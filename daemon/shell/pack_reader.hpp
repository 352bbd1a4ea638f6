// Loads a pack file for a running daemon, on a thread of its own, because a disk may take seconds and the control loop
// must not wait. The other files that a session needs at its start are read with it.
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

/// Data from files with which a session starts.
struct PackRead {
  PackConfig file_pack;
  std::shared_ptr<CellCountSetting> cell_count;  // of that file; its pack() is the one in effect
  ConfigProblems warnings;
  AccessGroups groups;
  UserNames users;
};

/// Reads the data from files beside the pack file. Waits for the disk, as load_pack_config() does.
[[nodiscard]] PackRead read_beside(PackConfig file_pack, const std::string& config, const std::string& state_path);

class PackReader {
 public:
  [[nodiscard]] static Result<std::unique_ptr<PackReader>, OsError> make();
  PackReader(const PackReader&) = delete;
  PackReader& operator=(const PackReader&) = delete;
  /// Detaches the thread if it hangs in a disk access.
  ~PackReader();

  /// Precondition: prepare_signals(), because the thread inherits its mask.
  [[nodiscard]] Result<void, OsError> begin(const std::string& config, const std::string& state_path);
  [[nodiscard]] bool is_reading() const { return thread_.joinable(); }
  /// Readable (level) once there is something to take. Stable.
  [[nodiscard]] int fd() const;
  /// No value: still reading.
  [[nodiscard]] std::optional<Result<PackRead, ConfigProblems>> take();

 private:
  struct Shared;

  explicit PackReader(std::shared_ptr<Shared> shared) : shared_(std::move(shared)) {}

  std::shared_ptr<Shared> shared_;  // shared with the thread, which may outlive this object
  std::thread thread_;
};

}  // namespace bmu
