#include "daemon/shell/json/json_text.hpp"

#include <algorithm>
#include <array>
#include <charconv>

#include <nlohmann/json.hpp>

namespace bmu {

namespace {

std::string dumped(const nlohmann::ordered_json& tree) {
  return tree.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

/// Whether a character stands in a JSON text unescaped. A table, because it is read for each character.
constexpr std::array<bool, 256> plain_table = [] {
  std::array<bool, 256> is_plain{};
  for (std::size_t one = ' '; one < 0x80; ++one) is_plain.at(one) = one != '"' && one != '\\';
  return is_plain;
}();

bool is_plain(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char one) { return plain_table[static_cast<unsigned char>(one)]; });
}

template <class Number>
std::string_view number_text(Number value, std::array<char, 24>& room) {
  return {room.data(), std::to_chars(room.data(), room.data() + room.size(), value).ptr};
}

}  // namespace

/// Writes a comma where needed. A text ends with a quote, a number and a word with other characters, so the last
/// character shows which of them precedes.
void JsonText::separate() {
  if (text_.empty()) return;
  const char last = text_.back();
  if (last != '{' && last != '[' && last != ':') text_.push_back(',');
}

void JsonText::open(char bracket) {
  separate();
  text_.push_back(bracket);
}

void JsonText::key(std::string_view name) {
  separate();
  quote(name);
  text_.push_back(':');
}

/// Few texts need escaping, and for these the function of the library, which handles all of UTF-8, is fast enough.
void JsonText::quote(std::string_view text) {
  if (!is_plain(text)) {
    text_ += dumped(text);
    return;
  }
  const std::size_t begin = text_.size();
  text_.resize(begin + text.size() + 2, '"');
  text.copy(text_.data() + begin + 1, text.size());
}

void JsonText::add(std::string_view value) {
  separate();
  quote(value);
}

void JsonText::add_word(std::string_view word) {
  separate();
  text_ += word;
}

void JsonText::add_signed(std::int64_t value) {
  std::array<char, 24> room{};
  add_word(number_text(value, room));
}

void JsonText::add_unsigned(std::uint64_t value) {
  std::array<char, 24> room{};
  add_word(number_text(value, room));
}

void JsonText::add_tree(const nlohmann::ordered_json& tree) {
  add_word(dumped(tree));
}

}  // namespace bmu
