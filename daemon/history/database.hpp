// SQLite with owned handles and with results for its errors; independent of the content of a database.
//
// A database is opened without trusting its content: no triggers and no views are run, its functions are not called,
// and the size of a value is limited, well above the largest that bmud writes.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "protocol/result.hpp"

struct sqlite3;
struct sqlite3_stmt;

namespace bmu {

struct DatabaseError {
  int code = 0;  // extended result code, e.g. one of SQLITE_BUSY
  std::string what;

  /// The primary result code.
  [[nodiscard]] int kind() const { return code & 0xFF; }
};

template <class T>
using DatabaseResult = Result<T, DatabaseError>;

class Statement {
 public:
  void bind(int index, const std::optional<std::int64_t>& number);
  void bind_text(int index, std::string_view text);
  void bind_blob(int index, std::string_view bytes);

  /// True: a row can be read. False: the end. At the end and after an error it is reset, for new binding and stepping.
  [[nodiscard]] DatabaseResult<bool> step();
  /// Resets the statement and clears its bindings.
  void reset();

  /// None if it is not an integer.
  [[nodiscard]] std::optional<std::int64_t> number(int column) const;
  /// None if it is neither text nor bytes. Valid until the next step.
  [[nodiscard]] std::optional<std::string_view> text(int column) const;

 private:
  friend class Database;
  struct Close {
    void operator()(sqlite3_stmt* statement) const;
  };

  std::unique_ptr<sqlite3_stmt, Close> statement_;
};

enum class OpenAs : std::uint8_t {
  writer,      // created if missing
  reader,      // read only
  still_file,  // read as immutable: without locks, and without the log beside it
  alone,       // read with the log beside it, without locks, as the only user: no shared file has to be created
  ruin         // as still_file, of a damaged database: its readable content
};

class Database {
 public:
  /// `vfs`: name of the SQLite VFS; "" is the system's.
  [[nodiscard]] static DatabaseResult<Database> open(const std::string& path, OpenAs as, const std::string& vfs = "");

  [[nodiscard]] DatabaseResult<Statement> prepare(std::string_view sql) const;
  /// Executes one or more statements; their rows are discarded.
  [[nodiscard]] DatabaseResult<void> run(const std::string& sql) const;
  /// The first number of the first row; none if there is none.
  [[nodiscard]] DatabaseResult<std::optional<std::int64_t>> number(std::string_view sql) const;
  [[nodiscard]] bool is_in_transaction() const;
  /// By the permissions of the file, or by its header; known once something was read.
  [[nodiscard]] bool is_read_only() const;
  /// From now on closing leaves the files unchanged.
  void leave_as_it_is() const;

 private:
  struct Close {
    void operator()(sqlite3* database) const;
  };
  explicit Database(sqlite3* database) : database_(database) {}
  [[nodiscard]] DatabaseError error(std::string_view doing) const;

  std::unique_ptr<sqlite3, Close> database_;
};

}  // namespace bmu
