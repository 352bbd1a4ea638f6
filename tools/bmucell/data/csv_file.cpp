#include "tools/bmucell/data/csv_file.hpp"

#include <array>
#include <cerrno>
#include <cstring>
#include <memory>
#include <utility>

#include <zlib.h>

#include "tools/bmucell/data/csv_text.hpp"

namespace bmu::cell {

namespace {

/// Maximum size of a recording of a cell: a small compressed file can expand to more than the available memory.
constexpr std::size_t size_max = std::size_t{1} << 30U;

/// Bytes of the file, decompressed if it is compressed: zlib passes uncompressed bytes through.
Result<std::string, std::string> bytes_of(const std::filesystem::path& file) {
  errno = 0;
  const std::unique_ptr<gzFile_s, decltype(&gzclose)> source(gzopen(file.c_str(), "rb"), &gzclose);
  if (!source) return failure(": cannot be opened: " + std::string(std::strerror(errno)));
  std::string bytes;
  std::array<char, 1U << 16U> buffer{};
  while (true) {
    const int got = gzread(source.get(), buffer.data(), static_cast<unsigned>(buffer.size()));
    // A truncated file returns its readable bytes, and the error only if queried.
    int code = Z_OK;
    const char* const message = gzerror(source.get(), &code);
    if (got < 0 || code < 0) return failure(": cannot be read: " + std::string(message));
    if (got == 0) return bytes;
    bytes.append(buffer.data(), static_cast<std::size_t>(got));
    if (bytes.size() > size_max) return failure(": found more than 1 GiB, expected a recording of a cell");
  }
}

}  // namespace

Result<CsvTable, std::string> read_csv(const std::filesystem::path& file, const CsvSpec& spec) {
  Result<std::string, std::string> bytes = bytes_of(file);
  if (!bytes) return failure(file.string() + bytes.error());
  const Result<std::string, std::string> text = utf8_text(std::move(*bytes));
  if (!text) return failure(file.string() + text.error());
  Result<CsvTable, std::string> table = parse_csv(*text, spec);
  if (!table) return failure(file.string() + table.error());
  return table;
}

Result<CsvTable, std::string> read_whole_csv(const std::filesystem::path& file, const CsvSpec& spec) {
  Result<CsvTable, std::string> table = read_csv(file, spec);
  if (!table || table->torn_line == 0) return table;
  return failure(file.string() + ":" + std::to_string(table->torn_line) +
                 ": found a last line without a line end, which may be cut off; expected one if the line is whole");
}

}  // namespace bmu::cell
