// CSV files of test benches: the rows have the requested columns and the required numbers; an error is one line.
//
// Input: a file, compressed with gzip or not.
#include <cmath>

#include "tests/fuzz/fuzz.hpp"
#include "tests/fuzz/memory_file.hpp"
#include "tools/bmucell/data/csv_file.hpp"

using namespace bmu;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const fuzz::MemoryFile file(fuzz::text_of(data, size));
  const auto table = cell::read_csv(file.path(), {.names = {"time_s", "current_A", "voltage_V"},
                                                  .required = 2,
                                                  .never_empty = 1,
                                                  .head = "time_s,current_A[,voltage_V]"});
  if (!table) {
    FUZZ_CHECK(!table.error().empty() && table.error().find('\n') == std::string::npos);
    return 0;
  }
  FUZZ_CHECK(table->has_column[0] && table->has_column[1] && table->row_count() > 0);
  FUZZ_CHECK(table->values.size() == 3 * table->row_count());
  for (std::size_t at = 0; at < table->row_count(); ++at) {
    const auto row = table->row(at);
    FUZZ_CHECK(at == 0 || table->lines[at] > table->lines[at - 1]);
    FUZZ_CHECK(std::isfinite(row[0]));
    for (const double number : row) FUZZ_CHECK(!std::isinf(number));
    FUZZ_CHECK(table->has_column[2] || std::isnan(row[2]));
  }
  return 0;
}
