#include "tools/common/line_reader.hpp"

#include <cstring>

namespace bmu {

bool LineReader::take(Line& line) {
  if (is_skipping_ && !skip_rest_of_line()) return false;
  const char* const first = buffer_.get() + begin_;
  const std::size_t left = end_ - begin_;
  if (left == 0) return false;
  const auto* const newline = static_cast<const char*>(std::memchr(first, '\n', left));
  const bool is_full = newline == nullptr && left == buffer_size;
  if (newline == nullptr && !is_full && !is_at_end_) return false;
  const std::size_t length = newline == nullptr ? left : static_cast<std::size_t>(newline - first);
  line = {.text = {first, length}, .is_too_long = is_full, .has_end = newline != nullptr || is_full};
  begin_ += length + (newline == nullptr ? 0 : 1);
  is_skipping_ = is_full;
  ++line_number_;
  return true;
}

bool LineReader::skip_rest_of_line() {
  const char* const first = buffer_.get() + begin_;
  const void* const newline = std::memchr(first, '\n', end_ - begin_);
  if (newline == nullptr) {
    begin_ = end_;
    return false;
  }
  begin_ += static_cast<std::size_t>(static_cast<const char*>(newline) - first) + 1;
  is_skipping_ = false;
  return true;
}

LineReader::Filled LineReader::fill() {
  std::memmove(buffer_.get(), buffer_.get() + begin_, end_ - begin_);
  end_ -= begin_;
  begin_ = 0;
  const PackedText::Read read = packed_.read({buffer_.get() + end_, buffer_size - end_});
  switch (read.status) {
    case PackedText::Status::text: end_ += read.size; return Filled::more;
    case PackedText::Status::interrupted: return Filled::interrupted;
    case PackedText::Status::failed: return Filled::error;
    case PackedText::Status::damaged: drop_torn_line(); return Filled::damaged;
    case PackedText::Status::end: break;
  }
  const bool was_at_end = is_at_end_;
  is_at_end_ = true;
  return was_at_end || end_ == 0 ? Filled::end : Filled::more;
}

/// Drops the start of a line before a damaged range, because it could pass for a shorter line.
void LineReader::drop_torn_line() {
  if (end_ > 0) ++line_number_;
  end_ = 0;
  is_skipping_ = false;
}

}  // namespace bmu
