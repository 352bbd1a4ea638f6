#include "tools/bmudump/text_writer.hpp"

#include <cerrno>

#include <poll.h>
#include <unistd.h>

namespace bmu::dump {
namespace {

constexpr std::array<char, 200> digit_pairs = [] {
  std::array<char, 200> pairs{};
  for (std::size_t number = 0; number < 100; ++number) {
    pairs[2 * number] = static_cast<char>('0' + number / 10);
    pairs[2 * number + 1] = static_cast<char>('0' + number % 10);
  }
  return pairs;
}();

constexpr std::string_view hex_digits = "0123456789ABCDEF";

char* pair_before(char* at, std::uint64_t below_100) {
  at -= 2;
  std::memcpy(at, &digit_pairs[2 * below_100], 2);
  return at;
}

char* digit_before(char* at, std::uint64_t below_10) {
  *--at = static_cast<char>('0' + below_10);
  return at;
}

}  // namespace

TextWriter::TextWriter(int fd)
    : fd_(fd), buffer_(std::make_unique<char[]>(buffer_size)), at_(buffer_.get()), limit_(at_ + buffer_size) {}

void TextWriter::scaled(std::int64_t steps, int decimals) {
  constexpr std::size_t room = 32;
  std::array<char, room> digits;  // NOLINT(cppcoreguidelines-pro-type-member-init): filled from its end
  char* const end = digits.data() + room;
  char* at = end;
  auto left = steps < 0 ? 0 - static_cast<std::uint64_t>(steps) : static_cast<std::uint64_t>(steps);
  for (; decimals >= 2; decimals -= 2, left /= 100) at = pair_before(at, left % 100);
  if (decimals == 1) {
    at = digit_before(at, left % 10);
    left /= 10;
  }
  if (at != end) *--at = '.';
  for (; left >= 100; left /= 100) at = pair_before(at, left % 100);
  at = left >= 10 ? pair_before(at, left) : digit_before(at, left);
  if (steps < 0) *--at = '-';
  text({at, static_cast<std::size_t>(end - at)});
}

void TextWriter::hex(std::uint32_t number, int digits) {
  while (digits-- > 0) letter(hex_digits[(number >> (4 * digits)) & 0xF]);
}

void TextWriter::json_string(std::string_view some) {
  letter('"');
  for (const char one : some) {
    const auto code = static_cast<unsigned char>(one);
    if (code < 0x20 || code >= 0x7F) {
      text("\\u00");
      hex(code, 2);
      continue;
    }
    if (one == '"' || one == '\\') letter('\\');
    letter(one);
  }
  letter('"');
}

void TextWriter::flush() {
  const char* from = buffer_.get();
  while (from < at_ && error_ == 0) {
    const ssize_t written = ::write(fd_, from, static_cast<std::size_t>(at_ - from));
    if (written >= 0) {
      from += written;
    } else if (errno == EAGAIN) {
      pollfd ready{fd_, POLLOUT, 0};  // another process made the output non-blocking: a shell sharing the terminal
      ::poll(&ready, 1, -1);
    } else if (errno != EINTR) {
      error_ = errno;
    }
  }
  at_ = buffer_.get();
}

}  // namespace bmu::dump
