// What only one daemon at a time may write: its state, its history, the folders of its recordings. Two that share one
// would each write over what the other remembers, a lock among it, and delete each other's recordings. So the second
// one does not start.
//
//   add_file     before the file is read: what its predecessor still writes is part of it. A lock on "FILE.lock", since
//                FILE itself is replaced when it is written; it stays, empty, for the next one. Links lead to one lock.
//   add_folder   a lock on the folder itself, which has to be there
//
// The locks (flock) go with the process, however it ends. A reload keeps them.
#pragma once

#include <string>
#include <vector>

#include "daemon/shell/system/os_error.hpp"
#include "daemon/shell/system/owned_fd.hpp"
#include "protocol/result.hpp"

namespace bmu {

class SoleUse {
 public:
  /// Each: fails if somebody else has it; `option` is named then, so that one knows what to change. "" is no path, and
  /// needs no lock. Fails, too, if there is a lock that we may not open, as of a daemon that root has started by hand.
  /// One that is there holds on a read-only disk, too. Where none can be made at all (no folder, no room, read only)
  /// the file cannot be written either, which others report.
  [[nodiscard]] Result<void, OsError> add_file(const std::string& path, const std::string& option);
  /// One folder for two purposes is one lock.
  [[nodiscard]] Result<void, OsError> add_folder(const std::string& path, const std::string& option);

 private:
  [[nodiscard]] Result<void, OsError> lock(OwnedFd fd, const std::string& path, const std::string& option);
  [[nodiscard]] bool has(int fd) const;

  std::vector<OwnedFd> held_;
};

}  // namespace bmu
