// Minutes of a history as lines for a serial port.
#include "daemon/shell/serial/history_log.hpp"

#include <filesystem>
#include <string>

#include <sqlite3.h>

#include "tests/support/catch.hpp"
#include "tests/support/temporary_folder.hpp"

using namespace bmu;

TEST_CASE("a minute is a line with all that was known of it", "[unit][serial][history][BMS_NF.5]") {
  HistoryRow row;
  row.unix_time_ms = 1'700'000'000'000;
  row.current_average_mA = -21'350;
  row.pack_voltage_average_mV = 189'554;
  row.soc_permille = 800;
  row.health_by_capacity_permille = 982;
  row.cells = {{.voltage_average_uV = 3'984'800}, {.voltage_average_uV = 3'985'100}};
  row.sensors = {{.temperature_average_dC = 251}, {.temperature_average_dC = -5}};
  row.faults = "cell_undervoltage,interlock";
  CHECK(log_line(row) ==
        "2023-11-14 22:13:20 I:-21.350A U:189.55V SOC:80.0% SOH:98.2% C:3.9848,3.9851 T:25.1,-0.5 "
        "E:cell_undervoltage,interlock");
}

TEST_CASE("what was not known of a minute is a dash, never a number", "[unit][serial][history][BMS_NF.5]") {
  HistoryRow row;
  CHECK(log_line(row) == "- - I:- U:- SOC:- SOH:- C:- T:- E:-");
  row.cells = {{}, {.voltage_average_uV = 3'000'000}};
  row.sensors = {{}};
  CHECK(log_line(row) == "- - I:- U:- SOC:- SOH:- C:-,3.0000 T:- E:-");
}

TEST_CASE("without a database the log is empty, and a file that is none is told", "[unit][serial][history]") {
  const TemporaryFolder folder;
  const std::string just_created = folder / "created.sqlite";
  sqlite3* creator = nullptr;
  REQUIRE(sqlite3_open(just_created.c_str(), &creator) == SQLITE_OK);
  REQUIRE(sqlite3_exec(creator, "PRAGMA user_version = 1; PRAGMA user_version = 0", nullptr, nullptr, nullptr) ==
          SQLITE_OK);
  sqlite3_close(creator);
  REQUIRE(std::filesystem::file_size(just_created) > 0);
  for (const std::string& path : {std::string(), folder / "none.sqlite", folder.file("new.sqlite", ""), just_created}) {
    const auto line = history_log(path)()();
    REQUIRE(line);
    CHECK_FALSE(line->has_value());
  }
  const auto line = history_log(folder.file("other.sqlite", std::string(5'000, 'x')))()();
  REQUIRE_FALSE(line);
  CHECK(line.error().find("other.sqlite") != std::string::npos);
}
