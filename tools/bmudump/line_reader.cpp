#include "tools/bmudump/line_reader.hpp"

#include <cerrno>
#include <cstring>

#include <unistd.h>

namespace bmu::dump {

bool LineReader::take(Line& line) {
  if (is_skipping_ && !skip_rest_of_line()) return false;
  const char* const first = buffer_.get() + begin_;
  const std::size_t left = end_ - begin_;
  if (left == 0) return false;
  const auto* const newline = static_cast<const char*>(std::memchr(first, '\n', left));
  const bool is_full = newline == nullptr && left == buffer_size;
  if (newline == nullptr && !is_full && !is_at_end_) return false;
  const std::size_t length = newline == nullptr ? left : static_cast<std::size_t>(newline - first);
  line = {{first, length}, is_full};
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
  const ssize_t count = ::read(fd_, buffer_.get() + end_, buffer_size - end_);
  if (count < 0) return errno == EINTR ? Filled::interrupted : Filled::error;
  end_ += static_cast<std::size_t>(count);
  const bool was_at_end = is_at_end_;
  is_at_end_ = count == 0;
  return is_at_end_ && (was_at_end || end_ == 0) ? Filled::end : Filled::more;
}

}  // namespace bmu::dump
