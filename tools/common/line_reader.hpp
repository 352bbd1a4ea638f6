// Lines of a file or pipe, plain or compressed (packed_text.hpp), in bounded memory. A line longer than the buffer is
// reported with its beginning and skipped to its newline. The file is read, not mapped: mapped pages of a large log
// would count as memory of this process.
//
//   LineReader reader(fd);
//   LineReader::Line line;
//   do {
//     while (reader.take(line)) ...
//   } while (reader.fill() is not end or error);      damaged: report reader.damage(), continue
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string_view>

#include "tools/common/packed_text.hpp"

namespace bmu {

class LineReader {
 public:
  static constexpr std::size_t buffer_size = 262'144;

  struct Line {
    std::string_view text;  // without newline; valid until the next fill()
    bool is_too_long = false;
    bool has_end = true;  // false: the file's last line, without a newline; its writer may have been interrupted
  };
  enum class Filled : std::uint8_t { more, end, interrupted, damaged, error };

  explicit LineReader(int fd) : packed_(fd), buffer_(std::make_unique<char[]>(buffer_size)) {}

  /// The next line, if it is in the buffer; else call fill() first. At the end of the file the last line is complete
  /// without a newline; before a damaged range it is truncated, and omitted.
  [[nodiscard]] bool take(Line& line);
  /// Reads more bytes. On error, errno is set.
  [[nodiscard]] Filled fill();
  /// Bytes in the buffer that were not taken yet; the last line may be incomplete.
  [[nodiscard]] std::string_view ahead() const { return {buffer_.get() + begin_, end_ - begin_}; }
  /// Number of the line taken last, from 1. A truncated line is counted.
  [[nodiscard]] std::uint64_t line_number() const { return line_number_; }
  /// Of the last fill() that returned `damaged`.
  [[nodiscard]] const PackedText::Damage& damage() const { return packed_.damage(); }

 private:
  bool skip_rest_of_line();
  void drop_torn_line();

  PackedText packed_;
  std::unique_ptr<char[]> buffer_;
  std::size_t begin_ = 0;  // of the bytes not taken yet
  std::size_t end_ = 0;    // of the bytes read
  std::uint64_t line_number_ = 0;
  bool is_at_end_ = false;
  bool is_skipping_ = false;
};

}  // namespace bmu
