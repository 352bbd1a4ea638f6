// The charges of an ageing cell and its measured capacities: a recording of many charges, and a table of the capacity
// tests between them.
//
// The recording is a Series with a column `cycle`, the number of the charge; time_s restarts in each. The table is CSV;
// its first line names the columns, other columns are ignored:
//   cycle           the number of the test
//   capacity_Ah     its result
//   charges_before  the number of the charge that precedes it
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "daemon/core/estimation/soc/soc_estimate.hpp"
#include "protocol/result.hpp"
#include "tools/bmucell/data/series.hpp"

namespace bmu::cell {

struct Charge {
  double number = 0.0;
  std::vector<CellSample> samples{};  // passed_s of the first is its time since time 0
};

struct CapacityTest {
  double cycle = 0.0;
  double capacity_As = 0.0;
  double charge_number = 0.0;
  bool has_own_charge = true;  // false: another test of that charge came first, and this test's charge is not recorded
};

struct AgeingData {
  std::string name;                   // of the recording
  std::vector<Charge> charges{};      // by rising number
  std::vector<CapacityTest> tests{};  // by the number of the charge; only tests with a recorded charge

  /// The charge that precedes one of the tests.
  [[nodiscard]] const Charge& charge_before(const CapacityTest& test) const;
};

/// The rows of each cycle. The error names the missing column or the number that is out of order.
[[nodiscard]] Result<std::vector<Charge>, std::string> charges_of(const Series& series);

/// Reads both files. Each error is one line: file, line if there is one, found and expected value.
[[nodiscard]] Result<AgeingData, std::string> read_ageing(const std::filesystem::path& recording,
                                                          const std::filesystem::path& table);

/// The part of a charge that a vehicle sees if it is plugged in later: without the samples before the state of charge
/// reaches `from_soc`, counted back from the end of the charge with the capacity of the test after it, or before the
/// voltage reaches `from_voltage_V`. 0: from the start.
struct PluggedIn {
  double from_soc = 0.0;
  double from_voltage_V = 0.0;
};
[[nodiscard]] Charge plugged_in(const Charge& charge, double capacity_As, const PluggedIn& when);

}  // namespace bmu::cell
