#include "daemon/history/database.hpp"

#include <sqlite3.h>

namespace bmu {

namespace {

constexpr int busy_timeout_ms = 1'000;
// The largest value that bmud writes is the cells of a row, some 12 kB.
constexpr int value_bytes_max = 1 << 20;
constexpr const char* vfs_without_locks = "unix-none";

std::string uri_of(const std::string& path, OpenAs as) {
  // An absolute path follows an empty host; otherwise the text after two slashes would be taken for the host.
  std::string uri = path.starts_with('/') ? "file://" : "file:";
  for (const char character : path) {
    if (character == '?' || character == '#' || character == '%') {
      constexpr std::string_view digits = "0123456789ABCDEF";
      const auto byte = static_cast<unsigned char>(character);
      uri += {'%', digits[byte >> 4U], digits[byte & 15U]};
    } else {
      uri += character;
    }
  }
  return as == OpenAs::still_file || as == OpenAs::ruin ? uri + "?immutable=1" : uri;
}

void trust_nothing(sqlite3* database) {
  sqlite3_extended_result_codes(database, 1);
  sqlite3_busy_timeout(database, busy_timeout_ms);
  sqlite3_limit(database, SQLITE_LIMIT_LENGTH, value_bytes_max);
  sqlite3_limit(database, SQLITE_LIMIT_ATTACHED, 0);
  for (const auto& [option, is_on] :
       {std::pair{SQLITE_DBCONFIG_DEFENSIVE, 1}, std::pair{SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0},
        std::pair{SQLITE_DBCONFIG_ENABLE_TRIGGER, 0}, std::pair{SQLITE_DBCONFIG_ENABLE_VIEW, 0}}) {
    sqlite3_db_config(database, option, is_on, nullptr);
  }
}

}  // namespace

void Statement::Close::operator()(sqlite3_stmt* statement) const {
  sqlite3_finalize(statement);
}

void Statement::bind(int index, const std::optional<std::int64_t>& number) {
  if (number) {
    sqlite3_bind_int64(statement_.get(), index, *number);
  } else {
    sqlite3_bind_null(statement_.get(), index);
  }
}

void Statement::bind_text(int index, std::string_view text) {
  sqlite3_bind_text64(statement_.get(), index, text.data(), text.size(), SQLITE_TRANSIENT, SQLITE_UTF8);
}

void Statement::bind_blob(int index, std::string_view bytes) {
  sqlite3_bind_blob64(statement_.get(), index, bytes.data(), bytes.size(), SQLITE_TRANSIENT);
}

DatabaseResult<bool> Statement::step() {
  const int code = sqlite3_step(statement_.get());
  if (code == SQLITE_ROW) return true;
  if (code == SQLITE_DONE) {
    sqlite3_reset(statement_.get());
    return false;
  }
  const DatabaseError error{.code = code, .what = sqlite3_errmsg(sqlite3_db_handle(statement_.get()))};
  sqlite3_reset(statement_.get());
  return failure(error);
}

void Statement::reset() {
  sqlite3_reset(statement_.get());
  sqlite3_clear_bindings(statement_.get());
}

std::optional<std::int64_t> Statement::number(int column) const {
  if (sqlite3_column_type(statement_.get(), column) != SQLITE_INTEGER) return std::nullopt;
  return sqlite3_column_int64(statement_.get(), column);
}

std::optional<std::string_view> Statement::text(int column) const {
  const int type = sqlite3_column_type(statement_.get(), column);
  if (type != SQLITE_TEXT && type != SQLITE_BLOB) return std::nullopt;
  const auto* const bytes = static_cast<const char*>(sqlite3_column_blob(statement_.get(), column));
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column));
  return bytes == nullptr ? std::string_view() : std::string_view(bytes, size);
}

void Database::Close::operator()(sqlite3* database) const {
  sqlite3_close_v2(database);
}

DatabaseResult<Database> Database::open(const std::string& path, OpenAs as, const std::string& vfs) {
  sqlite3* handle = nullptr;
  const int access = as == OpenAs::writer ? SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE : SQLITE_OPEN_READONLY;
  const char* const system = as == OpenAs::alone ? vfs_without_locks : nullptr;
  const int code = sqlite3_open_v2(uri_of(path, as).c_str(), &handle, access | SQLITE_OPEN_URI | SQLITE_OPEN_NOMUTEX,
                                   vfs.empty() ? system : vfs.c_str());
  if (handle == nullptr) return failure(DatabaseError{.code = SQLITE_NOMEM, .what = "open " + path + ": no memory"});
  Database database(handle);
  if (code != SQLITE_OK) return failure(database.error("open " + path));
  trust_nothing(handle);
  if (as == OpenAs::alone) {
    // The index of the pages in the log, which processes would share, is in private memory then (sqlite.org/wal.html).
    if (auto set = database.run("PRAGMA locking_mode = EXCLUSIVE"); !set) return failure(set.error());
    database.leave_as_it_is();
  }
  if (as == OpenAs::ruin) {
    // The only way to open a file that is shorter than its header states; nothing is written through this handle.
    sqlite3_db_config(handle, SQLITE_DBCONFIG_DEFENSIVE, 0, nullptr);
    if (auto set = database.run("PRAGMA writable_schema = ON"); !set) return failure(set.error());
  }
  return database;
}

DatabaseResult<Statement> Database::prepare(std::string_view sql) const {
  Statement statement;
  sqlite3_stmt* handle = nullptr;
  const int code = sqlite3_prepare_v2(database_.get(), sql.data(), static_cast<int>(sql.size()), &handle, nullptr);
  statement.statement_.reset(handle);
  if (code != SQLITE_OK) return failure(error("prepare"));
  return statement;
}

DatabaseResult<void> Database::run(const std::string& sql) const {
  if (sqlite3_exec(database_.get(), sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK) return {};
  return failure(error(std::string_view(sql).substr(0, sql.find_first_of(" (;"))));
}

DatabaseResult<std::optional<std::int64_t>> Database::number(std::string_view sql) const {
  auto statement = prepare(sql);
  if (!statement) return failure(statement.error());
  const auto has_row = statement->step();
  if (!has_row) return failure(has_row.error());
  return *has_row ? statement->number(0) : std::nullopt;
}

bool Database::is_in_transaction() const {
  return sqlite3_get_autocommit(database_.get()) == 0;
}

bool Database::is_read_only() const {
  return sqlite3_db_readonly(database_.get(), "main") == 1;
}

void Database::leave_as_it_is() const {
  sqlite3_db_config(database_.get(), SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
}

DatabaseError Database::error(std::string_view doing) const {
  return {.code = sqlite3_extended_errcode(database_.get()),
          .what = std::string(doing) + ": " + sqlite3_errmsg(database_.get())};
}

}  // namespace bmu
