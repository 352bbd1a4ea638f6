// Eight characters at a time: every character at every position is checked and read as by a loop over characters.
#include <string>

#include "protocol/eight_letters.hpp"
#include "tests/support/catch.hpp"

namespace {

using namespace bmu;

constexpr std::string_view decimal_digits = "0123456789";
constexpr std::string_view hex_digits = "0123456789ABCDEFabcdef";

bool is_among(std::string_view letters, char letter) {
  return letters.find(letter) != std::string_view::npos;
}

static_assert(decimal_number(load_letters("17000000")) == 17'000'000);
static_assert(hex_number(load_letters("18FF50e5")) == 0x18FF50E5);

}  // namespace

TEST_CASE("of eight letters each is judged, at each place, between any others", "[unit][protocol][candump]") {
  for (const char others : {'0', '9', 'f', '\0', '\x7F', '\x80', '\xFF'}) {
    for (std::size_t place = 0; place < letters_at_once; ++place) {
      for (unsigned code = 0; code < 256; ++code) {
        std::string text(letters_at_once, others);
        const char letter = text[place] = static_cast<char>(code);
        INFO("byte " << code << " at " << place << " between " << static_cast<int>(others));
        const std::uint64_t letters = load_letters(text.data());
        REQUIRE(are_decimal(letters) == (is_among(decimal_digits, letter) && is_among(decimal_digits, others)));
        REQUIRE(are_hex(letters) == (is_among(hex_digits, letter) && is_among(hex_digits, others)));
        const std::uint64_t mark = (marks_between(letters, '!', '~') >> (8 * (7 - place))) & 0xFF;
        REQUIRE(mark == (code >= '!' && code <= '~' ? 0x80U : 0U));
      }
    }
  }
}

TEST_CASE("letters with a mark are counted up to the first without", "[unit][protocol][candump]") {
  std::string text(letters_at_once, 'x');
  CHECK(marked_at_start(marks_between(load_letters(text.data()), '!', '~')) == letters_at_once);
  for (std::size_t place = letters_at_once; place-- > 0;) {
    text[place] = place % 2 == 0 ? ' ' : '\xFF';
    CHECK(marked_at_start(marks_between(load_letters(text.data()), '!', '~')) == place);
  }
}

TEST_CASE("eight digits are the number they are", "[unit][protocol][candump]") {
  for (std::size_t place = 0; place < letters_at_once; ++place) {
    std::string text(letters_at_once, '0');
    for (const char digit : hex_digits) {
      text[place] = digit;
      CHECK(hex_number(load_letters(text.data())) == std::stoul(text, nullptr, 16));
      if (is_among(decimal_digits, digit)) CHECK(decimal_number(load_letters(text.data())) == std::stoul(text));
    }
  }
  CHECK(decimal_number(load_letters("99999999")) == 99'999'999);
  CHECK(decimal_number(load_letters("12345678")) == 12'345'678);
  CHECK(hex_number(load_letters("FFFFFFFF")) == 0xFFFF'FFFF);
  CHECK(hex_number(load_letters("89abCDEF")) == 0x89AB'CDEF);
}
