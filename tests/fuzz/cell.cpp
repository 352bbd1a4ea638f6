// Cell files: an accepted one is written as a text that is accepted, and is then written the same again.
//
// Input: a cell file.
#include "config/cell_file/cell_config.hpp"
#include "config/cell_file/cell_file_writer.hpp"
#include "tests/fuzz/fuzz.hpp"

using namespace bmu;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto cell = parse_cell_file(fuzz::text_of(data, size), "cell.json");
  if (!cell) {
    FUZZ_CHECK(!cell.error().empty());
    for (const ConfigProblem& problem : cell.error()) FUZZ_CHECK(!problem.found.empty() && !problem.wanted.empty());
    return 0;
  }
  const std::string text = cell_file_text(*cell);
  const auto again = parse_cell_file(text, "cell.json");
  FUZZ_CHECK(again.has_value());
  FUZZ_CHECK(cell_file_text(*again) == text);
  return 0;
}
