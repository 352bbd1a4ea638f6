// Database file of a history: created if missing, migrated if older, and quarantined under another name if damaged;
// never removed, and never repaired in place.
//
//   PATH                    the database; PATH-wal and PATH-shm beside it belong to it
//   PATH.damaged-<time>     a quarantined one; at most `aside_max` of them, then nothing is written until the operator
//                           has checked the disk
//
// A database of a newer schema, or of another program, is left unchanged: nothing is written, and an error is reported.
// It is newer by its version number and by an unknown object in it; a wrong number alone is damage. A file that was
// removed or replaced while it was open is detected with the next row.
//
// All functions here wait for the disk. Not for the control loop's thread.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include <sys/types.h>

#include "daemon/history/database.hpp"
#include "daemon/history/history_row.hpp"
#include "protocol/result.hpp"

namespace bmu {

struct HistoryFileOptions {
  std::string path;
  std::int64_t keep_days = 30;
  std::int64_t size_max_bytes = 200'000'000;  // with -wal and -shm
  std::string vfs;                            // of SQLite, for tests
};

enum class HistoryTrouble : std::uint8_t {
  busy,     // locked by another process
  full,     // no disk space
  refused,  // by the system: no folder, no permission, a disk error
  damaged,  // no longer a database, or without the tables of a history
  newer,    // of a later version of bmud
  foreign,  // of another program, or not a regular file
};

struct HistoryError {
  HistoryTrouble trouble = HistoryTrouble::refused;
  std::string what;  // message for the operator; begins with the path
};

template <class T>
using HistoryResult = Result<T, HistoryError>;

class HistoryFile {
 public:
  static constexpr int aside_max = 5;
  static constexpr std::int64_t events_max = 50'000;

  HistoryFile(HistoryFileOptions options, HistoryLife life);
  HistoryFile(const HistoryFile&) = delete;
  HistoryFile& operator=(const HistoryFile&) = delete;
  ~HistoryFile();

  /// Prepares for writing. Does nothing if it is open already, and the file is still the one that was opened.
  [[nodiscard]] HistoryResult<void> open();
  /// Writes all of it, or nothing. Items that this session has written already (by a commit with an unknown result) are
  /// skipped. `sequence` and the session are filled in here. After an error the file is closed.
  [[nodiscard]] HistoryResult<void> write(std::span<const HistoryRow> rows, std::span<const HistoryEvent> events);
  /// Removes a bounded number of excess rows, the oldest first, and releases their space. True: there is more.
  [[nodiscard]] HistoryResult<bool> trim();
  /// Quarantines a damaged database. Returns its new name.
  [[nodiscard]] HistoryResult<std::string> put_aside();
  void close();

  /// With -wal and -shm; 0 if there is nothing.
  [[nodiscard]] std::int64_t size_bytes() const;

 private:
  /// Identity of the file, whatever its name.
  struct Identity {
    dev_t device = 0;
    ino_t number = 0;
    friend bool operator==(const Identity&, const Identity&) = default;
  };
  struct Open;

  [[nodiscard]] std::optional<Identity> identity() const;
  [[nodiscard]] HistoryError error_of(const DatabaseError& error) const;
  [[nodiscard]] HistoryResult<void> open_new();
  [[nodiscard]] HistoryResult<void> make_ours(const Database& database) const;
  [[nodiscard]] HistoryResult<void> check_version(const Database& database, std::int64_t version) const;
  [[nodiscard]] DatabaseResult<void> prepare(Open& open) const;
  [[nodiscard]] DatabaseResult<void> find_life(Open& open) const;
  [[nodiscard]] DatabaseResult<void> begin_life(Open& open) const;
  [[nodiscard]] DatabaseResult<std::int64_t> layout_id(const Database& database) const;
  [[nodiscard]] DatabaseResult<void> insert_places(const Database& database, std::int64_t layout) const;
  [[nodiscard]] DatabaseResult<void> insert(Open& open, std::span<const HistoryRow> rows,
                                            std::span<const HistoryEvent> events) const;

  HistoryFileOptions options_;
  HistoryLife life_;
  std::unique_ptr<Open> open_;
};

}  // namespace bmu
