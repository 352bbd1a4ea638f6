// Writes text to a file descriptor: one buffer, own number formatting, write(2).
//
// A million frames per second are too many for printf or iostreams: numbers are written two digits at a time and the
// fixed parts of a line are pieces prepared once. Appending does not check the free space; begin_line() guarantees
// line_room bytes, more than the longest line needs (frame_text.cpp and dump.cpp assert it).
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <string_view>

#include "protocol/assert.hpp"

namespace bmu::dump {

/// A short fixed text, copied with one block copy of constant size for any length.
class Piece {
 public:
  static constexpr std::size_t room = 64;

  Piece() = default;
  explicit Piece(std::string_view text) : length_(text.size()) {
    BMU_ASSERT(text.size() <= room);
    std::memcpy(text_.data(), text.data(), text.size());
  }
  /// Copies to `out`, which has `room` bytes, and returns the end of the text.
  char* copy_to(char* out) const {
    std::memcpy(out, text_.data(), room / 2);
    if (length_ > room / 2) std::memcpy(out + room / 2, text_.data() + room / 2, room / 2);
    return out + length_;
  }

 private:
  std::size_t length_ = 0;
  std::array<char, room> text_{};
};

class TextWriter {
 public:
  static constexpr std::size_t line_room = 12'288;

  explicit TextWriter(int fd);

  /// Makes room for a line; all text until the next call must fit line_room in total.
  void begin_line() {
    if (static_cast<std::size_t>(limit_ - at_) < line_room) flush();
  }
  /// The room made by begin_line(); a caller that writes there reports the number of bytes with take().
  [[nodiscard]] std::span<char> room() { return {at_, line_room}; }
  void take(std::size_t count) { at_ += count; }
  void letter(char one) { *at_++ = one; }
  void text(std::string_view some) { at_ = std::copy(some.begin(), some.end(), at_); }
  void piece(const Piece& one) { at_ = one.copy_to(at_); }
  void spaces(std::size_t count) {
    std::memset(at_, ' ', count);
    at_ += count;
  }
  void decimal(std::int64_t number) { scaled(number, 0); }
  /// Writes `steps` of the last digit shown, with `decimals` digits after the point: 36512 and 4 are 3.6512.
  void scaled(std::int64_t steps, int decimals);
  /// Exactly `digits` digits, leading zeros included.
  void hex(std::uint32_t number, int digits);
  /// Seconds with six decimals.
  void time(std::int64_t time_us) { scaled(time_us, 6); }
  /// In double quotes, escaped for JSON; bytes beyond ASCII as \u00XX, because valid UTF-8 is not guaranteed.
  void json_string(std::string_view some);

  void flush();
  /// Text that was written but not flushed; for callers that need text instead of a file.
  [[nodiscard]] std::string_view pending() const {
    return {buffer_.get(), static_cast<std::size_t>(at_ - buffer_.get())};
  }
  void drop_pending() { at_ = buffer_.get(); }
  /// True if the reader closed the output, or the system refused to write: `error` is the errno then. Further text is
  /// dropped.
  [[nodiscard]] bool is_closed() const { return error_ != 0; }
  [[nodiscard]] int error() const { return error_; }

 private:
  static constexpr std::size_t buffer_size = 262'144;

  int fd_;
  int error_ = 0;
  std::unique_ptr<char[]> buffer_;
  char* at_;
  char* limit_;
};

}  // namespace bmu::dump
