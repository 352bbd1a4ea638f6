#include "tools/bmucell/output.hpp"

#include <cstdio>

#include "daemon/shell/system/whole_file.hpp"

namespace bmu::cell {

void complain(const std::string& text) {
  std::fprintf(stderr, "bmucell: %s\n", text.c_str());
}

bool write_file(const std::string& file, const std::string& text) {
  const auto written = write_whole_file(file, text);
  if (!written) complain(file + ": cannot be written: " + written.error());
  return written.has_value();
}

}  // namespace bmu::cell
