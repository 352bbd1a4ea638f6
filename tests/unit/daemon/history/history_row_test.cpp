// Stored form of a row, and its round trip.
#include <algorithm>
#include <set>

#include "daemon/history/history_columns.hpp"
#include "daemon/history/row_blob.hpp"
#include "tests/support/core_bench.hpp"
#include "tests/support/history_rows.hpp"

namespace bmu {

using test::history_row;
using test::life_of;

TEST_CASE("cells and sensors come back from their bytes, to 0.1 mV and 0.1 degrees", "[unit][history][BMS_F.5]") {
  const HistoryRow row = history_row(7, life_of(2));
  CHECK(blob_of(row.cells).size() == 24 * cell_bytes);
  CHECK(cells_from(blob_of(row.cells)) == row.cells);
  CHECK(sensors_from(blob_of(row.sensors)) == row.sensors);

  std::vector<HistoryCell> ends(3);
  ends[0] = {.voltage_average_uV = 0, .voltage_min_uV = 0, .voltage_max_uV = 6'553'400, .voltage_samples = 1};
  ends[1].soc_permille = 0;
  ends[1].health_by_resistance_permille = 1'500;
  CHECK(cells_from(blob_of(ends)) == ends);
  std::vector<HistorySensor> cold{{.temperature_average_dC = -400,
                                   .temperature_min_dC = -1'000,
                                   .temperature_max_dC = 0,
                                   .temperature_samples = 65'534}};
  CHECK(sensors_from(blob_of(cold)) == cold);
}

TEST_CASE("what does not fit into a row's bytes is not known there, never another number", "[unit][history]") {
  std::vector<HistoryCell> cells(1);
  cells[0] = {.voltage_average_uV = -100,
              .voltage_min_uV = 6'553'500,
              .voltage_max_uV = 3'300'049,
              .voltage_samples = 1'000'000,
              .soc_permille = -1};
  const auto back = cells_from(blob_of(cells));
  REQUIRE(back);
  CHECK_FALSE((*back)[0].voltage_average_uV.has_value());
  CHECK_FALSE((*back)[0].voltage_min_uV.has_value());
  CHECK((*back)[0].voltage_max_uV == 3'300'000);
  CHECK((*back)[0].voltage_samples == 65'534);
  CHECK_FALSE((*back)[0].soc_permille.has_value());
}

TEST_CASE("bytes that are no whole number of records are none", "[unit][history]") {
  const std::string blob = blob_of(history_row(1, life_of(1)).cells);
  for (std::size_t size = 0; size <= blob.size(); ++size) {
    CHECK(cells_from(std::string_view(blob).substr(0, size)).has_value() == (size % cell_bytes == 0));
    CHECK(sensors_from(std::string_view(blob).substr(0, size)).has_value() == (size % sensor_bytes == 0));
  }
}

TEST_CASE("a row's checksum changes with every one of its values", "[unit][history]") {
  const HistoryLife life = life_of(1);
  const HistoryRow row = history_row(3, life);
  const std::string cells = blob_of(row.cells);
  const std::string sensors = blob_of(row.sensors);
  std::set<std::int64_t> sums{checksum_of(row, cells, sensors)};
  std::size_t changes = 1;
  const auto note = [&](const HistoryRow& changed, const std::string& its_cells, const std::string& its_sensors) {
    sums.insert(checksum_of(changed, its_cells, its_sensors));
    ++changes;
  };
  for (const HistoryColumn<HistoryRow>& column : row_columns()) {
    HistoryRow changed = row;
    if (column.number != nullptr) {
      changed.*column.number = (row.*column.number).value_or(0) + 1;
    } else {
      changed.*column.text += "x";
    }
    note(changed, cells, sensors);
  }
  for (std::size_t at = 0; at < cells.size(); ++at) {
    std::string changed = cells;
    changed[at] = static_cast<char>(changed[at] ^ 1);
    note(row, changed, sensors);
  }
  note(row, cells + sensors, "");
  CHECK(sums.size() == changes);
}

TEST_CASE("every column of a row has a name of its own, with a unit where it has one", "[unit][history]") {
  std::set<std::string_view> names;
  for (const HistoryColumn<HistoryRow>& column : row_columns()) {
    CHECK(names.insert(column.name).second);
    CHECK((column.number != nullptr) != (column.text != nullptr));
  }
  for (const char* name : {"unix_time_ms", "current_average_mA", "cell_voltage_max_uV", "soc_permille", "faults"}) {
    CHECK(names.count(name) == 1);
  }
}

TEST_CASE("a pack's layout comes back from its text, and no other text is one", "[unit][history]") {
  const HistoryLayout layout = layout_of(test::small_pack());
  CHECK(to_text(layout) == "1:4+2+4 2:4+2+4");
  CHECK(layout_from_text(to_text(layout)) == layout);
  CHECK(layout.cell_count() == 8);
  CHECK(layout.sensors().size() == layout.sensor_count());
  CHECK(layout.cells().back().module == 2);
  CHECK(layout.cells().back().place == 4);
  CHECK(layout.cells().back().number == 8);
  CHECK(layout.sensors()[2].is_board);
  CHECK(layout.sensors()[2].place == 1);
  for (const char* text : {"1", "1:", "1:12", "1:12+4", "1:12+4+", "0:12+4+4", "64:1+1+1", "1:13+4+4", "1:12+5+4",
                           "1:12+4+5", "1:12+4+4 ", " 1:12+4+4", "1:12+4+4  2:12+4+4", "1:-1+4+4", "1:12+4+4x"}) {
    INFO(text);
    CHECK_FALSE(layout_from_text(text).has_value());
  }
  std::string many = "1:12+4+4";
  for (int module = 1; module < 64; ++module) many += " 1:12+4+4";
  CHECK_FALSE(layout_from_text(many).has_value());
}

}  // namespace bmu
