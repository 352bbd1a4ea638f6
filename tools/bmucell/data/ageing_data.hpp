// A cell's charges over its life, and what its capacity was found to be at times: a recording of many charges, and a
// table of the tests between them.
//
// The recording is a Series with a column `cycle`, the number of the charge; time_s begins anew in each. The table is
// CSV; its first line names the columns, others than these are passed over:
//   cycle           the number of the test
//   capacity_Ah     that it found
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
  std::vector<CellSample> samples{};  // the first passed since time 0
};

struct CapacityTest {
  double cycle = 0.0;
  double capacity_As = 0.0;
  double charge_number = 0.0;
  bool has_own_charge = true;  // false: another test of the same charge came first, and what charged it is not recorded
};

struct AgeingData {
  std::string name;                   // of the recording
  std::vector<Charge> charges{};      // by rising number
  std::vector<CapacityTest> tests{};  // by the number of the charge; of charges that are there

  /// The charge that precedes one of the tests.
  [[nodiscard]] const Charge& charge_before(const CapacityTest& test) const;
};

/// The rows of each cycle. The error says which column is missing or which number is out of order.
[[nodiscard]] Result<std::vector<Charge>, std::string> charges_of(const Series& series);

/// Both files. Each error is one line: file, line if there is one, what was found and what wanted.
[[nodiscard]] Result<AgeingData, std::string> read_ageing(const std::filesystem::path& recording,
                                                          const std::filesystem::path& table);

/// What a vehicle would have seen that was plugged in later: without the samples before the state of charge has come to
/// `from_soc`, counted back from the end of the charge with the capacity of the test behind it, or before the voltage
/// has come to `from_voltage_V`. 0: from the start.
struct PluggedIn {
  double from_soc = 0.0;
  double from_voltage_V = 0.0;
};
[[nodiscard]] Charge plugged_in(const Charge& charge, double capacity_As, const PluggedIn& when);

}  // namespace bmu::cell
