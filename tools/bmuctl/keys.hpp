// Keys out of the bytes that a terminal sends for them: letters as they are, and the sequences of cursor keys, which
// may arrive in pieces.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace bmu {

enum class KeyKind : std::uint8_t { letter, up, down, page_up, page_down, home, end, escape };

struct Key {
  KeyKind kind = KeyKind::letter;
  char letter = 0;  // of a letter; control characters, too
};

class KeyReader {
 public:
  /// All keys that are complete now. Sequences of other keys are left out.
  [[nodiscard]] std::vector<Key> take(std::string_view bytes);
  /// Nothing has come for a while: what looked like the beginning of a sequence was the escape key.
  [[nodiscard]] std::vector<Key> pause();

 private:
  std::string pending_;
};

}  // namespace bmu
