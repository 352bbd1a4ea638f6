// Lines of a file or pipe in bounded memory. A line longer than the buffer is reported with its beginning and skipped
// to its newline. Read, not mapped: mapped pages of a large log would count as our memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string_view>

namespace bmu::dump {

class LineReader {
 public:
  static constexpr std::size_t buffer_size = 262'144;

  struct Line {
    std::string_view text;  // without newline; valid until the next fill()
    bool is_too_long = false;
  };
  enum class Filled : std::uint8_t { more, end, interrupted, error };

  explicit LineReader(int fd) : fd_(fd), buffer_(std::make_unique<char[]>(buffer_size)) {}

  /// The next line, if it is here; if not, fill() first. After the end of the file its last line is complete without
  /// a newline, too.
  [[nodiscard]] bool take(Line& line);
  /// Reads once more. On error, errno tells.
  [[nodiscard]] Filled fill();
  /// Number of the line taken last, from 1.
  [[nodiscard]] std::uint64_t line_number() const { return line_number_; }

 private:
  bool skip_rest_of_line();

  int fd_;
  std::unique_ptr<char[]> buffer_;
  std::size_t begin_ = 0;  // of what was not taken yet
  std::size_t end_ = 0;    // of what was read
  std::uint64_t line_number_ = 0;
  bool is_at_end_ = false;
  bool is_skipping_ = false;
};

}  // namespace bmu::dump
