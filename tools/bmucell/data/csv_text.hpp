// Text of a CSV file as UTF-8, and its records: lines split into fields.
//
// RFC 4180 and the variants of cell testers, spreadsheets and R: fields separated by commas, semicolons, tabs or
// blanks; fields in double quotes or not; lines that end in LF, CR LF or CR; UTF-8 with or without a byte-order mark,
// UTF-16 of either byte order.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/result.hpp"

namespace bmu::cell {

/// The text without its byte-order mark. UTF-16 becomes UTF-8; only its ASCII characters are kept, others become '?':
/// column names and numbers are ASCII. The error is the cause, without the name of the file: a spreadsheet, a zero
/// byte, a truncated character.
[[nodiscard]] Result<std::string, std::string> utf8_text(std::string bytes);

/// Part of a text for use in a message: one line, at most 60 characters, non-ASCII as '?'.
[[nodiscard]] std::string quotable(std::string_view text);

struct CsvField {
  std::string_view text;  // without quotes, and without blanks around or within them; a doubled quote stays doubled
  bool is_quoted = false;
};

/// The records of a text one by one. A quoted field may hold separators and line ends. The text must outlive the
/// object.
class CsvRecords {
 public:
  static constexpr char blank = ' ';  // as a separator: any number of blanks; a field is empty only if it is in quotes

  /// `first_line`: line of its file at which the text starts.
  CsvRecords(std::string_view text, char separator, std::size_t first_line = 1)
      : rest_(text), separator_(separator), next_line_(first_line) {}

  enum class Read : unsigned char {
    record,
    end,
    broken_quote,  // the quote is not closed, or is followed by more text
  };
  /// Reads the next record, including a line without any text: one empty field, or none if blanks are the separator.
  [[nodiscard]] Read next(std::vector<CsvField>& fields);
  /// Line at which the record that was read last starts.
  [[nodiscard]] std::size_t line() const { return line_; }
  /// True if that record ends in a line end; the last one of a text may end without.
  [[nodiscard]] bool has_line_end() const { return has_line_end_; }

 private:
  [[nodiscard]] bool is_at_line_end() const { return rest_.empty() || rest_.front() == '\n' || rest_.front() == '\r'; }
  [[nodiscard]] bool is_at_separator() const { return !rest_.empty() && rest_.front() == separator_; }
  void skip_blanks();
  void skip_line_end();
  bool read_quoted(CsvField& field);
  CsvField read_plain();

  std::string_view rest_;
  char separator_;
  std::size_t line_ = 0;
  bool has_line_end_ = false;
  std::size_t next_line_;
};

}  // namespace bmu::cell
