#include "daemon/history/history_reader.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <utility>

#include <fcntl.h>
#include <sqlite3.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include "daemon/history/history_columns.hpp"
#include "daemon/history/history_schema.hpp"
#include "daemon/history/row_blob.hpp"

namespace bmu {

namespace {

constexpr std::int64_t sequence_max = history_number_max;
constexpr std::int64_t ms_per_s = 1'000;
constexpr std::size_t gaps_max = 200;

std::int64_t size_of(const std::string& path) {
  struct stat status {};
  return ::stat(path.c_str(), &status) == 0 ? status.st_size : -1;
}

/// A process that has it open holds a lock on bytes beyond the end of any history (sqlite.org/lockingv3.html).
bool is_open_elsewhere(const std::string& path) {
  constexpr off_t shared_first = 0x40000002;
  constexpr off_t shared_size = 510;
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return true;
  struct flock lock {};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  lock.l_start = shared_first;
  lock.l_len = shared_size;
  const bool is_told = ::fcntl(file, F_OFD_GETLK, &lock) == 0;
  ::close(file);
  return !is_told || lock.l_type != F_UNLCK;
}

/// "", or the reason for which no history can be at the path.
std::string misplaced(const std::string& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) return "no such file, or no permission to look for it";
  if (S_ISDIR(status.st_mode)) return "is a directory, the history is a file";
  return S_ISREG(status.st_mode) ? "" : "is no plain file, the history is one";
}

bool is_disk_full(const std::string& path) {
  struct statvfs disk {};
  return ::statvfs(path.c_str(), &disk) == 0 && disk.f_bavail == 0;
}

std::string words(std::optional<std::string_view> text) {
  return std::string(text.value_or(""));
}

/// Reads the columns from `index` on; returns the index after them.
template <class Row>
int read_columns(const RowValues& values, int index, std::span<const HistoryColumn<Row>> columns, Row& row) {
  for (const HistoryColumn<Row>& column : columns) {
    if (column.number != nullptr) {
      row.*column.number = values.number(index++);
    } else {
      row.*column.text = words(values.text(index++));
    }
  }
  return index;
}

constexpr int arrays_and_checksum = 3;

HistoryRow numbers_of(const RowValues& values) {
  HistoryRow row;
  row.sequence = values.number(0).value_or(-1);
  int next = read_columns(values, 1, row_columns_of(1), row) + arrays_and_checksum;
  for (std::int64_t version = 2; version <= history_version; ++version) {
    next = read_columns(values, next, row_columns_of(version), row);
  }
  return row;
}

/// Adds cells and sensors to the numbers. Returns "", or the error in any of them. Its session is not checked.
std::string add_arrays(const RowValues& values, HistoryRow& row) {
  const int blobs = static_cast<int>(row_columns_of(1).size()) + 1;
  const std::string_view cells = values.text(blobs).value_or("");
  const std::string_view sensors = values.text(blobs + 1).value_or("");
  if (values.number(blobs + 2) != checksum_of(row, cells, sensors)) return "checksum mismatch";
  auto all_cells = cells_from(cells);
  auto all_sensors = sensors_from(sensors);
  if (!all_cells || !all_sensors || all_cells->size() > cells_max || all_sensors->size() > sensors_max) {
    return "invalid cell layout";
  }
  row.cells = std::move(*all_cells);
  row.sensors = std::move(*all_sensors);
  return "";
}

/// The event, and whether its checksum is valid.
std::pair<HistoryEvent, bool> event_from(const RowValues& values) {
  HistoryEvent event;
  event.sequence = values.number(0).value_or(-1);
  const int checksum = read_columns(values, 1, event_columns(), event);
  return {event, values.number(checksum) == checksum_of(event)};
}

bool is_whole_minute(const RowValues& values) {
  HistoryRow row = numbers_of(values);
  return add_arrays(values, row).empty();
}
bool is_whole_event(const RowValues& values) {
  return event_from(values).second;
}

/// Its tables are being created, or their creator was killed: by its journal the database had no page before
/// (sqlite.org/fileformat2.html, the rollback journal). The daemon rolls that back when it opens the file the next
/// time.
bool is_being_created(const std::string& path) {
  constexpr std::streamoff pages_before_at = 16;
  constexpr std::array<char, 4> none{};
  std::array<char, 4> pages_before{};
  std::ifstream journal(path + "-journal", std::ios::binary);
  journal.seekg(pages_before_at);
  return journal.read(pages_before.data(), pages_before.size()) && pages_before == none;
}

/// A history has a journal beside it only until it has a log (-wal), and no table while it is not longer than a page.
bool is_locked_by_its_creator(const std::string& path) {
  return size_of(path + "-journal") >= 0 || size_of(path) <= static_cast<std::int64_t>(history_page_bytes);
}

/// First read, of the schema that everything else needs. The transaction stays open: later reads are of the same state,
/// and no creator continues between two reads.
DatabaseResult<void> look(const Database& database) {
  if (auto begun = database.run("BEGIN"); !begun) return begun;
  const auto count = database.number("SELECT count(*) FROM sqlite_schema");
  if (!count) return failure(count.error());
  return {};
}

/// A read fails with SQLITE_ERROR only if the file has an unknown format by its header.
bool is_damage(const DatabaseError& error) {
  return error.kind() == SQLITE_CORRUPT || error.kind() == SQLITE_NOTADB || error.kind() == SQLITE_ERROR;
}

DatabaseResult<Database> open_and_look(const std::string& path, OpenAs as) {
  auto database = Database::open(path, as);
  if (!database) return database;
  if (auto looked = look(*database); !looked) return failure(looked.error());
  return database;
}

}  // namespace

bool HistorySpan::has(const HistoryNumber& unix_time_ms) const {
  if (!unix_time_ms) return !from_unix_ms && !to_unix_ms;
  return unix_time_ms >= from_unix_ms && (!to_unix_ms || unix_time_ms < to_unix_ms);
}

// --- opening --------------------------------------------------------------------------------------------------------

Result<HistoryReader, std::string> HistoryReader::open(const std::string& path, HistoryAccess access) {
  if (const std::string why = misplaced(path); !why.empty()) return failure(path + ": " + why);
  if (size_of(path) == 0 || is_being_created(path)) return open_new(path);
  auto reader = open_as_it_can_be(path, access);
  if (reader) reader->access_ = access;
  if (reader && reader->database_ && !reader->is_new_) {
    if (const auto checked = reader->check(); !checked) {
      if (!checked.error().may_be_damage) return failure(checked.error().why);
      reader = open_by_pages(path, access, checked.error().why);
    } else if (reader->is_new_) {
      return open_new(path);
    }
  }
  if (reader) reader->read_lives();
  // Data that is written from now on may be read, too.
  if (reader && reader->database_ && reader->database_->is_in_transaction()) {
    static_cast<void>(reader->database_->run("COMMIT"));
  }
  return reader;
}

/// An empty history in memory instead of the file: its creator may lock that at any time until it is done.
Result<HistoryReader, std::string> HistoryReader::open_new(const std::string& path) {
  auto database = Database::open(":memory:", OpenAs::writer);
  if (!database) return failure(path + ": " + database.error().what);
  if (auto made = migrate(*database, history_steps()); !made) return failure(path + ": " + made.error().what);
  HistoryReader reader(path, std::move(*database));
  reader.is_new_ = true;
  reader.has_no_minute_ = true;
  return reader;
}

Result<HistoryReader, std::string> HistoryReader::open_as_it_can_be(const std::string& path, HistoryAccess access) {
  auto database = open_and_look(path, OpenAs::reader);
  if (database) return HistoryReader(path, std::move(*database));
  const DatabaseError error = database.error();
  if (error.kind() == SQLITE_BUSY) {
    if (is_locked_by_its_creator(path)) return open_new(path);
    return failure(path + ": locked by another program, try again");
  }
  for (const int kind : {SQLITE_CANTOPEN, SQLITE_READONLY, SQLITE_IOERR, SQLITE_FULL}) {
    if (error.kind() != kind) continue;
    if (access == HistoryAccess::beside_writer) return failure(path + ": " + error.what);
    return open_without_company(path, error);
  }
  if (is_damage(error)) return open_ruin(path, access, error);
  return failure(path + ": " + error.what);
}

Result<HistoryReader, std::string> HistoryReader::open_ruin(const std::string& path, HistoryAccess access,
                                                            const DatabaseError& error) {
  auto database = open_and_look(path, OpenAs::ruin);
  if (!database) {
    const bool is_none = error.kind() == SQLITE_NOTADB;
    return open_by_pages(path, access,
                         path + ": " + (is_none ? "not a history database, or its header is damaged" : error.what));
  }
  HistoryReader reader(path, std::move(*database));
  reader.is_ruin_ = true;
  reader.note(path + " is damaged (" + error.what + "); readable rows follow");
  return reader;
}

/// SQLite cannot open the file. `refusal`: the error for a file without a valid row of a history.
Result<HistoryReader, std::string> HistoryReader::open_by_pages(const std::string& path, HistoryAccess access,
                                                                const std::string& refusal) {
  if (access == HistoryAccess::beside_writer) return failure(refusal);
  HistoryReader reader(path);
  if (!reader.has_whole_row()) return failure(refusal);
  reader.note_damaged_beginning();
  if (size_of(path + "-wal") > 0) reader.note(path + "-wal not read");
  return reader;
}

/// The files that readers and the writer share cannot be created: no disk space, or no permission. While no process has
/// the database open it does not change, and they are not needed.
Result<HistoryReader, std::string> HistoryReader::open_without_company(const std::string& path,
                                                                       const DatabaseError& error) {
  const bool has_log = size_of(path + "-wal") > 0;
  const bool is_free = !is_open_elsewhere(path);
  if (is_free && has_log) {
    if (auto database = open_and_look(path, OpenAs::alone)) return HistoryReader(path, std::move(*database));
  }
  const bool lacks_rights = error.kind() == SQLITE_CANTOPEN || error.kind() == SQLITE_READONLY;
  const std::string why = error.what + (is_disk_full(path) ? "; the disk is full" : "");
  if (!is_free && !lacks_rights) return failure(path + ": " + why + ", and another program has the history open");
  auto database = open_and_look(path, OpenAs::still_file);
  if (!database && is_damage(database.error())) return open_ruin(path, HistoryAccess::in_any_way, database.error());
  if (!database) return failure(path + ": " + why);
  HistoryReader reader(path, std::move(*database));
  if (has_log) reader.note(path + "-wal unreadable, latest rows missing: " + why);
  return reader;
}

Result<void, HistoryReader::Refusal> HistoryReader::check() {
  const auto refused = [&](const std::string& why) { return failure(Refusal{.why = path_ + ": " + why}); };
  const auto minutes_found =
      database_->number("SELECT count(*) FROM sqlite_schema WHERE type = 'table' AND name = 'minute'");
  if (!minutes_found) return refused("is damaged where its tables are named: " + minutes_found.error().what);
  is_new_ = has_no_table_yet();
  if (is_new_) return {};
  if (minutes_found->value_or(0) != 1) return refused("not a history database of bmud");
  find_version();
  if (auto checked = check_version(); !checked) return checked;
  const auto select = database_->prepare(minutes().select);
  if (!select) return refused("is damaged where its tables are named: " + select.error().what);
  const auto page_bytes = database_->number("PRAGMA page_size");
  const bool has_log = size_of(path_ + "-wal") > 0;
  if (!is_ruin_ && !has_log && page_bytes && size_of(path_) % page_bytes->value_or(1) != 0) {
    is_ruin_ = true;
    note(path_ + " is truncated; readable rows follow");
  }
  const auto is_whole = has_schema(*database_, history_steps(version_));
  if (!is_whole || !*is_whole) note("the tables are not all those of a history");
  has_no_minute_ = is_known_to_be_without(minutes());
  is_new_ = has_no_minute_ && is_known_to_be_without(events());
  return {};
}

/// A database of one page at most, and of no program or of bmud. Its version distinguishes it from a history with a
/// damaged first page.
bool HistoryReader::has_no_table_yet() const {
  if (is_ruin_) return false;
  const auto is_found = [this](const char* question, std::int64_t wanted) {
    const auto answer = database_->number(question);
    return answer && answer->value_or(0) == wanted;
  };
  constexpr const char* id = "PRAGMA application_id";
  const auto pages = database_->number("PRAGMA page_count");
  return pages && pages->value_or(0) <= 1 && is_found("PRAGMA user_version", 0) &&
         is_found("SELECT count(*) FROM sqlite_schema", 0) && (is_found(id, 0) || is_found(id, history_application_id));
}

/// Of a history without damage, as far as it was read.
bool HistoryReader::is_known_to_be_without(const Table& table) const {
  if (is_ruin_ || !notes_.empty()) return false;
  const auto rows = database_->number("SELECT EXISTS (SELECT 1 FROM " + table.name + ")");
  return rows && rows->value_or(1) == 0;
}

std::int64_t HistoryReader::period_s() const {
  return lives().empty() ? HistoryLife{}.period_s : lives().back().period_s;
}

/// The newest version that has all its columns in the table: the version number may be the damaged part.
void HistoryReader::find_version() {
  for (version_ = history_version; version_ > 1; --version_) {
    if (database_->prepare(select_minutes_sql(version_))) return;
  }
}

/// A newer version has objects that this one does not have. If all objects are known, the version number is wrong.
Result<void, HistoryReader::Refusal> HistoryReader::check_version() {
  const auto version = database_->number("PRAGMA user_version");
  if (!version || *version == version_) return {};
  const auto by_tables = version_by_tables(*database_);
  if (by_tables && by_tables->has_value() && has_whole_row()) {
    note_damaged_beginning();
  } else if (version->value_or(0) > history_version) {
    return failure(Refusal{.why = path_ + ": was written by a newer bmud (schema " +
                                  std::to_string(version->value_or(0)) + ", this program knows " +
                                  std::to_string(history_version) + ")",
                           .may_be_damage = false});
  }
  return {};
}

bool HistoryReader::has_whole_row() {
  bool is_found = false;
  for (const Table* const table : {&minutes(), &events()}) {
    scan_quietly(*table, [&](const RowValues& values, std::int64_t) {
      is_found = table->is_whole(values);
      return !is_found;
    });
    if (is_found) return true;
  }
  return false;
}

/// If not all sessions are readable they are searched page by page, and completed from their rows.
void HistoryReader::read_lives() {
  if (database_) {
    lives_.read(*database_);
    if (lives_.are_whole()) return;
  }
  lives_.read(strays());
  std::map<std::int64_t, LifeOfRows> of_rows;
  scan_quietly(minutes(), [&](const RowValues& values, std::int64_t) {
    HistoryRow row = numbers_of(values);
    if (!row.life || !add_arrays(values, row).empty()) return true;
    LifeOfRows& rows = of_rows[*row.life];
    rows.cells = row.cells.size();
    rows.sensors = row.sensors.size();
    ++rows.spans_s[(row.span_ms.value_or(0) + ms_per_s / 2) / ms_per_s];
    return true;
  });
  lives_.complete(of_rows);
}

// --- reading --------------------------------------------------------------------------------------------------------

/// From the first row to the last; if that is implausible, all possible sequence numbers.
HistoryReader::Range HistoryReader::range_of(const Table& table) {
  if (!database_) return range_of_strays(table, "no index");
  if (is_ruin_) return {.first = 1, .last = sequence_max};
  const auto first = database_->number("SELECT min(sequence) FROM " + table.name);
  const auto last = database_->number("SELECT max(sequence) FROM " + table.name);
  if (!first && !last) return range_of_strays(table, first.error().what);
  if (first && !first->has_value()) return {.first = 1, .last = 0};
  if (last && last->value_or(0) > sequence_max) {
    note_gap(table.name, sequence_max, sequence_max, "sequence number out of range");
  }
  const bool is_sane = first && last && first->value_or(0) >= 0 && first->value_or(0) <= last->value_or(-1) &&
                       last->value_or(0) <= sequence_max;
  return is_sane ? Range{.first = **first, .last = **last} : Range{.first = 1, .last = sequence_max};
}

/// By the index over the time: the other columns of the rows, which are large, are not read.
HistoryReader::Range HistoryReader::range_of(const HistorySpan& span) {
  if (!database_ || is_ruin_ || (!span.from_unix_ms && !span.to_unix_ms)) return range_of(minutes());
  auto statement = database_->prepare(
      "SELECT min(sequence), max(sequence) FROM minute INDEXED BY minute_by_time "
      "WHERE unix_time_ms >= ? AND unix_time_ms < ?");
  if (!statement) return range_of(minutes());
  statement->bind(1, span.from_unix_ms.value_or(INT64_MIN));
  statement->bind(2, span.to_unix_ms.value_or(INT64_MAX));
  const auto has_row = statement->step();
  if (!has_row) {
    note("the index over the time cannot be read: " + has_row.error().what);
    return range_of(minutes());
  }
  return {.first = std::max<std::int64_t>(0, statement->number(0).value_or(1)),
          .last = std::min(sequence_max, statement->number(1).value_or(0))};
}

const HistoryReader::Table& HistoryReader::minutes() const {
  static const auto table_of = [](std::int64_t version) {
    return Table{.name = "minute",
                 .select = select_minutes_sql(version),
                 .columns = minute_columns(history_version),
                 .columns_min = minute_columns(1),
                 .is_whole = is_whole_minute};
  };
  static const std::array tables{table_of(1), table_of(2)};
  static_assert(tables.size() == history_version);
  return tables.at(static_cast<std::size_t>(version_ - 1));
}

const HistoryReader::Table& HistoryReader::events() {
  static const Table table{.name = "event",
                           .select = select_events_sql(),
                           .columns = event_columns().size() + 2,
                           .columns_min = event_columns().size() + 2,
                           .is_whole = is_whole_event};
  return table;
}

/// Reads the rows of one table in their order. Unreadable ones are skipped in growing steps; those of them that are
/// found page by page are passed on in their place.
void HistoryReader::scan(const Table& table, Range range, const TakeValues& take) {
  if (!database_) return static_cast<void>(bridge(table, range, "not found", take));
  auto statement = database_->prepare(table.select + " WHERE sequence >= ? AND sequence <= ? ORDER BY sequence");
  if (!statement) return note("no row of " + table.name + " can be read: " + statement.error().what);
  std::int64_t next = range.first;
  std::int64_t skipped = 1;
  while (next <= range.last) {
    statement->reset();
    statement->bind(1, next);
    statement->bind(2, range.last);
    std::string trouble;
    while (trouble.empty()) {
      const auto has_row = statement->step();
      if (has_row && !*has_row) return;
      const std::int64_t sequence = has_row ? statement->number(0).value_or(-1) : -1;
      if (!has_row) {
        trouble = has_row.error().what;
      } else if (sequence < next) {
        trouble = "rows out of order";
      } else {
        next = sequence + 1;
        skipped = 1;
        if (!take(StatementRow(*statement), sequence)) return;
      }
    }
    statement->reset();
    if (!bridge(table, {.first = next, .last = std::min(next + skipped - 1, range.last)}, trouble, take)) return;
    next += skipped;
    skipped *= 2;
  }
}

/// Reads all rows without a record of unreadable ones: those are noted when a caller reads them.
void HistoryReader::scan_quietly(const Table& table, const TakeValues& take) {
  const std::vector<Gap> gaps = gaps_;
  const std::vector<std::string> notes = notes_;
  scan(table, range_of(table), take);
  gaps_ = gaps;
  notes_ = notes;
}

/// Passes on rows that are only found page by page; missing ones between them are noted. False: `take` requested the
/// end.
bool HistoryReader::bridge(const Table& table, Range gap, const std::string& trouble, const TakeValues& take) {
  bool is_enough = false;
  std::int64_t next = gap.first;
  strays().for_each({table.columns_min, table.columns}, gap.first, gap.last,
                    [&](const RowValues& values, std::int64_t sequence) {
                      if (sequence < next || !table.is_whole(values)) return true;
                      if (sequence > next) note_gap(table.name, next, sequence - 1, trouble);
                      next = sequence + 1;
                      is_enough = !take(values, sequence);
                      return !is_enough;
                    });
  if (!is_enough && next <= gap.last) note_gap(table.name, next, gap.last, trouble);
  return !is_enough;
}

StrayRows& HistoryReader::strays() {
  if (strays_ != nullptr) return *strays_;
  const bool may_open = access_ != HistoryAccess::beside_writer;
  strays_ = std::make_unique<StrayRows>(may_open ? path_ : "", history_page_bytes);
  return *strays_;
}

/// Range of the rows that are found page by page, if nothing else gives it.
HistoryReader::Range HistoryReader::range_of_strays(const Table& table, const std::string& trouble) {
  Range range{.first = 1, .last = 0};
  std::size_t count = 0;
  strays().for_each({table.columns_min, table.columns}, 0, sequence_max,
                    [&](const RowValues& values, std::int64_t sequence) {
                      if (!table.is_whole(values)) return true;
                      if (count++ == 0) range.first = sequence;
                      range.last = sequence;
                      return true;
                    });
  if (!database_) return range;
  note("index of table " + table.name + " damaged (" + trouble + "): " + std::to_string(count) +
       " rows salvaged page by page, more may be missing");
  return range;
}

/// "", or the reason for which its cells cannot be identified.
std::string HistoryReader::misfit_of(const HistoryRow& row) const {
  const HistoryLife* const life = life_of(row);
  if (life == nullptr) return "session unknown";
  const bool fits = row.cells.size() == life->layout.cell_count() && row.sensors.size() == life->layout.sensor_count();
  return fits ? "" : "cells do not match the session";
}

void HistoryReader::for_each_row(const HistorySpan& span, const std::function<bool(const HistoryRow&)>& take) {
  read_rows(span, range_of(span), take);
}

void HistoryReader::for_each_row_after(std::int64_t sequence, const std::function<bool(const HistoryRow&)>& take) {
  Range range = range_of(minutes());
  range.first = std::max(range.first, sequence + 1);
  read_rows({}, range, take);
}

void HistoryReader::read_rows(const HistorySpan& span, Range range,
                              const std::function<bool(const HistoryRow&)>& take) {
  scan(minutes(), range, [&](const RowValues& values, std::int64_t sequence) {
    HistoryRow row = numbers_of(values);
    if (!span.has(row.unix_time_ms)) return true;
    std::string problem = add_arrays(values, row);
    if (problem.empty()) problem = misfit_of(row);
    if (problem.empty()) return take(row);
    note_gap("minute", sequence, sequence, problem);
    return true;
  });
}

void HistoryReader::for_each_event(const HistorySpan& span, const std::function<bool(const HistoryEvent&)>& take) {
  scan(events(), range_of(events()), [&](const RowValues& values, std::int64_t sequence) {
    const auto [event, is_whole] = event_from(values);
    if (!span.has(event.unix_time_ms)) return true;
    if (is_whole) return take(event);
    note_gap("event", sequence, sequence, "checksum mismatch");
    return true;
  });
}

HistorySpan HistoryReader::covered() {
  HistorySpan span;
  if (!database_) {
    scan_quietly(minutes(), [&](const RowValues& values, std::int64_t) {
      const HistoryNumber time_ms = numbers_of(values).unix_time_ms;
      if (!time_ms) return true;
      span.from_unix_ms = std::min(span.from_unix_ms.value_or(*time_ms), *time_ms);
      span.to_unix_ms = std::max(span.to_unix_ms.value_or(0), std::min(*time_ms, history_number_max) + 1);
      return true;
    });
    return span;
  }
  const auto first = database_->number("SELECT min(unix_time_ms) FROM minute");
  const auto last = database_->number("SELECT max(unix_time_ms) FROM minute");
  if (first && *first) span.from_unix_ms = **first;
  if (last && *last) span.to_unix_ms = std::min(**last, history_number_max) + 1;
  return span;
}

void HistoryReader::note_gap(const std::string& table, std::int64_t first, std::int64_t last,
                             const std::string& reason) {
  const auto has_this = [&](const Gap& gap) {
    return gap.table == table && gap.reason == reason && gap.first <= first && last <= gap.last;
  };
  if (std::any_of(gaps_.begin(), gaps_.end(), has_this)) return;  // read again
  const bool goes_on =
      !gaps_.empty() && gaps_.back().table == table && gaps_.back().reason == reason && gaps_.back().last + 1 == first;
  if (goes_on) {
    gaps_.back().last = last;
  } else if (gaps_.size() < gaps_max) {
    gaps_.push_back({.table = table, .first = first, .last = last, .reason = reason});
  } else if (gaps_.size() == gaps_max) {
    gaps_.push_back({.table = table, .first = first, .last = sequence_max, .reason = "similar gaps"});
  }
}

std::vector<std::string> HistoryReader::problems() const {
  std::vector<std::string> texts = notes_;
  texts.insert(texts.end(), lives_.problems().begin(), lives_.problems().end());
  for (const Gap& gap : gaps_) {
    std::string text = gap.table + " " + std::to_string(gap.first);
    if (gap.last >= sequence_max) {
      text += " and what follows";
    } else if (gap.last > gap.first) {
      text += " to " + std::to_string(gap.last);
    }
    texts.push_back(text + ": " + gap.reason);
  }
  return texts;
}

}  // namespace bmu
