// SQLite with its handles owned and its answers as results: nothing here knows what is in a database.
//
// A database is opened so that what it brings with it is not trusted: no triggers and no views are run, its functions
// are not called, and no value may be larger than anything of ours.
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
  int code = 0;  // SQLITE_BUSY and the like, extended
  std::string what;

  /// The primary code: what kind of thing it is.
  [[nodiscard]] int kind() const { return code & 0xFF; }
};

template <class T>
using DatabaseResult = Result<T, DatabaseError>;

class Statement {
 public:
  void bind(int index, const std::optional<std::int64_t>& number);
  void bind_text(int index, std::string_view text);
  void bind_blob(int index, std::string_view bytes);

  /// True: a row is there to be read. False: the end. Binding and stepping may begin anew after either.
  [[nodiscard]] DatabaseResult<bool> step();
  /// Back to the beginning, without bindings.
  void reset();

  /// None if it is not an integer.
  [[nodiscard]] std::optional<std::int64_t> number(int column) const;
  /// None if it is neither text nor bytes. Holds until the next step.
  [[nodiscard]] std::optional<std::string_view> text(int column) const;

 private:
  friend class Database;
  struct Close {
    void operator()(sqlite3_stmt* statement) const;
  };

  std::unique_ptr<sqlite3_stmt, Close> statement_;
};

enum class OpenAs : std::uint8_t {
  writer,      // made if it is not there
  reader,      // never written
  still_file,  // read as if nobody could write it: no lock, and no log beside it is looked at
  alone,       // the same with the log beside it, as if nobody else had it open: no file need be made for that
  ruin         // the same of one that is damaged: what of it makes sense is read
};

class Database {
 public:
  /// `vfs`: of SQLite, by name; "" is the system's.
  [[nodiscard]] static DatabaseResult<Database> open(const std::string& path, OpenAs as, const std::string& vfs = "");

  [[nodiscard]] DatabaseResult<Statement> prepare(std::string_view sql) const;
  /// One or more statements, whose rows nobody wants.
  [[nodiscard]] DatabaseResult<void> run(const std::string& sql) const;
  /// The first number of the first row; none if there is none.
  [[nodiscard]] DatabaseResult<std::optional<std::int64_t>> number(std::string_view sql) const;
  [[nodiscard]] bool is_in_transaction() const;
  /// By what the system lets us, or by what its beginning says; known once something was read.
  [[nodiscard]] bool is_read_only() const;
  /// From now on closing leaves the files as they are.
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
