#include "tools/bmucell/data/csv_table.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "protocol/number_text.hpp"
#include "tools/bmucell/data/csv_text.hpp"

namespace bmu::cell {

namespace {

using Fields = std::vector<CsvField>;
using Read = CsvRecords::Read;

constexpr std::array separators{',', ';', '\t', CsvRecords::blank};
/// A preamble longer than this is not searched for the names of the columns.
constexpr std::size_t preamble_lines_max = 200;
constexpr std::size_t absent = std::numeric_limits<std::size_t>::max();

std::string at_line(std::size_t line) {
  return ":" + std::to_string(line) + ": ";
}

bool has_text(const Fields& fields) {
  return std::any_of(fields.begin(), fields.end(), [](const CsvField& field) { return !field.text.empty(); });
}

/// The next record with any text.
Read next_with_text(CsvRecords& records, Fields& fields) {
  Read read = Read::end;
  do {
    read = records.next(fields);
  } while (read == Read::record && !has_text(fields));
  return read;
}

std::size_t place_of(const Fields& fields, const std::string& name) {
  const auto found =
      std::find_if(fields.begin(), fields.end(), [&name](const CsvField& field) { return field.text == name; });
  return found == fields.end() ? absent : static_cast<std::size_t>(found - fields.begin());
}

std::size_t required_found(const Fields& fields, const CsvSpec& spec) {
  const auto end = spec.names.begin() + static_cast<std::ptrdiff_t>(spec.required);
  const auto is_there = [&fields](const std::string& name) { return place_of(fields, name) != absent; };
  return static_cast<std::size_t>(std::count_if(spec.names.begin(), end, is_there));
}

/// The separator with which a line has the most of the required names, and how many it has.
struct Separation {
  char separator = separators.front();
  std::size_t names = 0;
};

Separation separation_of(std::string_view text, const CsvSpec& spec) {
  Separation best;
  Fields fields;
  for (const char separator : separators) {
    CsvRecords records(text, separator);
    if (records.next(fields) != Read::record) continue;
    const std::size_t names = required_found(fields, spec);
    if (names > best.names) best = {separator, names};
  }
  return best;
}

std::string_view line_at(std::string_view text) {
  return text.substr(0, text.find_first_of("\r\n"));
}

bool is_blank_line(std::string_view line) {
  return line.find_first_not_of(" \t,;\"") == std::string_view::npos;
}

/// Remaining text, and the number of its first line.
struct Rest {
  std::string_view text;
  std::size_t line = 1;

  void skip_line() {
    text.remove_prefix(line_at(text).size());
    text.remove_prefix(text.starts_with("\r\n") ? 2 : std::min<std::size_t>(text.size(), 1));
    ++line;
  }
};

/// Skips to the first line with a text that is not a spreadsheet's note of its separator.
Rest first_line(std::string_view text) {
  Rest rest{text};
  while (!rest.text.empty() && (is_blank_line(line_at(rest.text)) || rest.text.starts_with("sep="))) rest.skip_line();
  return rest;
}

bool begins_with_number(std::string_view line) {
  const std::size_t begin = line.find_first_not_of(" \t\"+-");
  return begin != std::string_view::npos && line[begin] >= '0' && line[begin] <= '9';
}

/// The remedy for a first line without the required names.
std::string remedy_for(Rest rest, const CsvSpec& spec) {
  const bool has_values = begins_with_number(line_at(rest.text));
  const std::size_t head_line = rest.line;
  for (rest.skip_line(); !rest.text.empty() && rest.line <= preamble_lines_max; rest.skip_line()) {
    if (separation_of(rest.text, spec).names < spec.required) continue;
    return "line " + std::to_string(rest.line) + " has them: remove line" +
           (rest.line == head_line + 1 ? " " : "s " + std::to_string(head_line) + " to ") +
           std::to_string(rest.line - 1);
  }
  return has_values ? "it has values, not names: add a line of names" : "rename its columns";
}

std::string missing_name(const Rest& rest, const Fields& fields, const CsvSpec& spec) {
  std::size_t missing = 0;
  while (place_of(fields, spec.names[missing]) != absent) ++missing;
  return ": no column '" + spec.names[missing] + "' in line " + std::to_string(rest.line) + ", '" +
         quotable(line_at(rest.text)) + "': " + remedy_for(rest, spec) + "; expected " + spec.head;
}

/// The name of a column that occurs twice in the first line; nothing: none.
std::optional<std::string> repeated_name(const Fields& fields, const CsvSpec& spec) {
  for (const std::string& name : spec.names) {
    const auto is_name = [&name](const CsvField& field) { return field.text == name; };
    if (std::count_if(fields.begin(), fields.end(), is_name) > 1) return name;
  }
  return std::nullopt;
}

/// Positions of the columns of the spec.
struct Head {
  std::vector<std::size_t> places{};  // by column of the spec; absent
  std::size_t size = 0;               // fields of the first line
  bool has_unnamed_end = false;       // the first line ends in a separator
};

Head head_of(const Fields& fields, const CsvSpec& spec) {
  Head head{.size = fields.size(), .has_unnamed_end = fields.back().text.empty()};
  for (const std::string& name : spec.names) head.places.push_back(place_of(fields, name));
  return head;
}

/// R writes row names in quotes and values without, and the column of row names has no name in the first line.
bool has_row_name(const Fields& fields, const Head& head) {
  return fields.size() == head.size + 1 && fields[0].is_quoted && !fields[1].is_quoted;
}

/// Number of fields of a row before its first value; nothing if the fields do not match those of the first line.
std::optional<std::size_t> fields_before(const Fields& fields, const Head& head) {
  if (fields.size() == head.size) return 0;
  if (fields.size() + 1 == head.size && head.has_unnamed_end) return 0;
  if (has_row_name(fields, head)) return 1;
  if (fields.size() == head.size + 1 && fields.back().text.empty()) return 0;
  return std::nullopt;
}

constexpr std::string_view digits = "0123456789";

/// True if "1,234" cannot be a number with a thousands separator: then the comma is the decimal mark.
bool is_decimal_comma(std::string_view text, std::size_t comma) {
  constexpr std::size_t thousands = 3;
  const std::string_view before = text.substr(0, comma);
  const std::size_t first = before.find_first_of(digits);
  if (first == std::string_view::npos || before[first] == '0' || before.size() - first > thousands) return true;
  const std::string_view behind = text.substr(comma + 1);
  return behind.size() != thousands || behind.find_first_not_of(digits) != std::string_view::npos;
}

/// Converts the numbers of one file, which all have the same decimal mark.
class Numbers {
 public:
  /// Not a number for a value that was not measured; nothing if the text is no number.
  std::optional<double> value_of(std::string_view text, const std::string& column, std::size_t line) {
    if (text.empty() || text == "NA") return std::numeric_limits<double>::quiet_NaN();
    if (text.front() == '+' && text.size() > 1 && text[1] != '-') text.remove_prefix(1);
    const std::size_t comma = text.find(',');
    if (comma == std::string_view::npos) {
      if (point_.line == 0 && text.find('.') != std::string_view::npos) point_ = {line, column, std::string(text)};
      return finite_value_of(text);
    }
    if (comma_.line == 0) comma_ = {line, column, std::string(text)};
    is_certain_ = is_certain_ || is_decimal_comma(text, comma);
    std::string with_point(text);
    with_point[comma] = '.';
    return finite_value_of(with_point);
  }

  /// The reason to refuse commas without a certain meaning; "": none.
  [[nodiscard]] std::string uncertainty() const {
    if (comma_.line == 0) return "";
    const std::string found = at_line(comma_.line) + comma_.column + ": found '" + quotable(comma_.text) + "'";
    if (point_.line != 0) {
      return found + " with a comma and in line " + std::to_string(point_.line) + " '" + quotable(point_.text) +
             "' with a point, expected one decimal mark and no other";
    }
    return is_certain_ ? "" : found + ", thousands or a decimal comma; expected a decimal point";
  }

 private:
  struct Seen {
    std::size_t line = 0;  // 0: none
    std::string column{};
    std::string text{};
  };

  static std::optional<double> finite_value_of(std::string_view text) {
    const auto value = number_of_text<double>(text);
    return value && !std::isinf(*value) ? value : std::nullopt;
  }

  Seen point_;
  Seen comma_;
  bool is_certain_ = false;
};

/// Reads the rows below the first line; each function returns an error text, "" for none.
class Rows {
 public:
  Rows(const CsvSpec& spec, Head head, char separator) : spec_(spec), head_(std::move(head)), separator_(separator) {
    for (const std::size_t place : head_.places) table_.has_column.push_back(place != absent);
  }

  std::string read(CsvRecords& records) {
    Fields fields;
    Read read = Read::end;
    while ((read = next_with_text(records, fields)) == Read::record) {
      if (!records.has_line_end() && may_be_cut(fields)) {
        table_.torn_line = records.line();
        continue;
      }
      const std::string problem = add(fields, records.line());
      if (!problem.empty()) return at_line(records.line()) + problem;
    }
    if (read == Read::broken_quote) return at_line(records.line()) + broken_quote;
    if (!table_.lines.empty()) return numbers_.uncertainty();
    return table_.torn_line == 0 ? ": no rows after the first line"
                                 : at_line(table_.torn_line) + "the only row has no line end and may be cut off";
  }
  [[nodiscard]] CsvTable table() && { return std::move(table_); }

  static constexpr const char* broken_quote =
      "found a quote that does not end, or text behind its end; expected \"...\" as a field";

 private:
  /// True for a line without a line end that may be truncated: its last number may continue, and fields may be missing.
  /// The line is complete only if its last field has its closing quote and no field is missing.
  [[nodiscard]] bool may_be_cut(const Fields& fields) const {
    return !fields.back().is_quoted || !fields_before(fields, head_);
  }

  std::string add(const Fields& fields, std::size_t line) {
    const std::optional<std::size_t> before = fields_before(fields, head_);
    if (!before) return wrong_size(fields.size());
    for (std::size_t column = 0; column < head_.places.size(); ++column) {
      const std::size_t place = head_.places[column];
      const bool is_there = place != absent && place + *before < fields.size();
      const std::string_view field = is_there ? fields[place + *before].text : std::string_view{};
      const auto value = numbers_.value_of(field, spec_.names[column], line);
      if (!value || (column < spec_.never_empty && std::isnan(*value))) {
        return spec_.names[column] + ": found '" + quotable(field) + "', expected a number";
      }
      table_.values.push_back(*value);
    }
    table_.lines.push_back(line);
    return "";
  }

  [[nodiscard]] std::string wrong_size(std::size_t size) const {
    const bool may_be_commas = size > head_.size && separator_ == ',';
    return "found " + std::to_string(size) + " fields, expected " + std::to_string(head_.size) +
           " as in the first line" +
           (may_be_commas ? "; values with a decimal comma need quotes, or another separator" : "");
  }

  const CsvSpec& spec_;
  Head head_;
  char separator_;
  Numbers numbers_;
  CsvTable table_;
};

}  // namespace

Result<CsvTable, std::string> parse_csv(std::string_view text, const CsvSpec& spec) {
  const Rest rest = first_line(text);
  if (rest.text.empty()) return failure(": found nothing, expected a first line with the names of the columns");
  const Separation separation = separation_of(rest.text, spec);
  CsvRecords records(rest.text, separation.separator, rest.line);
  Fields fields;
  if (records.next(fields) != Read::record) return failure(at_line(rest.line) + Rows::broken_quote);
  if (separation.names < spec.required) return failure(missing_name(rest, fields, spec));
  if (const auto name = repeated_name(fields, spec)) {
    return failure(at_line(rest.line) + "found column '" + *name + "' twice, expected it once");
  }
  Rows rows(spec, head_of(fields, spec), separation.separator);
  const std::string problem = rows.read(records);
  if (!problem.empty()) return failure(problem);
  return std::move(rows).table();
}

}  // namespace bmu::cell
