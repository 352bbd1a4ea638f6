#include "tools/bmudump/identify/letters.hpp"

#include <algorithm>

namespace bmu::dump {

Letters letters_of(const SignalSpec& signal, std::int64_t raw) {
  Letters letters{.count = signal.bit_count / 8U};
  for (std::size_t index = 0; index < letters.count; ++index) {
    letters.bytes[index] = static_cast<char>(static_cast<std::uint64_t>(raw) >> (8 * (letters.count - 1 - index)));
  }
  return letters;
}

std::size_t printable_count(std::string_view letters) {
  const auto is_printable = [](char one) { return one >= ' ' && one <= '~'; };
  const auto* const end = std::find_if_not(letters.begin(), letters.end(), is_printable);
  return static_cast<std::size_t>(end - letters.begin());
}

bool is_text(std::string_view letters) {
  const std::string_view rest = letters.substr(printable_count(letters));
  return std::all_of(rest.begin(), rest.end(), [](char one) { return one == '\0'; });
}

}  // namespace bmu::dump
