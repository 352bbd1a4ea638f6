// Acceptance test of BMS_F.5 (24 V competition pack). Procedure of the authors: the pack rests for ten hours, then its
// log is read out. Their figure: once a minute every cell voltage, the current and the temperatures, for ten hours;
// their own build did not reach it.
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include "daemon/history/history_reader.hpp"
#include "daemon/history/history_store.hpp"
#include "daemon/history/history_tap.hpp"
#include "daemon/shell/serial/history_log.hpp"
#include "mmu/scenario/simulator.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/patched_pack.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tools/common/virtual_run.hpp"

using namespace bmu;

namespace {

constexpr Duration disk_max = 60s;

HistoryLife life_of(const CoreConfig& config) {
  return {.token = "one",
          .version = "0.1.0",
          .pack_name = "LiPo 6s 24 V",
          .config = "00c0ffee",
          .layout = layout_of(config)};
}

/// The comma-separated numbers of a field of a log line; an empty list if one of them is missing.
std::vector<double> numbers_behind(const std::string& name, const std::string& line) {
  const std::size_t at = line.find(name);
  if (at == std::string::npos) return {};
  std::vector<double> numbers;
  const char* text = line.c_str() + at + name.size();
  while (true) {
    char* end = nullptr;
    numbers.push_back(std::strtod(text, &end));
    if (end == text) return {};
    if (*end != ',') return numbers;
    text = end + 1;
  }
}

}  // namespace

TEST_CASE("after ten hours of rest every minute of them can be read out", "[scenario][accept][BMS_F.5][slow][hours]") {
  const TemporaryFolder folder;
  const CoreConfig config = test::patched_pack("{}", "lipo-6s-24v.json");
  // The last cell is kept warmer, so that the second sensor differs from the first.
  VirtualRun run(config, simulator_config(config), *parse_scenario("0 cell 1.6 temperature_dC 320"));
  const std::string path = folder / "history.sqlite";
  constexpr int minutes = 600;
  {
    HistoryStore store({.file = {.path = path}, .write_every = 5ms}, life_of(config));
    REQUIRE(store.start());
    HistoryTap tap(run.core(), store, 60s, [](Severity, std::string_view) {});
    run.set_tap(&tap);
    for (int minute = 1; minute <= minutes; ++minute) {
      while (run.elapsed() < minute * 60s + 1s) run.step();
      REQUIRE(store.flush(disk_max));
    }
    run.set_tap(nullptr);
    CHECK(store.health().rows_lost == 0);
  }

  auto history = HistoryReader::open(path);
  REQUIRE(history);
  std::vector<HistoryRow> rows;
  history->for_each_row_after(-1, [&rows](const HistoryRow& row) {
    rows.push_back(row);
    return true;
  });
  CHECK(history->problems().empty());
  REQUIRE(rows.size() == minutes);
  const Plant& plant = run.simulator().plant();
  for (std::size_t minute = 1; minute < rows.size(); ++minute) {
    INFO("minute " << minute);
    const HistoryRow& row = rows[minute];
    CHECK(row.uptime_ms.value_or(0) - rows[minute - 1].uptime_ms.value_or(0) == 60'000);
    // The line of this minute as LogReq returns it: the text read out at the pack.
    const std::string line = log_line(row);
    INFO(line);
    const std::vector<double> cells_V = numbers_behind(" C:", line);
    REQUIRE(cells_V.size() == plant.cell_count());
    for (std::size_t cell = 0; cell < cells_V.size(); ++cell) {
      CHECK(std::abs(cells_V[cell] - plant.cell(cell).voltage_V) < 0.004);
    }
    // Each sensor sits among its half of the cells and measures the warmest of them.
    const std::vector<double> sensors_C = numbers_behind(" T:", line);
    REQUIRE(config.modules[0].temperature_sensor_count == 2);
    REQUIRE(sensors_C.size() >= 2);  // after them come those of the board
    CHECK(std::abs(sensors_C[0] - plant.cell(0).temperature_C) < 3.0);
    CHECK(std::abs(sensors_C[1] - plant.cell(plant.cell_count() - 1).temperature_C) < 3.0);
    const std::vector<double> current_A = numbers_behind(" I:", line);
    REQUIRE(current_A.size() == 1);
    CHECK(std::abs(current_A[0]) <= 0.1);
    CHECK(row.soc_permille.has_value());
  }
}
