// Numbers from CSV files, packed with gzip or not, for those who know which columns they want: recordings, tables of
// test benches. The error is one line: file, line, column, what was found and what was wanted.
#pragma once

#include <array>
#include <cstddef>
#include <exception>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include <libfccp/csv.h>

#include "protocol/result.hpp"

namespace bmu::cell {

template <std::size_t Columns>
struct CsvFile {
  std::array<bool, Columns> has_column{};
  std::vector<std::array<double, Columns>> rows;  // not a number where nothing was measured
};

/// What is asked of a file.
template <std::size_t Columns>
struct CsvWish {
  std::array<std::string, Columns> names;  // of the columns, in any order in the file; others are passed over
  std::size_t needed = Columns;            // the first so many must be there
  std::size_t always = Columns;            // the first so many must have a number in every row
  std::string head;                        // the first line that was wanted, in words
};

namespace csv {

/// The end of a message, behind the name of the file.
struct Wrong {
  std::string text;
};

using Source = std::unique_ptr<io::ByteSourceBase>;
/// The file, unpacked while it is read if it is packed.
[[nodiscard]] Result<Source, std::string> open(const std::filesystem::path& file);
/// An empty field, or "nan", was not measured. Throws Wrong if it is no number, or has to be one.
[[nodiscard]] double number_from(const char* text, const std::string& column, unsigned line, bool is_always);
/// Runs a reading and makes an error of whatever it throws. The library's own messages name the file twice or not at
/// all, and not what was wanted.
[[nodiscard]] std::string problem_of(const std::string& name, const std::exception_ptr& thrown);

template <class Reader, std::size_t Columns, std::size_t... At>
CsvFile<Columns> read_rows(Reader& reader, const CsvWish<Columns>& wish, std::index_sequence<At...> /*columns*/) {
  reader.read_header(io::ignore_missing_column | io::ignore_extra_column, wish.names[At]...);
  CsvFile<Columns> result{.has_column = {reader.has_column(wish.names[At])...}};
  for (std::size_t column = 0; column < wish.needed; ++column) {
    if (!result.has_column[column]) throw Wrong{": no column '" + wish.names[column] + "'; wanted " + wish.head};
  }
  std::array<const char*, Columns> texts{};
  texts.fill("");
  while (reader.read_row(texts[At]...)) {
    result.rows.push_back({number_from(texts[At], wish.names[At], reader.get_file_line(), At < wish.always)...});
  }
  if (result.rows.empty()) throw Wrong{": no rows after the first line"};
  return result;
}

}  // namespace csv

template <std::size_t Columns>
[[nodiscard]] Result<CsvFile<Columns>, std::string> read_csv(const std::filesystem::path& file,
                                                             const CsvWish<Columns>& wish) {
  Result<csv::Source, std::string> source = csv::open(file);
  if (!source) return failure(source.error());
  try {
    io::CSVReader<Columns, io::trim_chars<' ', '\t', '\r'>> reader(file.string(), std::move(*source));
    return csv::read_rows(reader, wish, std::make_index_sequence<Columns>{});
  } catch (...) {
    return failure(csv::problem_of(file.string(), std::current_exception()));
  }
}

}  // namespace bmu::cell
