// The database that a history is written to: made where there is none, migrated where it is older, and put aside under
// another name where it is damaged; never removed, and never mended in place.
//
//   PATH                    the database; PATH-wal and PATH-shm beside it belong to it
//   PATH.damaged-<time>     one that was put aside; at most `aside_max` of them, then nothing is written until somebody
//                           has looked
//
// A database of a newer schema, or of another program, is left alone: nothing is written, and it is said so. Newer is
// one by its number and by something in it that is not known; a wrong number alone is damage. One that was removed or
// exchanged while it was open is noticed with the next row.
//
// Everything here waits for the disk. Not for the control loop's thread.
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
  std::int64_t size_max_bytes = 200'000'000;  // with what belongs to it
  std::string vfs;                            // of SQLite, for tests
};

enum class HistoryTrouble : std::uint8_t {
  busy,     // somebody else has it locked
  full,     // no room
  refused,  // by the system: no folder, no permission, an error of the disk
  damaged,  // no database any more, or not the one we made
  newer,    // of a later version of ours
  foreign,  // of another program, or no file at all
};

struct HistoryError {
  HistoryTrouble trouble = HistoryTrouble::refused;
  std::string what;  // for a line a person can act on; begins with the path
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

  /// Ready to be written. Does nothing if it is already, and the file is still the one that was opened.
  [[nodiscard]] HistoryResult<void> open();
  /// All of it, or nothing. What this life has written already (a commit of which nobody knew how it ended) is left
  /// out. `sequence` and `life` are filled in here. After an error it is closed.
  [[nodiscard]] HistoryResult<void> write(std::span<const HistoryRow> rows, std::span<const HistoryEvent> events);
  /// Removes a bounded number of the oldest rows that are too many, and gives their room back. True: there is more.
  [[nodiscard]] HistoryResult<bool> trim();
  /// A damaged database gets out of the way. Its new name.
  [[nodiscard]] HistoryResult<std::string> put_aside();
  void close();

  /// With what belongs to it; 0 if there is nothing.
  [[nodiscard]] std::int64_t size_bytes() const;

 private:
  /// Which file it is, whatever its name.
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
