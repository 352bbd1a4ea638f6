#include "tools/bmucell/series.hpp"

#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string_view>

#include <libfccp/csv.h>
#include <zlib.h>

namespace bmu::cell {

namespace {

/// Bytes of a file, unpacked if it is packed: zlib passes on what is not.
class Unpacked : public io::ByteSourceBase {
 public:
  explicit Unpacked(const std::filesystem::path& file) : file_(gzopen(file.c_str(), "rb"), &gzclose) {}
  [[nodiscard]] bool is_open() const { return file_ != nullptr; }
  int read(char* buffer, int size) override {
    const int got = gzread(file_.get(), buffer, static_cast<unsigned>(size));
    // A file that was cut off gives what it has, and says so only if asked.
    int code = Z_OK;
    const char* const message = gzerror(file_.get(), &code);
    if (got < 0 || (got < size && code < 0)) throw std::runtime_error(message);
    return got;
  }

 private:
  std::unique_ptr<gzFile_s, decltype(&gzclose)> file_;
};

constexpr std::array columns{"time_s", "current_A", "voltage_V", "temp_C", "ref_soc_pct"};
constexpr std::size_t needed_columns = 3;
using Reader = io::CSVReader<columns.size(), io::trim_chars<' ', '\t', '\r'>>;

/// Not a number where nothing was measured; nothing where it is none.
std::optional<double> number_from(std::string_view text) {
  if (text.empty()) return std::numeric_limits<double>::quiet_NaN();
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || std::isinf(value)) return std::nullopt;
  return value;
}

/// The end of a message, behind the name of the file.
class WrongRecording : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

std::string at_line(unsigned line) {
  return ":" + std::to_string(line) + ": ";
}

void check_columns(const Reader& reader) {
  for (std::size_t column = 0; column < needed_columns; ++column) {
    if (reader.has_column(columns[column])) continue;
    throw WrongRecording(std::string(": no column '") + columns[column] +
                         "'; wanted a first line with time_s, current_A, voltage_V and, if known, temp_C, ref_soc_pct");
  }
}

SeriesRow row_of(const std::array<const char*, columns.size()>& texts, unsigned line) {
  std::array<double, columns.size()> values{};
  for (std::size_t column = 0; column < columns.size(); ++column) {
    const std::optional<double> value = number_from(texts[column]);
    // Without its time a row has no place among the others.
    if (!value || (column == 0 && std::isnan(*value))) {
      throw WrongRecording(at_line(line) + columns[column] + ": found '" + texts[column] + "', wanted a number");
    }
    values[column] = *value;
  }
  constexpr double percent = 0.01;
  return {values[0], values[1], values[2], values[3], values[4] * percent};
}

Series read_rows(Reader& reader, const std::filesystem::path& file) {
  reader.read_header(io::ignore_missing_column | io::ignore_extra_column, columns[0], columns[1], columns[2],
                     columns[3], columns[4]);
  check_columns(reader);
  Series series{.name = file.string(),
                .has_temperature = reader.has_column(columns[3]),
                .has_soc = reader.has_column(columns[4])};
  std::array<const char*, columns.size()> texts{"", "", "", "", ""};
  while (reader.read_row(texts[0], texts[1], texts[2], texts[3], texts[4])) {
    series.rows.push_back(row_of(texts, reader.get_file_line()));
  }
  if (series.rows.empty()) throw WrongRecording(": no rows after the first line");
  return series;
}

/// The library's own messages name the file twice or not at all, and not what was wanted.
Result<Series, std::string> read_or_tell(const std::filesystem::path& file, std::unique_ptr<Unpacked> source) {
  const std::string name = file.string();
  try {
    Reader reader(name, std::move(source));
    return read_rows(reader, file);
  } catch (const io::error::header_missing&) {
    return failure(name + ": found nothing, wanted a first line with the names of the columns");
  } catch (const io::error::duplicated_column_in_header& error) {
    return failure(name + ":1: found column '" + error.column_name + "' twice, wanted it once");
  } catch (const io::error::too_few_columns& error) {
    return failure(name + at_line(static_cast<unsigned>(error.file_line)) +
                   "found fewer fields than the first line has");
  } catch (const io::error::too_many_columns& error) {
    return failure(name + at_line(static_cast<unsigned>(error.file_line)) +
                   "found more fields than the first line has");
  } catch (const WrongRecording& error) {
    return failure(name + error.what());
  } catch (const std::exception& error) {
    return failure(name + ": cannot be read: " + error.what());
  }
}

}  // namespace

Result<Series, std::string> read_series(const std::filesystem::path& file) {
  errno = 0;
  auto source = std::make_unique<Unpacked>(file);
  if (!source->is_open()) return failure(file.string() + ": cannot be opened: " + std::strerror(errno));
  return read_or_tell(file, std::move(source));
}

}  // namespace bmu::cell
