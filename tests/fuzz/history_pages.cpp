// Histories, damaged or made up, that SQLite can open or not: only complete rows are returned, the same each time, and
// the file is not changed by it.
//
// Input: a file; its first byte gives the size of the pages that are searched for rows of any kind.
#include <fstream>
#include <iterator>
#include <string>

#include "daemon/history/history_reader.hpp"
#include "daemon/history/row_blob.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/support/temporary_folder.hpp"

using namespace bmu;

namespace {

void check_blob(std::string_view blob) {
  const auto cells = cells_from(blob);
  FUZZ_CHECK(cells.has_value() == (blob.size() % cell_bytes == 0));
  if (cells) FUZZ_CHECK(blob_of(*cells_from(blob_of(*cells))) == blob_of(*cells));
  const auto sensors = sensors_from(blob);
  FUZZ_CHECK(sensors.has_value() == (blob.size() % sensor_bytes == 0));
  if (sensors) FUZZ_CHECK(blob_of(*sensors_from(blob_of(*sensors))) == blob_of(*sensors));
}

void check_strays(const std::string& path, std::size_t page_bytes, std::size_t file_bytes) {
  StrayRows rows(path, page_bytes);
  for (const int columns : {1, 3, 10}) {
    std::int64_t before = INT64_MIN;
    std::size_t count = 0;
    rows.for_each({static_cast<std::size_t>(columns), static_cast<std::size_t>(columns) + 1}, INT64_MIN, INT64_MAX,
                  [&](const RowValues& row, std::int64_t id) {
                    FUZZ_CHECK(id >= before && row.number(0) == id);
                    before = id;
                    for (int column = 0; column < columns; ++column) {
                      static_cast<void>(row.number(column));
                      if (const auto text = row.text(column)) check_blob(*text);
                    }
                    return ++count < file_bytes;
                  });
    FUZZ_CHECK(count <= file_bytes);
  }
}

void check_layout(std::string_view text) {
  const auto layout = layout_from_text(text);
  if (layout) FUZZ_CHECK(layout_from_text(to_text(*layout)) == layout);
}

void check_reader(const std::string& path) {
  auto history = HistoryReader::open(path);
  if (!history) {
    FUZZ_CHECK(!history.error().empty());
    return;
  }
  std::vector<HistoryRow> rows;
  history->for_each_row({}, [&](const HistoryRow& row) {
    const HistoryLife* const life = history->life_of(row);
    FUZZ_CHECK(life != nullptr && row.cells.size() == life->layout.cell_count());
    FUZZ_CHECK(row.sensors.size() == life->layout.sensor_count());
    rows.push_back(row);
    return rows.size() < 1'000;
  });
  std::size_t number = 0;
  history->for_each_row({}, [&](const HistoryRow& row) {
    FUZZ_CHECK(number < rows.size() && row == rows[number]);
    return ++number < rows.size();
  });
  history->for_each_event({}, [](const HistoryEvent&) { return true; });
  static_cast<void>(history->covered());
  for (const std::string& problem : history->problems()) FUZZ_CHECK(!problem.empty());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes = fuzz::text_of(data, size);
  static const TemporaryFolder folder;
  const std::string path = folder.only_file("file", bytes);
  const std::size_t page_bytes = std::size_t{512} << (size == 0 ? 0U : data[0] % 5U);
  check_strays(path, page_bytes, size);
  check_layout(bytes.substr(0, 2'000));
  check_blob(bytes.substr(0, 2'000));
  check_reader(path);
  std::ifstream file(path, std::ios::binary);
  const std::string after{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  FUZZ_CHECK(after == bytes);
  return 0;
}
