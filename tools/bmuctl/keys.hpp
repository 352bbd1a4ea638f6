// Converts the bytes of a terminal to keys: letters as they are, and the sequences of cursor keys, which may arrive in
// pieces.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace bmu {

enum class KeyKind : std::uint8_t { letter, up, down, page_up, page_down, home, end, escape };

struct Key {
  KeyKind kind = KeyKind::letter;
  char letter = 0;  // of a letter; including control characters
};

class KeyReader {
 public:
  /// All keys that are complete now. Sequences of other keys are ignored.
  [[nodiscard]] std::vector<Key> take(std::string_view bytes);
  /// Called when no byte arrived within a wait: a pending start of a sequence was the escape key.
  [[nodiscard]] std::vector<Key> pause();

 private:
  std::string pending_;
};

}  // namespace bmu
