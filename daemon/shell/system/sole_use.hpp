// Locks on the files and folders that only one daemon at a time may write: its state, its history, the folders of its
// recordings. Two daemons with the same one would overwrite each other's persistent state, latched faults included, and
// delete each other's recordings. So the second one does not start.
//
//   add_file     before the file is read: its predecessor may still write it. A lock on "FILE.lock", since FILE itself
//                is replaced when it is written; it stays, empty, for the next one. Links lead to one lock.
//   add_folder   a lock on the folder itself, which has to exist
//
// The locks (flock) end with the process, however it ends. A reload keeps them.
#pragma once

#include <string>
#include <vector>

#include "daemon/shell/system/os_error.hpp"
#include "daemon/shell/system/owned_fd.hpp"
#include "protocol/result.hpp"

namespace bmu {

class SoleUse {
 public:
  /// Both fail if another process has the lock; the error names `option`, which the operator has to change. "" is no
  /// path, and needs no lock. Fails, too, if there is a lock that this process may not open, e.g. of a daemon that root
  /// has started by hand. An existing lock file also works on a read-only disk. Where none can be made at all (no
  /// folder, no room, read only) the file cannot be written either, which other parts report.
  [[nodiscard]] Result<void, OsError> add_file(const std::string& path, const std::string& option);
  /// One folder for two purposes is one lock.
  [[nodiscard]] Result<void, OsError> add_folder(const std::string& path, const std::string& option);

 private:
  [[nodiscard]] Result<void, OsError> lock(OwnedFd fd, const std::string& path, const std::string& option);
  [[nodiscard]] bool has(int fd) const;

  std::vector<OwnedFd> held_;
};

}  // namespace bmu
