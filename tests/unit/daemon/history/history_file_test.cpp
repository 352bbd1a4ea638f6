// Database of the history: written rows are read back, excess rows are removed, damaged files are quarantined, and
// files of other applications are left unchanged.
#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "daemon/history/history_columns.hpp"
#include "daemon/history/history_schema.hpp"
#include "daemon/history/row_blob.hpp"
#include "tests/support/faulty_vfs.hpp"
#include "tests/support/history_rows.hpp"
#include "tests/support/sanitized.hpp"
#include "tests/support/temporary_folder.hpp"

namespace bmu {

using test::count;
using test::FaultyDisk;
using test::history_event;
using test::history_row;
using test::life_of;
using test::read_all;
using test::write_minutes;

namespace {

struct Files {
  TemporaryFolder folder;
  std::string path = folder / "history.sqlite";

  [[nodiscard]] std::vector<std::string> put_aside() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
      const std::string name = entry.path().string();
      const bool is_companion = name.ends_with("-wal") || name.ends_with("-shm");
      if (name.find(".damaged-") != std::string::npos && !is_companion) names.push_back(name);
    }
    return names;
  }
};

std::string bytes_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void write_bytes(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
}

void run_sql(const std::string& path, const std::string& sql) {
  sqlite3* database = nullptr;
  REQUIRE(sqlite3_open(path.c_str(), &database) == SQLITE_OK);
  REQUIRE(sqlite3_exec(database, sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK);
  sqlite3_close(database);
}

/// Numbers of the first row of a query, which may use views.
std::vector<std::int64_t> numbers(const std::string& path, const std::string& sql) {
  sqlite3* database = nullptr;
  sqlite3_stmt* statement = nullptr;
  REQUIRE(sqlite3_open(path.c_str(), &database) == SQLITE_OK);
  REQUIRE(sqlite3_prepare_v2(database, sql.c_str(), -1, &statement, nullptr) == SQLITE_OK);
  REQUIRE(sqlite3_step(statement) == SQLITE_ROW);
  std::vector<std::int64_t> row;
  for (int column = 0; column < sqlite3_column_count(statement); ++column) {
    row.push_back(sqlite3_column_type(statement, column) == SQLITE_NULL ? -1 : sqlite3_column_int64(statement, column));
  }
  sqlite3_finalize(statement);
  sqlite3_close(database);
  return row;
}

/// Creates a database with minutes 1 to `last`, and closes it.
void make_history(const std::string& path, std::int64_t last, std::size_t modules = 2) {
  const HistoryLife life = life_of(modules);
  HistoryFile file({.path = path}, life);
  write_minutes(file, life, 1, last);
}

/// Row as written by a daemon with the first schema; sequence and session are those of the database.
HistoryRow first_row(std::int64_t minute, const HistoryRow& written) {
  HistoryRow row = history_row(minute, life_of(2));
  for (const HistoryColumn<HistoryRow>& column : row_columns_of(2)) {
    if (column.number != nullptr) (row.*column.number).reset();
    if (column.text != nullptr) (row.*column.text).clear();
  }
  row.sequence = written.sequence;
  row.life = written.life;
  return row;
}

std::int64_t first_checksum(const HistoryRow& row, const std::string& cells, const std::string& sensors) {
  RowChecksum checksum;
  checksum.add(HistoryNumber(row.sequence));
  for (const HistoryColumn<HistoryRow>& column : row_columns_of(1)) {
    if (column.number != nullptr) checksum.add(row.*column.number);
    if (column.text != nullptr) checksum.add(row.*column.text);
  }
  checksum.add(cells);
  checksum.add(sensors);
  return checksum.value();
}

/// Creates a database of the first schema with minutes 1 to `last`, and closes it.
void make_first_history(const Files& files, std::int64_t last) {
  const std::string newer = files.folder / "newer.sqlite";
  make_history(newer, last);
  {
    const auto database = Database::open(files.path, OpenAs::writer);
    REQUIRE(database);
    REQUIRE(database->run("PRAGMA page_size = 8192"));
    REQUIRE(migrate(*database, history_steps(1)));
  }
  std::string columns = "sequence";
  for (const HistoryColumn<HistoryRow>& column : row_columns_of(1)) columns += ", " + std::string(column.name);
  columns += ", cells, sensors, checksum";
  std::string sql = "ATTACH '" + newer + "' AS newer;INSERT INTO main.minute (" + columns + ") SELECT " + columns +
                    " FROM newer.minute;";
  for (const char* table : {"event", "life", "layout", "place"}) {
    sql += std::string("INSERT INTO main.") + table + " SELECT * FROM newer." + table + ";";
  }
  for (std::int64_t minute = 1; minute <= last; ++minute) {
    HistoryRow row = history_row(minute, life_of(2));
    row.sequence = minute;
    row.life = 1;
    sql += "UPDATE main.minute SET checksum = " +
           std::to_string(first_checksum(row, blob_of(row.cells), blob_of(row.sensors))) +
           " WHERE sequence = " + std::to_string(minute) + ";";
  }
  run_sql(files.path, sql + "DETACH newer");
}

}  // namespace

TEST_CASE("rows and events are there again as they were written", "[unit][history][BMS_F.5]") {
  const Files files;
  const HistoryLife life = life_of(2);
  {
    HistoryFile file({.path = files.path}, life);
    write_minutes(file, life, 1, 3);
    write_minutes(file, life, 4, 5);
  }
  auto reader = HistoryReader::open(files.path);
  REQUIRE(reader);
  const auto all = read_all(*reader);
  CHECK(all.problems == std::vector<std::string>{});
  CHECK(all.minutes() == count(1, 5));
  for (const HistoryRow& row : all.rows) {
    HistoryRow wanted = history_row(row.sequence, life);
    wanted.sequence = row.sequence;
    wanted.life = 1;
    CHECK(row == wanted);
    REQUIRE(reader->life_of(row) != nullptr);
    CHECK(reader->life_of(row)->layout == life.layout);
    CHECK(reader->life_of(row)->pack_name == "test pack");
  }
  REQUIRE(all.events.size() == 5);
  HistoryEvent wanted = history_event(5);
  wanted.sequence = 5;
  wanted.life = 1;
  CHECK(all.events.back() == wanted);
  struct stat status {};
  REQUIRE(::stat(files.path.c_str(), &status) == 0);
  CHECK((status.st_mode & 0777U) == 0640U);
}

TEST_CASE("each life of the daemon goes on behind the one before", "[unit][history][BMS_F.5]") {
  const Files files;
  make_history(files.path, 3);
  const HistoryLife other = life_of(1, "two");
  HistoryFile file({.path = files.path}, other);
  write_minutes(file, other, 1, 2);
  const auto all = read_all(files.path);
  REQUIRE(all.minutes() == std::vector<std::int64_t>{1, 2, 3, 1, 2});
  CHECK(all.rows.back().sequence == 5);
  CHECK(all.rows.back().life == 2);
  CHECK(all.rows.back().cells.size() == 12);
  CHECK(all.rows.front().cells.size() == 24);
  CHECK(all.problems.empty());
}

TEST_CASE("what was written already is not written twice", "[unit][history]") {
  const Files files;
  const HistoryLife life = life_of(1);
  {
    HistoryFile file({.path = files.path}, life);
    write_minutes(file, life, 1, 3);
  }
  HistoryFile file({.path = files.path}, life);
  write_minutes(file, life, 2, 4);
  const auto all = read_all(files.path);
  CHECK(all.minutes() == count(1, 4));
  CHECK(all.events.size() == 4);
}

TEST_CASE("with SQL alone one finds each cell and sensor in the views", "[unit][history]") {
  const Files files;
  make_history(files.path, 2);
  CHECK(
      numbers(files.path,
              "SELECT module, place, voltage_average_uV, voltage_min_uV, voltage_max_uV, voltage_samples, soc_permille,"
              " health_by_capacity_permille, health_by_resistance_permille, bled_permille"
              " FROM cell_minute WHERE sequence = 2 AND number = 15") ==
      std::vector<std::int64_t>{2, 3, 3'314'200, 3'312'200, 3'316'200, 600, 2, 987, -1, 14});
  // Four cell sensors and four board sensors of module 1 precede those of module 2.
  CHECK(numbers(
            files.path,
            "SELECT module, place, temperature_average_dC, temperature_min_dC, temperature_samples FROM sensor_minute "
            "WHERE sequence = 1 AND number = 16 AND kind = 'board'") ==
        std::vector<std::int64_t>{2, 4, -50, -100, 599});
  CHECK(numbers(files.path, "SELECT count(*) FROM cell_minute") == std::vector<std::int64_t>{48});
  CHECK(numbers(files.path, "SELECT count(*) FROM sensor_minute") == std::vector<std::int64_t>{32});
}

TEST_CASE("a reader sees what is written meanwhile, and holds nobody up", "[unit][history]") {
  const Files files;
  const HistoryLife life = life_of(1);
  HistoryFile file({.path = files.path}, life);
  write_minutes(file, life, 1, 2);
  auto reader = HistoryReader::open(files.path);
  REQUIRE(reader);
  std::int64_t next = 3;
  std::size_t rows = 0;
  reader->for_each_row({}, [&](const HistoryRow&) {
    write_minutes(file, life, next, next);
    ++next;
    ++rows;
    return true;
  });
  CHECK(rows == 2);
  CHECK(read_all(*reader).minutes() == count(1, 4));
}

// --- retention ------------------------------------------------------------------------------------------------------

namespace {

/// Writes a minute and trims the file, as the store does.
void add_minute(HistoryFile& file, const HistoryLife& life, const HistoryRow& row) {
  REQUIRE(file.write({&row, 1}, {}));
  while (true) {
    const auto is_more = file.trim();
    REQUIRE(is_more);
    if (!*is_more) return;
  }
  static_cast<void>(life);
}

}  // namespace

TEST_CASE("beyond its size a history loses its oldest rows, and their room on the disk", "[unit][history]") {
  const Files files;
  const HistoryLife life = life_of(8);
  constexpr std::int64_t size_max_bytes = 6'000'000;
  HistoryFile file({.path = files.path, .size_max_bytes = size_max_bytes}, life);
  std::int64_t largest = 0;
  for (std::int64_t first = 1; first <= 3'900; first += 100) {
    write_minutes(file, life, first, first + 99);
    add_minute(file, life, history_row(first + 99, life));
    largest = std::max(largest, file.size_bytes());
  }
  CHECK(largest < size_max_bytes * 11 / 10);
  const auto all = read_all(files.path);
  CHECK(all.problems.empty());
  REQUIRE_FALSE(all.rows.empty());
  CHECK(all.rows.size() > 700);
  CHECK(all.minutes() == count(3'901 - static_cast<std::int64_t>(all.rows.size()), 3'900));
  // Events are removed together with their minutes.
  CHECK(all.events.front().number >= all.rows.front().uptime_ms.value_or(0) / test::minute_ms - 1);
}

TEST_CASE("a history keeps as many minutes as there are in its days", "[unit][history][BMS_F.5]") {
  const Files files;
  const HistoryLife life = life_of(1);
  HistoryFile file({.path = files.path, .keep_days = 1}, life);
  write_minutes(file, life, 1, 1'600);
  add_minute(file, life, history_row(1'601, life));
  CHECK(read_all(files.path).minutes() == count(1'601 - 1'439, 1'601));
}

TEST_CASE("by the clock the oldest rows go, ten for each that comes", "[unit][history][BMS_F.5]") {
  const Files files;
  const HistoryLife life = life_of(1);
  HistoryFile file({.path = files.path, .keep_days = 1}, life);
  write_minutes(file, life, 1, 100);
  // The daemon was down for a day; rows of another session follow, for an hour before the clock is trusted.
  HistoryFile later({.path = files.path, .keep_days = 1}, life_of(1, "two"));
  const auto add = [&](std::int64_t minute) {
    HistoryRow row = history_row(minute, life);
    *row.unix_time_ms += std::int64_t{2} * 86'400'000;
    add_minute(later, life, row);
  };
  for (std::int64_t minute = 1; minute <= 60; ++minute) add(minute);
  CHECK(read_all(files.path).rows.size() == 160);
  add(61);
  CHECK(read_all(files.path).rows.size() == 151);
  for (std::int64_t minute = 62; minute <= 70; ++minute) add(minute);
  CHECK(read_all(files.path).minutes() == count(1, 70));
}

TEST_CASE("a clock that jumps into the future and back costs no history", "[unit][history]") {
  const Files files;
  const HistoryLife life = life_of(1);
  HistoryFile file({.path = files.path, .keep_days = 1}, life);
  write_minutes(file, life, 1, 100);
  for (std::int64_t minute = 101; minute <= 150; ++minute) {
    HistoryRow row = history_row(minute, life);
    *row.unix_time_ms += std::int64_t{3'650} * 86'400'000;
    add_minute(file, life, row);
  }
  for (std::int64_t minute = 151; minute <= 300; ++minute) add_minute(file, life, history_row(minute, life));
  const auto all = read_all(files.path);
  CHECK(all.minutes() == count(1, 300));
  CHECK(all.problems.empty());
}

// --- not created yet ------------------------------------------------------------------------------------------------

namespace {

/// "" if it reads as a history without rows and without damage, otherwise the message to a user.
std::string fault_of_new(const std::string& path, HistoryAccess access = HistoryAccess::in_any_way) {
  auto reader = HistoryReader::open(path, access);
  if (!reader) return reader.error();
  const auto all = read_all(*reader);
  if (!all.problems.empty()) return all.problems.front();
  if (!all.rows.empty() || !all.events.empty()) return "it has rows";
  return reader->has_no_minute_yet() ? "" : "it is not new";
}

/// Connection with unfinished work.
class OtherConnection {
 public:
  OtherConnection(const std::string& path, const std::string& sql) {
    REQUIRE(sqlite3_open(path.c_str(), &database_) == SQLITE_OK);
    REQUIRE(sqlite3_exec(database_, sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK);
  }
  OtherConnection(const OtherConnection&) = delete;
  OtherConnection& operator=(const OtherConnection&) = delete;
  ~OtherConnection() { sqlite3_close(database_); }

 private:
  sqlite3* database_ = nullptr;
};

const std::string our_id = "PRAGMA application_id = " + std::to_string(history_application_id) + ";";
// More than its connection keeps in memory, so that pages are in the file before the transaction ends.
const std::string half_a_transaction =
    "PRAGMA cache_size = 1; BEGIN; CREATE TABLE minute (sequence INTEGER PRIMARY KEY, bytes BLOB);"
    "INSERT INTO minute VALUES (1, zeroblob(100000)); INSERT INTO minute VALUES (2, zeroblob(100000));";

}  // namespace

TEST_CASE("a history that is just being created has nothing recorded yet, and is no damage", "[unit][history]") {
  const Files files;
  SECTION("an empty file") {
    write_bytes(files.path, "");
    CHECK(fault_of_new(files.path) == "");
  }
  SECTION("a database without tables") {
    run_sql(files.path, "PRAGMA user_version = 1; PRAGMA user_version = 0");
    REQUIRE(std::filesystem::file_size(files.path) > 0);
    CHECK(fault_of_new(files.path) == "");
  }
  SECTION("one without tables that says whose it is") {
    run_sql(files.path, our_id);
    CHECK(fault_of_new(files.path) == "");
  }
  SECTION("one that its creator has locked before there is a table") {
    run_sql(files.path, our_id);
    const OtherConnection creator(files.path, "BEGIN EXCLUSIVE");
    CHECK(fault_of_new(files.path) == "");
    CHECK(fault_of_new(files.path, HistoryAccess::beside_writer) == "");
  }
  SECTION("tables that are not committed") {
    const OtherConnection creator(files.path, half_a_transaction);
    REQUIRE(std::filesystem::file_size(files.path) > history_page_bytes);
    CHECK(fault_of_new(files.path) == "");
    CHECK(fault_of_new(files.path, HistoryAccess::beside_writer) == "");
  }
  SECTION("what a creator left that was killed") {
    const OtherConnection creator(files.path, half_a_transaction);
    const Files left;
    for (const char* end : {"", "-journal"}) std::filesystem::copy(files.path + end, left.path + end);
    CHECK(fault_of_new(left.path) == "");
    CHECK(fault_of_new(left.path, HistoryAccess::beside_writer) == "");
    HistoryFile file({.path = left.path}, life_of(1));
    write_minutes(file, life_of(1), 1, 2);
    CHECK(left.put_aside().empty());
    CHECK(read_all(left.path).minutes() == count(1, 2));
  }
  SECTION("one that has its tables and no row") {
    HistoryFile file({.path = files.path}, life_of(1));
    REQUIRE(file.open());
    CHECK(fault_of_new(files.path) == "");
  }
}

TEST_CASE("a history with events alone has no minute yet, and knows how long one is", "[unit][history]") {
  const Files files;
  HistoryLife life = life_of(1);
  life.period_s = 20;
  HistoryFile file({.path = files.path}, life);
  const std::vector<HistoryEvent> events{history_event(1)};
  REQUIRE(file.write({}, events));
  auto reader = HistoryReader::open(files.path);
  REQUIRE(reader);
  CHECK(reader->has_no_minute_yet());
  CHECK(reader->period_s() == 20);
  CHECK(read_all(*reader).events.size() == 1);
  // The state determined at opening stays; the minute is read nevertheless.
  add_minute(file, life, history_row(1, life));
  CHECK(reader->has_no_minute_yet());
  CHECK(read_all(*reader).minutes() == count(1, 1));
  const auto later = HistoryReader::open(files.path);
  REQUIRE(later);
  CHECK_FALSE(later->has_no_minute_yet());
}

TEST_CASE("a damaged history without a minute that can be read does not pass for a new one", "[unit][history]") {
  const Files files;
  make_history(files.path, 1);
  run_sql(files.path, "DROP TABLE place; DELETE FROM minute");
  const auto reader = HistoryReader::open(files.path);
  REQUIRE(reader);
  CHECK_FALSE(reader->has_no_minute_yet());
}

TEST_CASE("between any two writes of its creation a history has nothing recorded yet", "[unit][history]") {
  FaultyDisk& disk = FaultyDisk::well();
  const Files files;
  std::vector<std::string> faults;
  int looks = 0;
  disk.before_each([&] {
    ++looks;
    if (const std::string fault = fault_of_new(files.path, HistoryAccess::beside_writer); !fault.empty()) {
      faults.push_back(fault);
    }
  });
  HistoryFile file({.path = files.path, .vfs = FaultyDisk::name}, life_of(1));
  const auto opened = file.open();
  disk.before_each(nullptr);
  REQUIRE(opened);
  CHECK(looks > 10);
  CHECK(faults == std::vector<std::string>{});
  write_minutes(file, life_of(1), 1, 2);
  CHECK(read_all(files.path).minutes() == count(1, 2));
}

TEST_CASE("what is no history passes for no new one", "[unit][history]") {
  const Files files;
  const auto refusal = [&] {
    const auto reader = HistoryReader::open(files.path);
    return reader ? "" : reader.error().substr(files.path.size() + 2);
  };
  SECTION("another program's database without tables") {
    run_sql(files.path, "PRAGMA application_id = 7");
    CHECK(refusal() == "not a history database of bmud");
  }
  SECTION("another program's tables, locked") {
    run_sql(files.path, "CREATE TABLE photos (name TEXT); INSERT INTO photos VALUES (zeroblob(20000))");
    const OtherConnection owner(files.path, "BEGIN EXCLUSIVE");
    CHECK(refusal() == "locked by another program, try again");
  }
  SECTION("a history whose first page says that it has no tables") {
    make_history(files.path, 3);
    std::string bytes = bytes_of(files.path);
    bytes[103] = bytes[104] = '\0';  // number of rows on the page
    write_bytes(files.path, bytes);
    const auto all = read_all(files.path);
    CHECK(all.minutes() == count(1, 3));
    CHECK_FALSE(all.problems.empty());
  }
}

// --- unexpected files -----------------------------------------------------------------------------------------------

TEST_CASE("a history of a newer version is left alone, and put nowhere", "[unit][history]") {
  const Files files;
  make_history(files.path, 3);
  run_sql(files.path, "ALTER TABLE minute ADD COLUMN humidity_permille INTEGER; PRAGMA user_version = 3");
  const std::string before = bytes_of(files.path);
  const HistoryLife life = life_of(2, "two");
  HistoryFile file({.path = files.path}, life);
  const auto opened = file.open();
  REQUIRE_FALSE(opened);
  CHECK(opened.error().trouble == HistoryTrouble::newer);
  CHECK(opened.error().what.find("newer bmud (schema 3, this one knows 2)") != std::string::npos);
  CHECK(bytes_of(files.path) == before);
  CHECK(files.put_aside().empty());
  const auto reader = HistoryReader::open(files.path);
  REQUIRE_FALSE(reader);
  CHECK(reader.error().find("newer bmud") != std::string::npos);
}

TEST_CASE("a history of the first schema is read as it is", "[unit][history][SOE_1][POW_1]") {
  const Files files;
  make_first_history(files, 5);
  const std::string before = bytes_of(files.path);
  const auto all = read_all(files.path);
  CHECK(all.minutes() == count(1, 5));
  CHECK(all.problems.empty());
  REQUIRE(all.rows.size() == 5);
  CHECK(all.rows[2] == first_row(3, all.rows[2]));
  CHECK(bytes_of(files.path) == before);
}

TEST_CASE("a history of the first schema is led to the second, and goes on", "[unit][history][SOE_1][POW_1]") {
  const Files files;
  make_first_history(files, 5);
  {
    HistoryFile file({.path = files.path}, life_of(2));
    write_minutes(file, life_of(2), 6, 8);
  }
  CHECK(files.put_aside().empty());
  {
    const auto database = Database::open(files.path, OpenAs::reader);
    REQUIRE(database);
    CHECK(database->number("PRAGMA user_version").value_or(0) == 2);
    CHECK(version_by_tables(*database).value_or(0) == 2);
  }
  const auto all = read_all(files.path);
  CHECK(all.minutes() == count(1, 8));
  CHECK(all.problems.empty());
  REQUIRE(all.rows.size() == 8);
  CHECK_FALSE(all.rows[4].energy_left_mWh.has_value());
  CHECK(all.rows[4].discharge_power_cause.empty());
  CHECK(all.rows[5].energy_left_mWh == 4'199'994);
  CHECK(all.rows[5].energy_left_sigma_mWh == 90'000);
  CHECK(all.rows[5].discharge_power_W == 28'000);
  CHECK(all.rows[5].discharge_power_cause == "continuous");
}

TEST_CASE("rows of both schemas are found page by page", "[unit][history][SOE_1]") {
  const Files files;
  make_first_history(files, 5);
  {
    HistoryFile file({.path = files.path}, life_of(2));
    write_minutes(file, life_of(2), 6, 8);
  }
  std::string bytes = bytes_of(files.path);
  std::fill_n(bytes.begin(), 100, '\0');  // the rows are no longer referenced
  write_bytes(files.path, bytes);
  const auto all = read_all(files.path);
  CHECK(all.minutes() == count(1, 8));
  REQUIRE(all.rows.size() == 8);
  CHECK_FALSE(all.rows[4].energy_left_mWh.has_value());
  CHECK(all.rows[5].energy_left_mWh == 4'199'994);
}

TEST_CASE("a version that is not that of the tables is damage, whichever the tables are", "[unit][history][SOE_1]") {
  const auto trouble = [](const Files& files) {
    HistoryFile file({.path = files.path}, life_of(2));
    const auto opened = file.open();
    return opened ? std::string("none") : opened.error().what;
  };
  SECTION("of the first") {
    const Files files;
    make_first_history(files, 3);
    run_sql(files.path, "PRAGMA user_version = 9");
    CHECK(trouble(files).find("has schema 9 by its beginning, and schema 1 by its tables") != std::string::npos);
    CHECK(read_all(files.path).minutes() == count(1, 3));
  }
  SECTION("of the second") {
    const Files files;
    make_history(files.path, 3);
    run_sql(files.path, "PRAGMA user_version = 1");
    CHECK(trouble(files).find("has schema 1 by its beginning, and schema 2 by its tables") != std::string::npos);
    CHECK(read_all(files.path).minutes() == count(1, 3));
  }
}

TEST_CASE("another program's database, a folder and a device are left alone", "[unit][history]") {
  const Files files;
  run_sql(files.path, "CREATE TABLE photos (id INTEGER PRIMARY KEY); PRAGMA user_version = 1");
  const std::string before = bytes_of(files.path);
  const auto trouble_at = [](const std::string& path) {
    HistoryFile file({.path = path}, life_of(1));
    const auto opened = file.open();
    return opened ? HistoryTrouble::busy : opened.error().trouble;
  };
  CHECK(trouble_at(files.path) == HistoryTrouble::foreign);
  CHECK(bytes_of(files.path) == before);
  const std::string empty = files.folder / "empty.sqlite";
  run_sql(empty, "PRAGMA application_id = 7");  // without tables, but of another application
  CHECK(trouble_at(empty) == HistoryTrouble::foreign);
  CHECK(trouble_at(files.folder.path().string()) == HistoryTrouble::foreign);
  CHECK(trouble_at("/dev/null") == HistoryTrouble::foreign);
  CHECK(trouble_at(files.folder / "not/there/history.sqlite") == HistoryTrouble::refused);
  CHECK_FALSE(HistoryReader::open(files.path).has_value());
  CHECK_FALSE(HistoryReader::open("/dev/null").has_value());
  const auto of_folder = HistoryReader::open(files.folder.path().string());
  REQUIRE_FALSE(of_folder);
  CHECK(of_folder.error().ends_with(": is a directory, the history is a file"));
  CHECK_FALSE(HistoryReader::open(files.folder / "nothing.sqlite").has_value());
}

TEST_CASE("a schema is led through its steps, each as a whole or not at all", "[unit][history]") {
  constexpr std::array steps{
      SchemaStep{1, [] { return std::string("CREATE TABLE one (a INTEGER); INSERT INTO one VALUES (41)"); }},
      SchemaStep{2, [] { return std::string("ALTER TABLE one ADD COLUMN b INTEGER; UPDATE one SET b = a + 1"); }},
      SchemaStep{3, [] { return std::string("CREATE TABLE two (c INTEGER); CREATE TABLE one (a INTEGER)"); }}};
  const Files files;
  const auto database = Database::open(files.path, OpenAs::writer);
  REQUIRE(database);
  REQUIRE(migrate(*database, std::span(steps).first(1)));
  CHECK(has_schema(*database, std::span(steps).first(1)).value_or(false));
  CHECK_FALSE(has_schema(*database, std::span(steps).first(2)).value_or(true));
  REQUIRE(migrate(*database, std::span(steps).first(2)));
  CHECK(database->number("PRAGMA user_version").value_or(0) == 2);
  CHECK(database->number("SELECT b FROM one").value_or(0) == 42);
  CHECK(has_schema(*database, std::span(steps).first(2)).value_or(false));
  // The third step fails in its second half: nothing of it remains.
  CHECK_FALSE(migrate(*database, steps).has_value());
  CHECK_FALSE(database->is_in_transaction());
  CHECK(database->number("PRAGMA user_version").value_or(0) == 2);
  CHECK(database->number("SELECT count(*) FROM sqlite_schema WHERE name = 'two'").value_or(-1) == 0);
  REQUIRE(migrate(*database, std::span(steps).first(2)));  // nothing left to do
}

TEST_CASE("a database whose tables are others is put aside, and a new one begun", "[unit][history]") {
  const Files files;
  make_history(files.path, 3);
  run_sql(files.path, "ALTER TABLE minute RENAME COLUMN soc_permille TO charge");
  const std::string before = bytes_of(files.path);
  const HistoryLife life = life_of(2, "two");
  HistoryFile file({.path = files.path}, life);
  const auto opened = file.open();
  REQUIRE_FALSE(opened);
  CHECK(opened.error().trouble == HistoryTrouble::damaged);
  const auto name = file.put_aside();
  REQUIRE(name);
  CHECK(bytes_of(*name) == before);
  write_minutes(file, life, 1, 2);
  CHECK(read_all(files.path).minutes() == count(1, 2));
}

TEST_CASE("a hostile database is no trap: its views and triggers are not run, its numbers not counted on",
          "[unit][history]") {
  const Files files;
  make_history(files.path, 3);
  const std::string good = bytes_of(files.path);
  const auto make = [&](const std::string& sql) {
    for (const char* end : {"", "-wal", "-shm"}) std::filesystem::remove(files.path + end);
    write_bytes(files.path, good);
    run_sql(files.path, sql);
  };
  SECTION("a view without an end in the place of the rows") {
    make(
        "ALTER TABLE minute RENAME TO hidden;"
        "CREATE VIEW minute AS WITH RECURSIVE n(sequence) AS (SELECT 1 UNION ALL SELECT sequence + 1 FROM n) "
        "SELECT * FROM n");
    // The rows are found page by page, whatever their table is called.
    const auto all = read_all(files.path);
    CHECK(all.minutes() == count(1, 3));
    CHECK(all.problems == std::vector<std::string>{files.path + " is damaged at its beginning: what of it can be read "
                                                                "follows"});
    HistoryFile file({.path = files.path}, life_of(2, "two"));
    CHECK_FALSE(file.open().has_value());
  }
  SECTION("a trigger on each new row") {
    make("CREATE TRIGGER trap AFTER INSERT ON minute BEGIN DELETE FROM minute; END");
    const HistoryLife life = life_of(2, "two");
    HistoryFile file({.path = files.path}, life);
    write_minutes(file, life, 1, 1);
    CHECK(read_all(files.path).rows.size() == 4);
  }
  SECTION("a row that uses all numbers up") {
    make("UPDATE minute SET sequence = 9223372036854775807 WHERE sequence = 3");
    HistoryFile file({.path = files.path}, life_of(2, "two"));
    const HistoryRow row = history_row(1, life_of(2));
    const auto written = file.write({&row, 1}, {});
    REQUIRE_FALSE(written);
    CHECK(written.error().trouble == HistoryTrouble::damaged);
    const auto all = read_all(files.path);
    CHECK(all.minutes() == count(1, 2));
    CHECK(all.problems.size() == 1);
  }
  SECTION("cells that are too many, too few, or no bytes at all") {
    make(
        "UPDATE minute SET cells = zeroblob(16000) WHERE sequence = 1;"
        "UPDATE minute SET cells = 'words' WHERE sequence = 2;"
        "UPDATE minute SET cells = NULL, life = 77 WHERE sequence = 3");
    const auto all = read_all(files.path);
    CHECK(all.rows.empty());
    REQUIRE(all.problems.size() == 1);
    CHECK(all.problems[0] == "minute 1 to 3: checksum mismatch");
    CHECK(all.events.size() == 3);
  }
  SECTION("a life whose layout is made up, in both places") {
    make("UPDATE layout SET modules = '1:12+4+4 999:12+4+4'; UPDATE place SET module = 999 WHERE module = 2");
    auto reader = HistoryReader::open(files.path);
    REQUIRE(reader);
    const auto all = read_all(*reader);
    CHECK(all.minutes() == count(1, 3));
    CHECK(reader->life_of(all.rows[0])->layout.modules.size() == 1);
    CHECK(all.problems == std::vector<std::string>{
                              "layout 1: makes no sense", "life 1: its layout cannot be read",
                              "life 1: which cell sits where cannot be read; they are counted through, 0.1 to 0.24"});
  }
  SECTION("lives that are gone from tables that are whole") {
    make("DELETE FROM life; DELETE FROM layout; DELETE FROM place; UPDATE minute SET life = 8 WHERE sequence = 2");
    const auto all = read_all(files.path);
    CHECK(all.rows.empty());
    CHECK(all.problems == std::vector<std::string>{"minute 1: session unknown", "minute 2: checksum mismatch",
                                                   "minute 3: session unknown"});
  }
}

// --- damaged --------------------------------------------------------------------------------------------------------

TEST_CASE("cut short anywhere, a history is read as far as it goes, and the rest is named", "[unit][history]") {
  const Files files;
  make_history(files.path, 40);
  const std::string good = bytes_of(files.path);
  std::size_t most = 0;
  std::size_t read_some = 0;
  // A file cut to nothing cannot be distinguished from a new one.
  for (std::size_t size = 1'777; size < good.size(); size += 1'777) {
    INFO("size " << size);
    write_bytes(files.path, good.substr(0, size));
    auto reader = HistoryReader::open(files.path);
    if (!reader) continue;
    const auto all = read_all(*reader);
    CHECK_FALSE(all.problems.empty());
    CHECK(all.rows.size() >= most);  // a longer file never yields fewer rows
    most = std::max(most, all.rows.size());
    if (!all.rows.empty()) ++read_some;
    const auto minutes = all.minutes();
    CHECK(std::is_sorted(minutes.begin(), minutes.end()));
  }
  CHECK(most >= 30);
  CHECK(read_some > 10);
}

TEST_CASE("with any page spoiled, no wrong row is told, and good ones still are", "[unit][history]") {
  const Files files;
  const HistoryLife life = life_of(2);
  make_history(files.path, 40);
  const std::string good = bytes_of(files.path);
  constexpr std::size_t page = 8'192;
  std::size_t readable = 0;
  for (std::size_t begin = 0; begin < good.size(); begin += page) {
    for (const char filling : {'\0', '\xFF', 'x'}) {
      INFO("page " << begin / page << " filled with " << static_cast<int>(filling));
      std::string bytes = good;
      std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(begin), page, filling);
      write_bytes(files.path, bytes);
      auto reader = HistoryReader::open(files.path);
      INFO((reader ? "" : reader.error()));
      REQUIRE(reader);
      ++readable;
      const auto all = read_all(*reader);
      // Missing rows are always reported.
      CHECK((all.rows.size() == 40 || !all.problems.empty()));
      for (const HistoryRow& row : all.rows) {
        HistoryRow wanted = history_row(row.sequence, life);
        wanted.sequence = row.sequence;
        wanted.life = 1;
        REQUIRE(row == wanted);
      }
    }
  }
  CHECK(readable > 20);
}

TEST_CASE("where only what leads to the rows, or stands beside them, is damaged no row is lost", "[unit][history]") {
  const Files files;
  const HistoryLife life = life_of(2);
  make_history(files.path, 40);
  const std::string good = bytes_of(files.path);
  const auto spoil = [&](const std::vector<std::string>& tables) {
    std::string bytes = good;
    write_bytes(files.path, good);
    constexpr std::size_t page = 8'192;
    for (const std::string& table : tables) {
      const std::int64_t root =
          numbers(files.path, "SELECT rootpage FROM sqlite_schema WHERE name = '" + table + "'").at(0);
      std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(root - 1) * page), page, '\0');
    }
    write_bytes(files.path, bytes);
    auto reader = HistoryReader::open(files.path);
    REQUIRE(reader);
    const auto all = read_all(*reader);
    CHECK(all.minutes() == count(1, 40));
    // All events are on the one page.
    const bool has_events = std::find(tables.begin(), tables.end(), "event") == tables.end();
    CHECK(all.events.size() == (has_events ? 40 : 0));
    CHECK_FALSE(all.problems.empty());
    for (const std::string& problem : all.problems) CHECK(problem.find("minute 0") == std::string::npos);
    for (const HistoryRow& row : all.rows) CHECK(row.cells == history_row(row.sequence, life).cells);
    return *reader->life_of(all.rows.at(0));
  };
  // The content missing in one table is taken from the other.
  CHECK(spoil({"layout"}).layout == life.layout);
  const HistoryLife without_life = spoil({"life"});
  CHECK(without_life.layout == life.layout);
  CHECK(without_life.version == "?");
  CHECK(without_life.period_s == 60);
  CHECK(spoil({"layout", "life"}).layout == life.layout);
  const HistoryLife counted_through = spoil({"layout", "place"});
  CHECK(counted_through.pack_name == "test pack");
  CHECK(counted_through.layout.modules.size() == 1);
  CHECK(counted_through.layout.cell_count() == 24);
  CHECK(spoil({"layout", "place", "life"}).layout == counted_through.layout);
  // Root page of all rows: the rows are found without it.
  CHECK(spoil({"minute"}).layout == life.layout);
  CHECK(spoil({"minute", "minute_by_time"}).layout == life.layout);
  CHECK(spoil({"minute", "event", "layout", "place", "life"}).layout == counted_through.layout);
}

namespace {

constexpr std::size_t header_bytes = 100;
constexpr std::size_t first_page_bytes = 8'192;
/// Tests every 8th with a sanitizer, all without one: each of 3200 databases takes 30 ms there.
constexpr unsigned one_of = test::is_sanitized ? 8 : 1;

std::string damaged_at_its_beginning(const std::string& path) {
  return path + " is damaged at its beginning: what of it can be read follows";
}

/// Checks all rows to the last cell, and that they are of the right pack.
void check_rows(HistoryReader& reader, const test::ReadHistory& all, std::int64_t last, const HistoryLife& life) {
  REQUIRE(all.minutes() == count(1, last));
  CHECK(all.events.size() == static_cast<std::size_t>(last));
  for (const HistoryRow& row : all.rows) {
    HistoryRow wanted = history_row(row.sequence, life);
    wanted.sequence = row.sequence;
    wanted.life = 1;
    REQUIRE(row == wanted);
  }
  CHECK(reader.life_of(all.rows[0])->layout == life.layout);
  CHECK(reader.life_of(all.rows[0])->pack_name == life.pack_name);
}

}  // namespace

TEST_CASE("a flipped bit at the beginning of a history costs no row", "[unit][history]") {
  const Files files;
  make_history(files.path, 20);
  const std::string good = bytes_of(files.path);
  std::set<std::size_t> told;
  for (std::size_t at = 0; at < header_bytes; ++at) {
    for (unsigned bit = at % one_of; bit < 8; bit += one_of) {
      INFO("byte " << at << ", bit " << bit);
      std::string bytes = good;
      bytes[at] = static_cast<char>(static_cast<unsigned char>(bytes[at]) ^ (1U << bit));
      write_bytes(files.path, bytes);
      auto reader = HistoryReader::open(files.path);
      INFO((reader ? "" : reader.error()));
      REQUIRE(reader);
      const auto all = read_all(*reader);
      check_rows(*reader, all, 20, life_of(2));
      const auto& problems = all.problems;
      const bool is_told =
          std::find(problems.begin(), problems.end(), damaged_at_its_beginning(files.path)) != problems.end();
      if (is_told) told.insert(at);
      REQUIRE(bytes_of(files.path) == bytes);
    }
  }
  // Reported bytes: "SQLite format 3", the page size, the format's number and fractions, the schema's format, the
  // schema's version.
  for (std::size_t at = 0; at < header_bytes; ++at) {
    INFO("byte " << at);
    const bool matters = at < 18 || at == 19 || (at >= 21 && at < 24) || (at >= 60 && at < 64);
    if (matters) CHECK(told.count(at) == 1);
  }
}

TEST_CASE("a flipped bit where a history names its tables costs nothing without a word", "[unit][history]") {
  const Files files;
  make_history(files.path, 20);
  const std::string good = bytes_of(files.path);
  std::size_t tried = 0;
  std::size_t whole = 0;
  for (std::size_t at = header_bytes; at < first_page_bytes; at += std::size_t{7} * one_of) {
    INFO("byte " << at);
    std::string bytes = good;
    bytes[at] = static_cast<char>(bytes[at] ^ (1 << at % 7));
    write_bytes(files.path, bytes);
    auto reader = HistoryReader::open(files.path);
    INFO((reader ? "" : reader.error()));
    REQUIRE(reader);
    const auto all = read_all(*reader);
    if (all.rows.size() == 20 && all.events.size() == 20) ++whole;
    CHECK((all.rows.size() == 20 || !all.problems.empty()));
    CHECK((all.events.size() == 20 || !all.problems.empty()));
    ++tried;
  }
  // Losses are caused only by the few bits that hold the root page of a table, or the name of a column of the events.
  CHECK(whole * 10 > tried * 9);
}

TEST_CASE("with its beginning gone a history is read page by page, as far as its pages hold rows", "[unit][history]") {
  const Files files;
  const std::size_t modules = GENERATE(2U, 40U);  // the rows of 40 modules are longer than a page
  const HistoryLife life = life_of(modules);
  make_history(files.path, 20, modules);
  const std::string good = bytes_of(files.path);
  struct Damage {
    std::size_t begin;
    std::size_t end;
    char filling;
  };
  const auto damage = GENERATE(Damage{0, 16, '\0'}, Damage{0, header_bytes, '\0'}, Damage{0, 4'096, '\0'},
                               Damage{0, first_page_bytes, '\0'}, Damage{0, first_page_bytes, 'x'},
                               Damage{16, 20, '\xFF'}, Damage{18, 20, '\1'}, Damage{100, 4'096, '\0'});
  INFO(modules << " modules, bytes " << damage.begin << " to " << damage.end);
  std::string bytes = good;
  std::fill(bytes.begin() + static_cast<std::ptrdiff_t>(damage.begin),
            bytes.begin() + static_cast<std::ptrdiff_t>(damage.end), damage.filling);
  // Its size is not a whole number of pages either.
  write_bytes(files.path, bytes + std::string(777, '\0'));
  auto reader = HistoryReader::open(files.path);
  INFO((reader ? "" : reader.error()));
  REQUIRE(reader);
  const auto all = read_all(*reader);
  check_rows(*reader, all, 20, life);
  CHECK(all.problems.size() == 1);
  const HistorySpan covered = reader->covered();
  CHECK(covered.from_unix_ms == all.rows.front().unix_time_ms);
  CHECK(covered.to_unix_ms == *all.rows.back().unix_time_ms + 1);
  // Time ranges of it are found as in an intact one.
  const HistorySpan span{.from_unix_ms = all.rows[5].unix_time_ms, .to_unix_ms = all.rows[9].unix_time_ms};
  CHECK(read_all(*reader, span).minutes() == count(6, 9));
  std::size_t after = 0;
  reader->for_each_row_after(15, [&](const HistoryRow&) { return ++after > 0; });
  CHECK(after == 5);
  CHECK(bytes_of(files.path) == bytes + std::string(777, '\0'));
  // SQLite creates its own files beside a file that it accepts as a database.
  const bool is_none = damage.begin < header_bytes;
  if (is_none) CHECK(std::distance(std::filesystem::directory_iterator(files.folder.path()), {}) == 1);
}

TEST_CASE("what is missing of a history without its beginning is named", "[unit][history]") {
  const Files files;
  make_history(files.path, 40);
  std::string bytes = bytes_of(files.path);
  std::fill_n(bytes.begin(), header_bytes, '\0');
  const std::size_t at = bytes.find(blob_of(history_row(20, life_of(2)).cells));
  REQUIRE(at != std::string::npos);
  bytes[at + 100] = static_cast<char>(bytes[at + 100] ^ 4);
  write_bytes(files.path, bytes);
  write_bytes(files.path + "-wal", "what nobody wrote");
  const auto all = read_all(files.path);
  CHECK(all.rows.size() == 39);
  CHECK(all.problems == std::vector<std::string>{damaged_at_its_beginning(files.path), files.path + "-wal not read",
                                                 "minute 20: not found"});
}

TEST_CASE("only whole rows make a history of a file that nothing leads into", "[unit][history]") {
  const Files files;
  const auto refusal = [&](const std::string& bytes) {
    write_bytes(files.path, bytes);
    const auto reader = HistoryReader::open(files.path);
    return reader ? "" : reader.error().substr(files.path.size() + 2);
  };
  const std::string is_none = "not a history database, or its header is damaged";
  CHECK(refusal(std::string(30'000, 'x')) == is_none);
  CHECK(refusal("a shopping list\n") == is_none);
  std::string noise;
  std::uint32_t state = 1;
  for (std::size_t index = 0; index < 100 * first_page_bytes; ++index) {
    state = state * 1'664'525 + 1'013'904'223;
    // Each page claims to hold rows.
    noise += index % first_page_bytes == 0 ? '\x0D' : static_cast<char>(state >> 24U);
  }
  CHECK(refusal(noise) == is_none);
  CHECK(refusal("SQLite format 3" + noise) == is_none);
  std::filesystem::remove(files.path);
  run_sql(files.path, "CREATE TABLE photos (id INTEGER PRIMARY KEY, name TEXT); INSERT INTO photos VALUES (1, 'sea')");
  const std::string other = bytes_of(files.path);
  CHECK(refusal(other) == "not a history database of bmud");
  CHECK(refusal(std::string(16, '\0') + other.substr(16)) == is_none);
  // A history with invalid rows only.
  std::filesystem::remove(files.path);
  make_history(files.path, 3);
  run_sql(files.path, "UPDATE minute SET life = 7; UPDATE event SET life = 7");
  CHECK(refusal(std::string(16, '\0') + bytes_of(files.path).substr(16)) == is_none);
}

TEST_CASE("no number at the beginning of a hostile history leads anywhere", "[unit][history]") {
  const Files files;
  make_history(files.path, 20);
  const std::string good = bytes_of(files.path);
  constexpr unsigned one_of_these = test::is_sanitized ? 7 : 1;  // each of the twelve at a byte is covered
  unsigned number = 0;
  for (std::size_t at = 16; at < header_bytes + 20; ++at) {
    for (const std::string& filling : {std::string(4, '\0'), std::string(4, '\xFF'), std::string("\0\1\x7F\xFF", 4)}) {
      for (const std::size_t size : {good.size(), good.size() - 1, std::size_t{9'000}, std::size_t{511}}) {
        if (number++ % one_of_these != 0) continue;
        INFO("byte " << at << ", size " << size);
        std::string bytes = good.substr(0, size);
        bytes.replace(at, 4, filling);
        write_bytes(files.path, bytes);
        auto reader = HistoryReader::open(files.path);
        if (size == good.size()) REQUIRE(reader);
        if (!reader) continue;
        const auto all = read_all(*reader);
        for (const HistoryRow& row : all.rows) REQUIRE(row.cells == history_row(row.sequence, life_of(2)).cells);
        if (size == good.size()) CHECK(all.minutes() == count(1, 20));
      }
    }
  }
}

TEST_CASE("who reads a damaged history beside its writer leaves the writer its lock", "[unit][history]") {
  const Files files;
  make_history(files.path, 40);
  std::string bytes = bytes_of(files.path);
  const std::size_t at = bytes.find(blob_of(history_row(20, life_of(2)).cells));
  REQUIRE(at != std::string::npos);
  const std::size_t page_begin = at / first_page_bytes * first_page_bytes;
  std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(page_begin), first_page_bytes, '\0');
  write_bytes(files.path, bytes);
  const HistoryLife life = life_of(2, "two");
  HistoryFile file({.path = files.path}, life);
  write_minutes(file, life, 1, 1);
  {
    auto reader = HistoryReader::open(files.path, HistoryAccess::beside_writer);
    REQUIRE(reader);
    const auto all = read_all(*reader);
    CHECK(all.rows.size() > 20);
    CHECK_FALSE(all.problems.empty());
  }
  const int other = ::open(files.path.c_str(), O_RDONLY | O_CLOEXEC);
  struct flock lock {};
  lock.l_type = F_WRLCK;
  lock.l_start = 0x40000002;
  lock.l_len = 510;
  REQUIRE(::fcntl(other, F_OFD_GETLK, &lock) == 0);
  ::close(other);
  CHECK(lock.l_type == F_RDLCK);
}

TEST_CASE("a history with a flipped bit at its beginning is put aside, not left unwritten for ever",
          "[unit][history]") {
  const Files files;
  make_history(files.path, 3);
  const std::string good = bytes_of(files.path);
  // The schema's version, up, down and below zero; the format of the schema, and of the file; the page size.
  const auto [at, flipped] = GENERATE(std::pair{63U, 0x10U}, std::pair{63U, 0x01U}, std::pair{60U, 0x80U},
                                      std::pair{47U, 0x10U}, std::pair{18U, 0x10U}, std::pair{16U, 0x10U});
  INFO("byte " << at);
  std::string bytes = good;
  bytes[at] = static_cast<char>(static_cast<unsigned char>(bytes[at]) ^ flipped);
  write_bytes(files.path, bytes);
  const HistoryLife life = life_of(2, "two");
  HistoryFile file({.path = files.path}, life);
  const auto opened = file.open();
  REQUIRE_FALSE(opened);
  CHECK(opened.error().trouble == HistoryTrouble::damaged);
  CHECK(bytes_of(files.path) == bytes);
  const auto name = file.put_aside();
  REQUIRE(name);
  CHECK(bytes_of(*name) == bytes);
  CHECK(read_all(*name).minutes() == count(1, 3));
  write_minutes(file, life, 1, 2);
  CHECK(read_all(files.path).minutes() == count(1, 2));
}

TEST_CASE("where no file can be made beside it a history is read with all that was committed", "[unit][history]") {
  const Files files;
  const Files copy;
  {
    const HistoryLife life = life_of(2);
    HistoryFile file({.path = files.path}, life);
    write_minutes(file, life, 1, 20);
    // Files as left by a killed daemon; the shared file of the readers cannot be created any more, as on a full disk.
    for (const char* end : {"", "-wal"}) std::filesystem::copy_file(files.path + end, copy.path + end);
  }
  REQUIRE(std::filesystem::file_size(copy.path + "-wal") > 0);
  std::filesystem::create_symlink("nowhere", copy.path + "-shm");  // SQLite does not follow a link there
  const std::string database = bytes_of(copy.path);
  const std::string log = bytes_of(copy.path + "-wal");
  {
    auto reader = HistoryReader::open(copy.path);
    REQUIRE(reader);
    const auto all = read_all(*reader);
    CHECK(all.minutes() == count(1, 20));
    CHECK(all.problems.empty());
  }
  CHECK(bytes_of(copy.path) == database);
  CHECK(bytes_of(copy.path + "-wal") == log);
  // Another process has it open: the content of the log may change while it is read.
  const int held = ::open(copy.path.c_str(), O_RDONLY | O_CLOEXEC);
  struct flock lock {};
  lock.l_type = F_RDLCK;
  lock.l_start = 0x40000002;
  lock.l_len = 510;
  REQUIRE(::fcntl(held, F_OFD_SETLK, &lock) == 0);
  auto reader = HistoryReader::open(copy.path);
  ::close(held);
  // Then only the content of the database itself is read, if it is a history at all without its log.
  const std::string told = reader ? test::read_all(*reader).problems.at(0) : reader.error();
  CHECK(told.find(reader ? "history.sqlite-wal unreadable, latest rows missing: " : "history.sqlite: ") !=
        std::string::npos);
  // Without a log and without another process it is read as it is.
  make_history(files.path, 30);
  REQUIRE_FALSE(std::filesystem::exists(files.path + "-wal"));
  std::filesystem::remove(files.path + "-shm");
  std::filesystem::create_symlink("nowhere", files.path + "-shm");
  auto closed = HistoryReader::open(files.path);
  REQUIRE(closed);
  CHECK(read_all(*closed).problems.empty());
}

TEST_CASE("a flipped bit spoils the row that it is in, and no other", "[unit][history]") {
  const Files files;
  make_history(files.path, 40);
  const std::string good = bytes_of(files.path);
  // In the cells of row 20: their bytes are stored in the file unchanged.
  const std::string cells = blob_of(history_row(20, life_of(2)).cells);
  const std::size_t at = good.find(cells);
  REQUIRE(at != std::string::npos);
  std::string bytes = good;
  bytes[at + 100] = static_cast<char>(bytes[at + 100] ^ 4);
  write_bytes(files.path, bytes);
  auto reader = HistoryReader::open(files.path);
  REQUIRE(reader);
  CHECK(read_all(*reader).rows.size() == 39);
  const auto again = read_all(*reader);
  CHECK(again.rows.size() == 39);
  CHECK(again.problems == std::vector<std::string>{"minute 20: checksum mismatch"});  // not reported twice
}

TEST_CASE("a damaged history is put aside as it is, and a new one begun, after five nothing is written",
          "[unit][history]") {
  const Files files;
  const HistoryLife life = life_of(1);
  for (int number = 1; number <= HistoryFile::aside_max; ++number) {
    const std::string spoiled = std::string(20'000, 'x') + std::to_string(number);
    write_bytes(files.path, spoiled);
    HistoryFile file({.path = files.path}, life);
    const auto opened = file.open();
    REQUIRE_FALSE(opened);
    CHECK(opened.error().trouble == HistoryTrouble::damaged);
    CHECK(bytes_of(files.path) == spoiled);
    const auto name = file.put_aside();
    REQUIRE(name);
    CHECK(bytes_of(*name) == spoiled);
    CHECK(files.put_aside().size() == static_cast<std::size_t>(number));
    REQUIRE(file.open());
    file.close();
    std::filesystem::remove(files.path);
  }
  write_bytes(files.path, std::string(20'000, 'x'));
  HistoryFile file({.path = files.path}, life);
  REQUIRE_FALSE(file.open());
  const auto name = file.put_aside();
  REQUIRE_FALSE(name);
  CHECK(name.error().what.find("damaged like the 5 quarantined ones before") != std::string::npos);
  CHECK(bytes_of(files.path) == std::string(20'000, 'x'));
}

TEST_CASE("a database that is removed or exchanged while it is open is begun anew", "[unit][history]") {
  const Files files;
  const HistoryLife life = life_of(1);
  HistoryFile file({.path = files.path}, life);
  write_minutes(file, life, 1, 2);
  for (const char* end : {"", "-wal", "-shm"}) std::filesystem::remove(files.path + end);
  write_minutes(file, life, 3, 4);
  CHECK(read_all(files.path).minutes() == count(3, 4));
  std::filesystem::rename(files.path, files.path + ".elsewhere");
  for (const char* end : {"-wal", "-shm"}) std::filesystem::remove(files.path + end);
  write_minutes(file, life, 5, 5);
  CHECK(read_all(files.path).minutes() == count(5, 5));
}

// --- the disk -------------------------------------------------------------------------------------------------------

TEST_CASE("whichever write or sync fails, what was there stays, and the row comes in later", "[unit][history]") {
  const HistoryLife life = life_of(1);
  int failed = 0;
  for (const int kind : {0, 1, 2}) {
    for (int nth = 1; nth <= 12; ++nth) {
      INFO("kind " << kind << ", the " << nth << "th fails");
      FaultyDisk& disk = FaultyDisk::well();
      const Files files;
      HistoryFile file({.path = files.path, .vfs = FaultyDisk::name}, life);
      write_minutes(file, life, 1, 2);
      if (kind == 0) disk.fail_writes(nth, SQLITE_FULL);
      if (kind == 1) disk.fail_writes(nth, SQLITE_IOERR_WRITE);
      if (kind == 2) disk.fail_syncs(nth);
      const std::vector<HistoryRow> rows{history_row(3, life)};
      const std::vector<HistoryEvent> events{history_event(3)};
      const auto written = file.write(rows, events);
      if (!written) {
        ++failed;
        CHECK(written.error().trouble == (kind == 0 ? HistoryTrouble::full : HistoryTrouble::refused));
      }
      disk.heal();
      write_minutes(file, life, 3, 4);
      const auto all = read_all(files.path);
      CHECK(all.minutes() == count(1, 4));
      CHECK(all.events.size() == 4);
      CHECK(all.problems.empty());
    }
  }
  CHECK(failed >= 3);
}

TEST_CASE("a new database that cannot be made is made when the disk is well again", "[unit][history]") {
  const HistoryLife life = life_of(1);
  for (int nth = 1; nth <= 20; ++nth) {
    INFO("the " << nth << "th write fails");
    FaultyDisk& disk = FaultyDisk::well();
    const Files files;
    disk.fail_writes(nth, SQLITE_FULL);
    HistoryFile file({.path = files.path, .vfs = FaultyDisk::name}, life);
    const HistoryRow row = history_row(1, life);
    static_cast<void>(file.write({&row, 1}, {}));
    // A concurrent reader never finds a partially created history.
    if (std::filesystem::file_size(files.path) > 0) {
      const auto reader = HistoryReader::open(files.path);
      CHECK((reader ? "" : reader.error()) == "");
    }
    disk.heal();
    write_minutes(file, life, 1, 2);
    CHECK(read_all(files.path).minutes() == count(1, 2));
    CHECK(files.put_aside().empty());
    const auto database = Database::open(files.path, OpenAs::reader);
    REQUIRE(database);
    CHECK(database->number("PRAGMA auto_vacuum").value_or(0) == 2);  // incremental
    CHECK(database->number("PRAGMA page_size").value_or(0) == history_page_bytes);
  }
}

TEST_CASE("somebody else's lock is told as that, and waited for no longer than a second", "[unit][history]") {
  const Files files;
  const HistoryLife life = life_of(1);
  HistoryFile file({.path = files.path}, life);
  write_minutes(file, life, 1, 1);
  sqlite3* other = nullptr;
  REQUIRE(sqlite3_open(files.path.c_str(), &other) == SQLITE_OK);
  REQUIRE(sqlite3_exec(other, "BEGIN IMMEDIATE", nullptr, nullptr, nullptr) == SQLITE_OK);
  const HistoryRow row = history_row(2, life);
  const auto written = file.write({&row, 1}, {});
  REQUIRE_FALSE(written);
  CHECK(written.error().trouble == HistoryTrouble::busy);
  REQUIRE(sqlite3_exec(other, "COMMIT", nullptr, nullptr, nullptr) == SQLITE_OK);
  sqlite3_close(other);
  write_minutes(file, life, 2, 2);
  CHECK(read_all(files.path).minutes() == count(1, 2));
}

}  // namespace bmu
