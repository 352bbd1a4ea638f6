// What the fuzz targets share. A target is one file with one function: it is given any bytes at all, makes of them what
// a stranger might send, and ends the process if the parser behind it breaks a promise. libFuzzer calls it millions of
// times with bytes it makes up (explore.sh); replay.cpp calls it with the files of corpora/, with any compiler, in the
// normal run.
//
//   extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
//     const auto parsed = parse(fuzz::text_of(data, size));
//     if (parsed) FUZZ_CHECK(parse(print(*parsed)) == *parsed);
//     return 0;
//   }
//
// The same bytes always go the same way: nothing is kept from one input to the next but what is never changed, and no
// clock is read. That a parser does not crash is what the sanitizers see; what a target is there for are the promises.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string_view>
#include <type_traits>
#include <vector>

// NOLINTNEXTLINE(readability-identifier-naming): libFuzzer's name
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace bmu::fuzz {

[[noreturn]] inline void promise_broken(const char* promise, const char* file, int line) {
  std::fprintf(stderr, "%s:%d: does not hold: %s\n", file, line, promise);
  std::abort();
}

[[nodiscard]] inline std::string_view text_of(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

/// Up to each `end` and behind the last one, unless nothing is there; without the `end`. At most so many.
[[nodiscard]] inline std::vector<std::string_view> pieces_of(std::string_view text, std::string_view end,
                                                             std::size_t count_max = SIZE_MAX) {
  std::vector<std::string_view> pieces;
  while (!text.empty() && pieces.size() < count_max) {
    const std::size_t length = std::min(text.find(end), text.size());
    pieces.push_back(text.substr(0, length));
    text.remove_prefix(std::min(length + end.size(), text.size()));
  }
  return pieces;
}
[[nodiscard]] inline std::vector<std::string_view> lines_of(std::string_view text, std::size_t count_max = SIZE_MAX) {
  return pieces_of(text, "\n", count_max);
}

/// Numbers out of the input, one after the other, the lowest byte first; behind its end all are 0.
class Numbers {
 public:
  Numbers(const std::uint8_t* data, std::size_t size) : at_(data), end_(data + size) {}

  template <class Number>
  [[nodiscard]] Number next() {
    static_assert(std::is_integral_v<Number>);
    std::uint64_t number = 0;
    for (std::size_t byte = 0; byte < sizeof(Number) && at_ != end_; ++byte) {
      number |= std::uint64_t{*at_++} << (8 * byte);
    }
    return static_cast<Number>(number);
  }
  [[nodiscard]] bool is_empty() const { return at_ == end_; }

 private:
  const std::uint8_t* at_;
  const std::uint8_t* end_;
};

}  // namespace bmu::fuzz

/// A promise of the parser. Always on, and ends the process: that is how libFuzzer knows.
#define FUZZ_CHECK(promise) \
  ((promise) ? static_cast<void>(0) : ::bmu::fuzz::promise_broken(#promise, __FILE__, __LINE__))
