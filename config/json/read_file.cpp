#include "config/json/read_file.hpp"

#include <cerrno>
#include <fstream>
#include <system_error>

namespace bmu {

Result<std::string, std::string> read_file(const std::filesystem::path& file) {
  constexpr std::size_t file_size_max = std::size_t{1} << 20;
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(file, error);
  if (status.type() == std::filesystem::file_type::not_found) return failure(std::string("no such file"));
  if (error) return failure("nothing that can be read (" + error.message() + ")");
  if (std::filesystem::is_directory(status)) return failure(std::string("a directory"));
  if (!std::filesystem::is_regular_file(status)) return failure(std::string("something other than a regular file"));
  errno = 0;
  std::ifstream stream(file, std::ios::binary);
  std::string bytes(file_size_max + 1, '\0');
  stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (stream.gcount() == 0 && (!stream.eof() || stream.bad())) {
    return failure("nothing that can be read (" + std::generic_category().message(errno) + ")");
  }
  bytes.resize(static_cast<std::size_t>(stream.gcount()));
  if (bytes.size() > file_size_max) return failure(std::string("more than 1 MiB"));
  return bytes;
}

}  // namespace bmu
