#include "tools/bmuctl/keys.hpp"

#include <algorithm>
#include <array>

namespace bmu {

namespace {

constexpr char escape = '\033';

/// The bytes after the escape character. Terminals differ in which of these they send.
struct SequenceRow {
  std::string_view text;
  KeyKind kind;
};
constexpr std::array sequence_table{
    SequenceRow{"[A", KeyKind::up},    SequenceRow{"OA", KeyKind::up},       SequenceRow{"[B", KeyKind::down},
    SequenceRow{"OB", KeyKind::down},  SequenceRow{"[5~", KeyKind::page_up}, SequenceRow{"[6~", KeyKind::page_down},
    SequenceRow{"[H", KeyKind::home},  SequenceRow{"OH", KeyKind::home},     SequenceRow{"[1~", KeyKind::home},
    SequenceRow{"[7~", KeyKind::home}, SequenceRow{"[F", KeyKind::end},      SequenceRow{"OF", KeyKind::end},
    SequenceRow{"[4~", KeyKind::end},  SequenceRow{"[8~", KeyKind::end},
};

/// Number of bytes of the sequence after an escape; 0 if it is incomplete.
std::size_t sequence_length(std::string_view text) {
  if (text.empty()) return 0;
  if (text[0] == 'O') return text.size() < 2 ? 0 : 2;
  if (text[0] != '[') return 1;
  const auto end = std::find_if(text.begin() + 1, text.end(), [](char c) { return c >= '@' && c <= '~'; });
  return end == text.end() ? 0 : static_cast<std::size_t>(end - text.begin()) + 1;
}

}  // namespace

std::vector<Key> KeyReader::take(std::string_view bytes) {
  constexpr std::size_t sequence_max = 32;  // no key is longer: longer input is pasted text
  pending_ += bytes;
  std::vector<Key> keys;
  std::string_view left = pending_;
  while (!left.empty()) {
    if (left.front() != escape) {
      keys.push_back({.letter = left.front()});
      left.remove_prefix(1);
      continue;
    }
    if (left.size() > 1 && left[1] == escape) {
      keys.push_back({.kind = KeyKind::escape});
      left.remove_prefix(1);
      continue;
    }
    const std::size_t length = sequence_length(left.substr(1));
    if (length == 0) break;
    const std::string_view text = left.substr(1, length);
    const auto* const row = std::find_if(sequence_table.begin(), sequence_table.end(),
                                         [&](const SequenceRow& one) { return one.text == text; });
    if (row != sequence_table.end()) keys.push_back({.kind = row->kind});
    left.remove_prefix(1 + length);
  }
  pending_ = left.size() > sequence_max ? "" : std::string(left);
  return keys;
}

std::vector<Key> KeyReader::pause() {
  const bool is_escape = pending_.size() == 1;
  pending_.clear();
  return is_escape ? std::vector<Key>{{.kind = KeyKind::escape}} : std::vector<Key>{};
}

}  // namespace bmu
