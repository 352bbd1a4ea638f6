#include "tools/bmucell/output.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <system_error>

namespace bmu::cell {

void complain(const std::string& text) {
  std::fprintf(stderr, "bmucell: %s\n", text.c_str());
}

bool write_file(const std::string& file, const std::string& text) {
  const std::string beside = file + ".part";
  errno = 0;
  std::ofstream stream(beside, std::ios::binary);
  stream << text;
  stream.close();
  if (!stream) {
    complain(file + ": cannot be written: " + std::strerror(errno));
    return false;
  }
  std::error_code error;
  std::filesystem::rename(beside, file, error);
  if (error) complain(file + ": cannot be written: " + error.message());
  return !error;
}

}  // namespace bmu::cell
