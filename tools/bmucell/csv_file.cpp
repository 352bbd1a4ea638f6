#include "tools/bmucell/csv_file.hpp"

#include <cerrno>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <stdexcept>

#include <zlib.h>

#include "protocol/number_text.hpp"

namespace bmu::cell::csv {

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

/// Not a number where nothing was measured; nothing where it is none.
std::optional<double> number_in(std::string_view text) {
  if (text.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto value = number_of_text<double>(text);
  return value && !std::isinf(*value) ? value : std::nullopt;
}

std::string at_line(unsigned line) {
  return ":" + std::to_string(line) + ": ";
}

std::string at_line(int line) {
  return at_line(static_cast<unsigned>(line));
}

}  // namespace

Result<Source, std::string> open(const std::filesystem::path& file) {
  errno = 0;
  auto source = std::make_unique<Unpacked>(file);
  if (!source->is_open()) return failure(file.string() + ": cannot be opened: " + std::strerror(errno));
  return source;
}

double number_from(const char* text, const std::string& column, unsigned line, bool is_always) {
  const std::optional<double> value = number_in(text);
  if (!value || (is_always && std::isnan(*value))) {
    throw Wrong{at_line(line) + column + ": found '" + text + "', wanted a number"};
  }
  return *value;
}

std::string problem_of(const std::string& name, const std::exception_ptr& thrown) {
  try {
    std::rethrow_exception(thrown);
  } catch (const io::error::header_missing&) {
    return name + ": found nothing, wanted a first line with the names of the columns";
  } catch (const io::error::duplicated_column_in_header& error) {
    return name + ":1: found column '" + error.column_name + "' twice, wanted it once";
  } catch (const io::error::too_few_columns& error) {
    return name + at_line(error.file_line) + "found fewer fields than the first line has";
  } catch (const io::error::too_many_columns& error) {
    return name + at_line(error.file_line) + "found more fields than the first line has";
  } catch (const Wrong& wrong) {
    return name + wrong.text;
  } catch (const std::exception& error) {
    return name + ": cannot be read: " + error.what();
  }
}

}  // namespace bmu::cell::csv
