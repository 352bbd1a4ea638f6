#include "daemon/history/history_file.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <utility>

#include <sqlite3.h>
#include <sys/stat.h>
#include <unistd.h>

#include "daemon/history/history_columns.hpp"
#include "daemon/history/history_schema.hpp"
#include "daemon/history/history_trim.hpp"
#include "daemon/history/row_blob.hpp"

namespace bmu {

namespace {

// A group of users may read it, as they may query the daemon.
constexpr mode_t file_mode = 0640;
constexpr std::array<const char*, 2> companions{"-wal", "-shm"};
// The log is checkpointed at 2 MB and cut to 4 MB. FULL: a row is on the disk when it counts as written.
constexpr const char* settings_sql =
    "PRAGMA journal_mode = WAL;"
    "PRAGMA synchronous = FULL;"
    "PRAGMA wal_autocheckpoint = 256;"
    "PRAGMA journal_size_limit = 4000000;"
    "PRAGMA cell_size_check = ON;";

// To be set before a table exists: later it cannot be changed. Writes nothing yet.
constexpr const char* creation_sql = "PRAGMA page_size = 8192;";
static_assert(history_page_bytes == 8'192);

HistoryTrouble trouble_of(int kind) {
  switch (kind) {
    case SQLITE_BUSY:
    case SQLITE_LOCKED: return HistoryTrouble::busy;
    case SQLITE_FULL: return HistoryTrouble::full;
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB: return HistoryTrouble::damaged;
    default: return HistoryTrouble::refused;
  }
}

DatabaseError damaged(std::string what) {
  return {.code = SQLITE_CORRUPT, .what = std::move(what)};
}

std::int64_t size_of(const std::string& path) {
  struct stat status {};
  return ::stat(path.c_str(), &status) == 0 ? status.st_size : 0;
}

bool exists(const std::string& path) {
  struct stat status {};
  return ::lstat(path.c_str(), &status) == 0;
}

std::string time_in_a_name() {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  ::gmtime_r(&now, &parts);
  std::array<char, 32> text{};
  std::strftime(text.data(), text.size(), "%Y%m%dT%H%M%SZ", &parts);
  return text.data();
}

int put_aside_before(const std::string& path) {
  const std::filesystem::path file(path);
  const std::string begin = file.filename().string() + ".damaged-";
  std::error_code error;
  int count = 0;
  const auto folder = file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
  for (std::filesystem::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    const std::string name = at->path().filename().string();
    if (name.starts_with(begin) && !name.ends_with(companions[0]) && !name.ends_with(companions[1])) ++count;
  }
  return count;
}

template <class Row>
int bind_columns(Statement& statement, int index, std::span<const HistoryColumn<Row>> columns, const Row& row) {
  for (const HistoryColumn<Row>& column : columns) {
    if (column.number != nullptr) {
      statement.bind(index++, row.*column.number);
    } else {
      statement.bind_text(index++, row.*column.text);
    }
  }
  return index;
}

/// Executes a statement that returns no rows.
DatabaseResult<void> step_once(Statement& statement) {
  const auto stepped = statement.step();
  statement.reset();
  if (!stepped) return failure(stepped.error());
  return {};
}

DatabaseResult<std::int64_t> next_sequence(const Database& database, const char* sql) {
  const auto last = database.number(sql);
  if (!last) return failure(last.error());
  if (last->value_or(0) < 0 || last->value_or(0) >= history_number_max) {
    return failure(damaged("its rows are counted wrongly"));
  }
  return last->value_or(0) + 1;
}

}  // namespace

struct HistoryFile::Open {
  Database database;
  Identity identity;
  std::optional<Statement> insert_minute{};
  std::optional<Statement> insert_event{};
  std::int64_t life = 0;            // 0: not in the database yet
  std::int64_t last_uptime_ms = 0;  // of this session's rows in the database
  std::int64_t last_event = 0;
};

HistoryFile::HistoryFile(HistoryFileOptions options, HistoryLife life)
    : options_(std::move(options)), life_(std::move(life)) {}

HistoryFile::~HistoryFile() = default;

void HistoryFile::close() {
  open_.reset();
}

std::int64_t HistoryFile::size_bytes() const {
  std::int64_t size = size_of(options_.path);
  for (const char* companion : companions) size += size_of(options_.path + companion);
  return size;
}

std::optional<HistoryFile::Identity> HistoryFile::identity() const {
  struct stat status {};
  if (::stat(options_.path.c_str(), &status) != 0) return std::nullopt;
  return Identity{.device = status.st_dev, .number = status.st_ino};
}

HistoryError HistoryFile::error_of(const DatabaseError& error) const {
  return {.trouble = trouble_of(error.kind()), .what = options_.path + ": " + error.what};
}

// --- opening --------------------------------------------------------------------------------------------------------

HistoryResult<void> HistoryFile::open() {
  if (open_ != nullptr && identity() == open_->identity) return {};
  // Closing writes the log into the file, wherever that was moved; the log must not be found beside another file.
  close();
  auto opened = open_new();
  if (!opened) {
    // A faulty database is kept as it is, for inspection.
    if (open_ != nullptr) open_->database.leave_as_it_is();
    close();
  }
  return opened;
}

HistoryResult<void> HistoryFile::open_new() {
  struct stat status {};
  if (::stat(options_.path.c_str(), &status) == 0 && !S_ISREG(status.st_mode)) {
    return failure(HistoryError{HistoryTrouble::foreign, options_.path + ": is no plain file"});
  }
  auto database = Database::open(options_.path, OpenAs::writer, options_.vfs);
  if (!database) return failure(error_of(database.error()));
  open_ = std::make_unique<Open>(Open{.database = std::move(*database), .identity = {}});
  if (auto made = make_ours(open_->database); !made) return made;
  // SQLite copies the permissions of the file to those that it creates beside it.
  static_cast<void>(::chmod(options_.path.c_str(), file_mode));
  if (auto set = open_->database.run(settings_sql); !set) return failure(error_of(set.error()));
  if (auto prepared = prepare(*open_); !prepared) return failure(error_of(prepared.error()));
  open_->identity = identity().value_or(Identity{});
  return {};
}

/// Checks before anything is written; then creates or migrates the tables.
HistoryResult<void> HistoryFile::make_ours(const Database& database) const {
  std::array<std::int64_t, 4> found{};
  constexpr std::array questions{"PRAGMA application_id", "PRAGMA user_version", "SELECT count(*) FROM sqlite_schema",
                                 "SELECT count(*) FROM sqlite_schema WHERE name = 'minute'"};
  for (std::size_t index = 0; index < questions.size(); ++index) {
    const auto answer = database.number(questions.at(index));
    const bool is_ours = index > 0 && found[0] == history_application_id;
    if (!answer && is_ours && answer.error().kind() == SQLITE_ERROR) {
      return failure(error_of(damaged("unknown file format")));
    }
    if (!answer) return failure(error_of(answer.error()));
    found.at(index) = answer->value_or(0);
  }
  const auto [id, version, things, minutes] = found;
  const bool is_empty = things == 0 && version == 0 && (id == 0 || id == history_application_id);
  if (!is_empty && id != history_application_id && minutes == 0) {
    return failure(HistoryError{HistoryTrouble::foreign, options_.path + ": is another program's database"});
  }
  if (id == history_application_id && database.is_read_only() && ::access(options_.path.c_str(), W_OK) == 0) {
    return failure(error_of(damaged("file format not writable")));
  }
  if (!is_empty) {
    if (auto checked = check_version(database, version); !checked) return checked;
  }
  if (is_empty) {
    if (auto created = database.run(creation_sql); !created) return failure(error_of(created.error()));
  }
  if (auto migrated = migrate(database, history_steps()); !migrated) return failure(error_of(migrated.error()));
  const auto is_whole = has_schema(database, history_steps());
  if (!is_whole) return failure(error_of(is_whole.error()));
  if (!*is_whole || (!is_empty && id != history_application_id)) {
    return failure(error_of(damaged("its tables are not those of a history")));
  }
  return {};
}

/// A newer version has objects that this one does not have, an older one lacks some.
HistoryResult<void> HistoryFile::check_version(const Database& database, std::int64_t version) const {
  if (version == history_version) return {};
  const auto by_tables = version_by_tables(database);
  if (!by_tables) return failure(error_of(by_tables.error()));
  if (by_tables->has_value() && *by_tables != version) {
    return failure(error_of(damaged("has schema " + std::to_string(version) + " by its beginning, and schema " +
                                    std::to_string(**by_tables) + " by its tables")));
  }
  if (version < history_version) return {};
  return failure(HistoryError{HistoryTrouble::newer, options_.path + ": was written by a newer bmud (schema " +
                                                         std::to_string(version) + ", this one knows " +
                                                         std::to_string(history_version) + "): left as it is"});
}

DatabaseResult<void> HistoryFile::prepare(Open& open) const {
  auto insert_minute = open.database.prepare(insert_minute_sql());
  if (!insert_minute) return failure(insert_minute.error());
  open.insert_minute = std::move(*insert_minute);
  auto insert_event = open.database.prepare(insert_event_sql());
  if (!insert_event) return failure(insert_event.error());
  open.insert_event = std::move(*insert_event);
  return find_life(open);
}

/// Finds the rows and events that this session has written already.
DatabaseResult<void> HistoryFile::find_life(Open& open) const {
  auto statement = open.database.prepare("SELECT id FROM life WHERE token = ?");
  if (!statement) return failure(statement.error());
  statement->bind_text(1, life_.token);
  const auto has_row = statement->step();
  if (!has_row) return failure(has_row.error());
  if (!*has_row) return {};
  open.life = statement->number(0).value_or(0);
  const std::string id = std::to_string(open.life);
  const auto uptime_ms =
      open.database.number("SELECT uptime_ms FROM minute WHERE life = " + id + " ORDER BY sequence DESC LIMIT 1");
  if (!uptime_ms) return failure(uptime_ms.error());
  const auto event =
      open.database.number("SELECT number FROM event WHERE life = " + id + " ORDER BY sequence DESC LIMIT 1");
  if (!event) return failure(event.error());
  open.last_uptime_ms = uptime_ms->value_or(0);
  open.last_event = event->value_or(0);
  return {};
}

// --- writing --------------------------------------------------------------------------------------------------------

DatabaseResult<std::int64_t> HistoryFile::layout_id(const Database& database) const {
  auto find = database.prepare("SELECT id FROM layout WHERE modules = ?");
  if (!find) return failure(find.error());
  find->bind_text(1, to_text(life_.layout));
  const auto has_row = find->step();
  if (!has_row) return failure(has_row.error());
  if (*has_row) return find->number(0).value_or(0);
  auto insert = database.prepare("INSERT INTO layout (modules) VALUES (?) RETURNING id");
  if (!insert) return failure(insert.error());
  insert->bind_text(1, to_text(life_.layout));
  if (auto inserted = insert->step(); !inserted) return failure(inserted.error());
  const std::int64_t id = insert->number(0).value_or(0);
  if (auto placed = insert_places(database, id); !placed) return failure(placed.error());
  return id;
}

DatabaseResult<void> HistoryFile::insert_places(const Database& database, std::int64_t layout) const {
  auto statement = database.prepare("INSERT INTO place (layout, kind, number, module, place) VALUES (?, ?, ?, ?, ?)");
  if (!statement) return failure(statement.error());
  const auto insert = [&](const HistoryPlace& place, std::string_view kind) {
    statement->bind(1, layout);
    statement->bind_text(2, kind);
    statement->bind(3, place.number);
    statement->bind(4, place.module);
    statement->bind(5, place.place);
    return step_once(*statement);
  };
  for (const HistoryPlace& place : life_.layout.cells()) {
    if (auto inserted = insert(place, "cell"); !inserted) return inserted;
  }
  for (const HistoryPlace& place : life_.layout.sensors()) {
    if (auto inserted = insert(place, place.is_board ? "board" : "sensor"); !inserted) return inserted;
  }
  return {};
}

DatabaseResult<void> HistoryFile::begin_life(Open& open) const {
  const auto layout = layout_id(open.database);
  if (!layout) return failure(layout.error());
  auto statement = open.database.prepare(
      "INSERT INTO life (token, version, pack_name, config, period_s, layout) VALUES (?, ?, ?, ?, ?, ?) RETURNING id");
  if (!statement) return failure(statement.error());
  statement->bind_text(1, life_.token);
  statement->bind_text(2, life_.version);
  statement->bind_text(3, life_.pack_name);
  statement->bind_text(4, life_.config);
  statement->bind(5, life_.period_s);
  statement->bind(6, *layout);
  if (auto inserted = statement->step(); !inserted) return failure(inserted.error());
  open.life = statement->number(0).value_or(0);
  return {};
}

DatabaseResult<void> HistoryFile::insert(Open& open, std::span<const HistoryRow> rows,
                                         std::span<const HistoryEvent> events) const {
  if (open.life == 0) {
    if (auto begun = begin_life(open); !begun) return begun;
  }
  auto sequence = next_sequence(open.database, "SELECT max(sequence) FROM minute");
  if (!sequence) return failure(sequence.error());
  for (HistoryRow row : rows) {
    if (row.uptime_ms.value_or(0) <= open.last_uptime_ms) continue;
    row.sequence = (*sequence)++;
    row.life = open.life;
    const std::string cells = blob_of(row.cells);
    const std::string sensors = blob_of(row.sensors);
    open.insert_minute->bind(1, row.sequence);
    int next = bind_columns(*open.insert_minute, 2, row_columns_of(1), row);
    open.insert_minute->bind_blob(next++, cells);
    open.insert_minute->bind_blob(next++, sensors);
    open.insert_minute->bind(next++, checksum_of(row, cells, sensors));
    for (std::int64_t version = 2; version <= history_version; ++version) {
      next = bind_columns(*open.insert_minute, next, row_columns_of(version), row);
    }
    if (auto inserted = step_once(*open.insert_minute); !inserted) return inserted;
  }
  sequence = next_sequence(open.database, "SELECT max(sequence) FROM event");
  if (!sequence) return failure(sequence.error());
  for (HistoryEvent event : events) {
    if (event.number.value_or(0) <= open.last_event) continue;
    event.sequence = (*sequence)++;
    event.life = open.life;
    open.insert_event->bind(1, event.sequence);
    const int next = bind_columns(*open.insert_event, 2, event_columns(), event);
    open.insert_event->bind(next, checksum_of(event));
    if (auto inserted = step_once(*open.insert_event); !inserted) return inserted;
  }
  return {};
}

HistoryResult<void> HistoryFile::write(std::span<const HistoryRow> rows, std::span<const HistoryEvent> events) {
  if (auto opened = open(); !opened) return opened;
  auto written = open_->database.run("BEGIN IMMEDIATE");
  if (written) written = insert(*open_, rows, events);
  if (written) written = open_->database.run("COMMIT");
  if (written) {
    if (!rows.empty()) open_->last_uptime_ms = std::max(open_->last_uptime_ms, rows.back().uptime_ms.value_or(0));
    if (!events.empty()) open_->last_event = std::max(open_->last_event, events.back().number.value_or(0));
    return {};
  }
  const HistoryError error = error_of(written.error());
  if (error.trouble == HistoryTrouble::damaged) open_->database.leave_as_it_is();
  close();  // which rolls back
  return failure(error);
}

HistoryResult<bool> HistoryFile::trim() {
  if (auto opened = open(); !opened) return failure(opened.error());
  const auto is_more = trim_history(open_->database, {.rows_max = options_.keep_days * 86'400 / life_.period_s,
                                                      .keep_ms = options_.keep_days * 86'400'000,
                                                      .period_s = life_.period_s,
                                                      .size_max_bytes = options_.size_max_bytes,
                                                      .log_bytes = size_of(options_.path + companions[0]),
                                                      .events_max = events_max});
  if (is_more) return *is_more;
  const HistoryError error = error_of(is_more.error());
  if (error.trouble == HistoryTrouble::damaged) open_->database.leave_as_it_is();
  close();
  return failure(error);
}

// --- putting aside --------------------------------------------------------------------------------------------------

HistoryResult<std::string> HistoryFile::put_aside() {
  close();
  if (put_aside_before(options_.path) >= aside_max) {
    return failure(HistoryError{HistoryTrouble::damaged,
                                options_.path + ": damaged like the " + std::to_string(aside_max) +
                                    " quarantined ones before: check the disk, and " + options_.path + ".damaged-*"});
  }
  const std::string wanted = options_.path + ".damaged-" + time_in_a_name();
  std::string name = wanted;
  for (int number = 2; exists(name); ++number) name = wanted + "-" + std::to_string(number);
  // The files that belong to it are renamed first: none of them may be found beside the new one.
  for (const char* end : {companions[0], companions[1], ""}) {
    if (!exists(options_.path + end)) continue;
    if (::rename((options_.path + end).c_str(), (name + end).c_str()) == 0) continue;
    return failure(HistoryError{HistoryTrouble::refused,
                                options_.path + ": damaged and cannot be quarantined: " + std::strerror(errno)});
  }
  return name;
}

}  // namespace bmu
