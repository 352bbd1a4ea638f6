#include "tools/bmucell/data/csv_text.hpp"

#include <algorithm>
#include <array>

namespace bmu::cell {

namespace {

using namespace std::string_view_literals;

constexpr std::size_t shown_max = 60;

bool is_blank(char letter) {
  return letter == ' ' || letter == '\t';
}

bool is_printable(char letter) {
  return letter >= ' ' && letter <= '~';
}

std::string_view without_blanks(std::string_view text) {
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  return text;
}

/// First bytes of other file types that users pass instead of CSV.
struct OtherKind {
  std::string_view begin;
  const char* name;
};
constexpr std::array other_kinds{
    OtherKind{"PK\x03\x04"sv, "a ZIP archive, as spreadsheets are saved in"},
    OtherKind{"\xd0\xcf\x11\xe0"sv, "a document of an older spreadsheet program"},
    OtherKind{"MATLAB "sv, "a MATLAB file"},
    OtherKind{"\x89HDF"sv, "an HDF5 file"},
    OtherKind{"SQLite format"sv, "a database"},
    OtherKind{"%PDF"sv, "a PDF document"},
};

enum class Encoding : unsigned char { bytes, utf16_little, utf16_big };

struct Begin {
  Encoding encoding = Encoding::bytes;
  std::size_t mark_size = 0;
};

/// Without a byte-order mark, the zero bytes of the first two ASCII characters determine the encoding.
Begin begin_of(std::string_view bytes) {
  if (bytes.starts_with("\xef\xbb\xbf"sv)) return {.mark_size = 3};
  if (bytes.starts_with("\xff\xfe"sv)) return {Encoding::utf16_little, 2};
  if (bytes.starts_with("\xfe\xff"sv)) return {Encoding::utf16_big, 2};
  if (bytes.size() < 4) return {};
  const std::array is_zero{bytes[0] == '\0', bytes[1] == '\0', bytes[2] == '\0', bytes[3] == '\0'};
  if (is_zero == std::array{false, true, false, true}) return {Encoding::utf16_little};
  if (is_zero == std::array{true, false, true, false}) return {Encoding::utf16_big};
  return {};
}

std::string ascii_of_utf16(std::string_view units, bool is_big) {
  std::string text;
  text.reserve(units.size() / 2);
  for (std::size_t at = 0; at + 1 < units.size(); at += 2) {
    const char high = units[at + (is_big ? 0 : 1)];
    const char low = units[at + (is_big ? 1 : 0)];
    const bool is_ascii = high == '\0' && static_cast<unsigned char>(low) < 0x80;
    text += is_ascii ? low : '?';
  }
  return text;
}

}  // namespace

Result<std::string, std::string> utf8_text(std::string bytes) {
  for (const OtherKind& kind : other_kinds) {
    if (!bytes.starts_with(kind.begin)) continue;
    return failure(": found " + std::string(kind.name) + ", expected CSV; export the table as CSV");
  }
  const Begin begin = begin_of(bytes);
  bytes.erase(0, begin.mark_size);
  if (begin.encoding != Encoding::bytes) {
    if (bytes.size() % 2 != 0) return failure(": ends within a character of UTF-16; the file is not complete");
    bytes = ascii_of_utf16(bytes, begin.encoding == Encoding::utf16_big);
  }
  if (bytes.find('\0') != std::string::npos) return failure(": found a zero byte, expected CSV, which is text");
  return bytes;
}

std::string quotable(std::string_view text) {
  const bool is_cut = text.size() > shown_max;
  std::string shown(text.substr(0, shown_max));
  std::replace_if(
      shown.begin(), shown.end(), [](char letter) { return !is_printable(letter); }, '?');
  return is_cut ? shown + "..." : shown;
}

void CsvRecords::skip_blanks() {
  while (!rest_.empty() && is_blank(rest_.front()) && (rest_.front() != separator_ || separator_ == blank)) {
    rest_.remove_prefix(1);
  }
}

void CsvRecords::skip_line_end() {
  has_line_end_ = !rest_.empty();
  rest_.remove_prefix(rest_.starts_with("\r\n") ? 2 : std::min<std::size_t>(rest_.size(), 1));
  ++next_line_;
}

/// Skips the first quote and reads up to the closing one; false if the quote is broken.
bool CsvRecords::read_quoted(CsvField& field) {
  rest_.remove_prefix(1);
  std::size_t end = 0;
  for (;; end += 2) {
    end = rest_.find('"', end);
    if (end == std::string_view::npos) return false;
    if (!rest_.substr(end + 1).starts_with('"')) break;
  }
  const std::string_view quoted = rest_.substr(0, end);
  next_line_ += static_cast<std::size_t>(std::count(quoted.begin(), quoted.end(), '\n'));
  field = {.text = without_blanks(quoted), .is_quoted = true};
  rest_.remove_prefix(end + 1);
  const std::size_t before = rest_.size();
  skip_blanks();
  const bool has_separator = is_at_separator() || (separator_ == blank && rest_.size() < before);
  return has_separator || is_at_line_end();
}

CsvField CsvRecords::read_plain() {
  const std::array ends{separator_, '\n', '\r'};
  const std::size_t end = std::min(rest_.find_first_of(std::string_view(ends.data(), ends.size())), rest_.size());
  const CsvField field{.text = without_blanks(rest_.substr(0, end))};
  rest_.remove_prefix(end);
  return field;
}

CsvRecords::Read CsvRecords::next(std::vector<CsvField>& fields) {
  fields.clear();
  if (rest_.empty()) return Read::end;
  line_ = next_line_;
  while (true) {
    skip_blanks();
    if (separator_ == blank && is_at_line_end()) break;
    CsvField& field = fields.emplace_back();
    if (rest_.starts_with('"')) {
      if (!read_quoted(field)) return Read::broken_quote;
    } else {
      field = read_plain();
    }
    if (separator_ == blank) continue;
    if (!is_at_separator()) break;
    rest_.remove_prefix(1);
  }
  skip_line_end();
  return Read::record;
}

}  // namespace bmu::cell
