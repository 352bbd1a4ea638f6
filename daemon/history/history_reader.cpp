#include "daemon/history/history_reader.hpp"

#include <algorithm>
#include <utility>

#include <sqlite3.h>
#include <sys/stat.h>

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

std::string words(std::optional<std::string_view> text) {
  return std::string(text.value_or(""));
}

/// The columns from `index` on; the index behind them.
template <class Row>
int read_columns(const Statement& statement, int index, std::span<const HistoryColumn<Row>> columns, Row& row) {
  for (const HistoryColumn<Row>& column : columns) {
    if (column.number != nullptr) {
      row.*column.number = statement.number(index++);
    } else {
      row.*column.text = words(statement.text(index++));
    }
  }
  return index;
}

/// A first look that touches what everything else needs.
DatabaseResult<void> look(const Database& database) {
  const auto count = database.number("SELECT count(*) FROM sqlite_schema");
  if (!count) return failure(count.error());
  return {};
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

Result<HistoryReader, std::string> HistoryReader::open(const std::string& path) {
  if (size_of(path) < 0) return failure(path + ": no such file, or no permission to look for it");
  if (size_of(path) == 0) return failure(path + ": an empty file, nothing has been written yet");
  auto reader = open_as_it_can_be(path);
  if (!reader) return reader;
  if (auto checked = reader->check(); !checked) return failure(checked.error());
  reader->read_lives();
  return reader;
}

Result<HistoryReader, std::string> HistoryReader::open_as_it_can_be(const std::string& path) {
  auto database = open_and_look(path, OpenAs::reader);
  if (database) return HistoryReader(path, std::move(*database));
  const DatabaseError error = database.error();
  if (error.kind() == SQLITE_CANTOPEN || error.kind() == SQLITE_READONLY) {
    // Nobody has it open, and we may make no files beside it: then it does not change either.
    database = open_and_look(path, OpenAs::still_file);
    if (!database) return failure(path + ": " + error.what);
    HistoryReader reader(path, std::move(*database));
    if (size_of(path + "-wal") > 0) {
      reader.note("the latest rows are in " + path + "-wal, which cannot be read without the right to write beside it");
    }
    return reader;
  }
  if (error.kind() == SQLITE_CORRUPT) {
    database = open_and_look(path, OpenAs::ruin);
    if (!database) return failure(path + ": " + error.what);
    HistoryReader reader(path, std::move(*database));
    reader.is_ruin_ = true;
    reader.note(path + " is damaged (" + error.what + "): what of it can be read follows");
    return reader;
  }
  if (error.kind() == SQLITE_NOTADB) return failure(path + ": is no history, or its beginning is damaged");
  return failure(path + ": " + error.what);
}

Result<void, std::string> HistoryReader::check() {
  const auto minutes = database_.number("SELECT count(*) FROM sqlite_schema WHERE type = 'table' AND name = 'minute'");
  if (!minutes) return failure(path_ + ": is damaged where its tables are named: " + minutes.error().what);
  if (minutes->value_or(0) != 1) return failure(path_ + ": is no history of bmud");
  const auto version = database_.number("PRAGMA user_version");
  if (version && version->value_or(0) > history_version) {
    return failure(path_ + ": was written by a newer bmud (schema " + std::to_string(version->value_or(0)) +
                   ", this program knows " + std::to_string(history_version) + ")");
  }
  const auto page_bytes = database_.number("PRAGMA page_size");
  const bool has_log = size_of(path_ + "-wal") > 0;
  if (!is_ruin_ && !has_log && page_bytes && size_of(path_) % page_bytes->value_or(1) != 0) {
    is_ruin_ = true;
    note(path_ + " is cut short: what of it can be read follows");
  }
  const auto is_whole = has_schema(database_, history_steps());
  if (!is_whole || !*is_whole) note("the tables are not all those of a history");
  return {};
}

/// Where not all of them can be read, the rows are asked what they know of theirs.
void HistoryReader::read_lives() {
  lives_.read(database_);
  if (lives_.are_whole()) return;
  const std::vector<Gap> gaps = gaps_;  // what cannot be read is told when somebody wants to read it
  std::map<std::int64_t, LifeOfRows> of_rows;
  scan("minute", select_minutes_sql(), range_of("minute"), [&](const Statement& statement, std::int64_t) {
    HistoryRow row = numbers_of(statement);
    if (!row.life || !add_arrays(statement, row).empty()) return true;
    LifeOfRows& rows = of_rows[*row.life];
    rows.cells = row.cells.size();
    rows.sensors = row.sensors.size();
    ++rows.spans_s[(row.span_ms.value_or(0) + ms_per_s / 2) / ms_per_s];
    return true;
  });
  gaps_ = gaps;
  lives_.complete(of_rows);
}

// --- reading --------------------------------------------------------------------------------------------------------

/// From the first row to the last; where that cannot be read, as far as rows are counted.
HistoryReader::Range HistoryReader::range_of(const std::string& table) {
  if (is_ruin_) return {.first = 0, .last = sequence_max};
  const auto first = database_.number("SELECT min(sequence) FROM " + table);
  const auto last = database_.number("SELECT max(sequence) FROM " + table);
  if (first && !first->has_value()) return {.first = 1, .last = 0};
  if (last && last->value_or(0) > sequence_max) {
    note_gap(table, sequence_max, sequence_max, "nobody has counted that far");
  }
  const bool is_sane = first && last && first->value_or(0) >= 0 && first->value_or(0) <= last->value_or(-1) &&
                       last->value_or(0) <= sequence_max;
  return is_sane ? Range{.first = **first, .last = **last} : Range{.first = 0, .last = sequence_max};
}

/// By the index over the time: the rest of the rows, which are large, is not touched.
HistoryReader::Range HistoryReader::range_of(const HistorySpan& span) {
  if (is_ruin_ || (!span.from_unix_ms && !span.to_unix_ms)) return range_of("minute");
  auto statement = database_.prepare(
      "SELECT min(sequence), max(sequence) FROM minute INDEXED BY minute_by_time "
      "WHERE unix_time_ms >= ? AND unix_time_ms < ?");
  if (!statement) return range_of("minute");
  statement->bind(1, span.from_unix_ms.value_or(INT64_MIN));
  statement->bind(2, span.to_unix_ms.value_or(INT64_MAX));
  const auto has_row = statement->step();
  if (!has_row) {
    note("the index over the time cannot be read: " + has_row.error().what);
    return range_of("minute");
  }
  return {.first = std::max<std::int64_t>(0, statement->number(0).value_or(1)),
          .last = std::min(sequence_max, statement->number(1).value_or(0))};
}

/// Rows of one table in their order. Over what cannot be read it goes on behind, in growing steps.
void HistoryReader::scan(const std::string& table, const std::string& select, Range range,
                         const std::function<bool(const Statement&, std::int64_t sequence)>& take) {
  auto statement = database_.prepare(select + " WHERE sequence >= ? AND sequence <= ? ORDER BY sequence");
  if (!statement) return note("no row of " + table + " can be read: " + statement.error().what);
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
        trouble = "rows are mixed up";
      } else {
        next = sequence + 1;
        skipped = 1;
        if (!take(*statement, sequence)) return;
      }
    }
    note_gap(table, next, std::min(next + skipped - 1, range.last), trouble);
    next += skipped;
    skipped *= 2;
  }
}

HistoryRow HistoryReader::numbers_of(const Statement& statement) {
  HistoryRow row;
  row.sequence = statement.number(0).value_or(-1);
  read_columns(statement, 1, row_columns(), row);
  return row;
}

/// Takes cells and sensors to the numbers: "", or what is wrong with them all. Its life is not looked at.
std::string HistoryReader::add_arrays(const Statement& statement, HistoryRow& row) {
  const int blobs = static_cast<int>(row_columns().size()) + 1;
  const std::string_view cells = statement.text(blobs).value_or("");
  const std::string_view sensors = statement.text(blobs + 1).value_or("");
  if (statement.number(blobs + 2) != checksum_of(row, cells, sensors)) return "the checksum is wrong";
  auto all_cells = cells_from(cells);
  auto all_sensors = sensors_from(sensors);
  if (!all_cells || !all_sensors || all_cells->size() > cells_max || all_sensors->size() > sensors_max) {
    return "its cells are not those of any pack";
  }
  row.cells = std::move(*all_cells);
  row.sensors = std::move(*all_sensors);
  return "";
}

/// "", or why it cannot be told what is what in it.
std::string HistoryReader::misfit_of(const HistoryRow& row) const {
  const HistoryLife* const life = life_of(row);
  if (life == nullptr) return "nobody knows the life it is of";
  const bool fits = row.cells.size() == life->layout.cell_count() && row.sensors.size() == life->layout.sensor_count();
  return fits ? "" : "its cells are not those of its life";
}

void HistoryReader::for_each_row(const HistorySpan& span, const std::function<bool(const HistoryRow&)>& take) {
  read_rows(span, range_of(span), take);
}

void HistoryReader::for_each_row_after(std::int64_t sequence, const std::function<bool(const HistoryRow&)>& take) {
  Range range = range_of("minute");
  range.first = std::max(range.first, sequence + 1);
  read_rows({}, range, take);
}

void HistoryReader::read_rows(const HistorySpan& span, Range range,
                              const std::function<bool(const HistoryRow&)>& take) {
  scan("minute", select_minutes_sql(), range, [&](const Statement& statement, std::int64_t sequence) {
    HistoryRow row = numbers_of(statement);
    if (!span.has(row.unix_time_ms)) return true;
    std::string problem = add_arrays(statement, row);
    if (problem.empty()) problem = misfit_of(row);
    if (problem.empty()) return take(row);
    note_gap("minute", sequence, sequence, problem);
    return true;
  });
}

void HistoryReader::for_each_event(const HistorySpan& span, const std::function<bool(const HistoryEvent&)>& take) {
  scan("event", select_events_sql(), range_of("event"), [&](const Statement& statement, std::int64_t sequence) {
    HistoryEvent event;
    event.sequence = sequence;
    const int checksum = read_columns(statement, 1, event_columns(), event);
    if (!span.has(event.unix_time_ms)) return true;
    if (statement.number(checksum) == checksum_of(event)) return take(event);
    note_gap("event", sequence, sequence, "the checksum is wrong");
    return true;
  });
}

HistorySpan HistoryReader::covered() {
  const auto first = database_.number("SELECT min(unix_time_ms) FROM minute");
  const auto last = database_.number("SELECT max(unix_time_ms) FROM minute");
  HistorySpan span;
  if (first && *first) span.from_unix_ms = **first;
  if (last && *last) span.to_unix_ms = std::min(**last, history_number_max) + 1;
  return span;
}

void HistoryReader::note_gap(const std::string& table, std::int64_t first, std::int64_t last,
                             const std::string& reason) {
  const auto has_this = [&](const Gap& gap) {
    return gap.table == table && gap.reason == reason && gap.first <= first && last <= gap.last;
  };
  if (std::any_of(gaps_.begin(), gaps_.end(), has_this)) return;  // read for another time
  const bool goes_on =
      !gaps_.empty() && gaps_.back().table == table && gaps_.back().reason == reason && gaps_.back().last + 1 == first;
  if (goes_on) {
    gaps_.back().last = last;
  } else if (gaps_.size() < gaps_max) {
    gaps_.push_back({.table = table, .first = first, .last = last, .reason = reason});
  } else if (gaps_.size() == gaps_max) {
    gaps_.push_back({.table = table, .first = first, .last = sequence_max, .reason = "more of the like"});
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
