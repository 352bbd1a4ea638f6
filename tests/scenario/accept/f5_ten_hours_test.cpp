// Acceptance test of BMS_F.5 (24 V competition pack). Procedure of the authors: the pack rests for ten hours, then its
// log is read out. Their figure: once a minute every cell voltage, the current and the temperatures, for ten hours;
// their own build did not reach it.
#include <cmath>
#include <string>
#include <vector>

#include "daemon/history/history_reader.hpp"
#include "daemon/history/history_store.hpp"
#include "daemon/history/history_tap.hpp"
#include "mmu/simulator.hpp"
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

}  // namespace

TEST_CASE("after ten hours of rest every minute of them can be read out", "[scenario][accept][BMS_F.5][slow][hours]") {
  const TemporaryFolder folder;
  const CoreConfig config = test::patched_pack("{}", "lipo-6s-24v.json");
  VirtualRun run(config, simulator_config(config), {});
  const std::string path = folder / "history.sqlite";
  constexpr int minutes = 600;
  {
    HistoryStore store({.file = {.path = path}, .write_every = 5ms}, life_of(config));
    store.start();
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
    REQUIRE(row.cells.size() == plant.cell_count());
    for (std::size_t cell = 0; cell < row.cells.size(); ++cell) {
      REQUIRE(row.cells[cell].voltage_average_uV.has_value());
      CHECK(std::abs(static_cast<double>(*row.cells[cell].voltage_average_uV) * 1e-6 - plant.cell(cell).voltage_V) <
            0.004);
    }
    REQUIRE(row.sensors.size() >= config.modules[0].temperature_sensor_count);
    const auto sensor_dC = static_cast<double>(row.sensors[0].temperature_average_dC.value_or(0));
    CHECK(std::abs(sensor_dC * 0.1 - plant.cell(0).temperature_C) < 3.0);
    CHECK(std::abs(row.current_average_mA.value_or(99'999)) <= 100);
    CHECK(row.soc_permille.has_value());
  }
}
