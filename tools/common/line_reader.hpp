// Lines of a file or pipe, plain or packed (packed_text.hpp), in bounded memory. A line longer than the
// buffer is reported with its beginning and skipped to its newline. Read, not mapped: mapped pages of a large log would
// count as our memory.
//
//   LineReader reader(fd);
//   LineReader::Line line;
//   do {
//     while (reader.take(line)) ...
//   } while (reader.fill() is not end or error);      damaged: tell reader.damage(), go on
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
    bool has_end = true;  // false: the file's last line, without a newline; whoever wrote it may have been cut off
  };
  enum class Filled : std::uint8_t { more, end, interrupted, damaged, error };

  explicit LineReader(int fd) : packed_(fd), buffer_(std::make_unique<char[]>(buffer_size)) {}

  /// The next line, if it is here; if not, fill() first. After the end of the file its last line is complete without
  /// a newline, too; before a damaged place it is torn, and left out.
  [[nodiscard]] bool take(Line& line);
  /// Reads once more. On error, errno tells.
  [[nodiscard]] Filled fill();
  /// What is here and was not taken yet; of its last line perhaps a part.
  [[nodiscard]] std::string_view ahead() const { return {buffer_.get() + begin_, end_ - begin_}; }
  /// Number of the line taken last, from 1. A torn line counts as one.
  [[nodiscard]] std::uint64_t line_number() const { return line_number_; }
  /// Of the last fill() that came back `damaged`.
  [[nodiscard]] const PackedText::Damage& damage() const { return packed_.damage(); }

 private:
  bool skip_rest_of_line();
  void drop_torn_line();

  PackedText packed_;
  std::unique_ptr<char[]> buffer_;
  std::size_t begin_ = 0;  // of what was not taken yet
  std::size_t end_ = 0;    // of what was read
  std::uint64_t line_number_ = 0;
  bool is_at_end_ = false;
  bool is_skipping_ = false;
};

}  // namespace bmu
