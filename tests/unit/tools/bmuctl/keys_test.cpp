// Key sequences of a terminal, complete and in pieces.
#include "tools/bmuctl/keys.hpp"

#include "tests/support/catch.hpp"

namespace bmu {

namespace {

/// "a" for a letter, "<up>" and so on for others.
std::string text_of(const std::vector<Key>& keys) {
  std::string text;
  for (const Key& key : keys) {
    switch (key.kind) {
      case KeyKind::letter: text += key.letter; break;
      case KeyKind::up: text += "<up>"; break;
      case KeyKind::down: text += "<down>"; break;
      case KeyKind::page_up: text += "<page up>"; break;
      case KeyKind::page_down: text += "<page down>"; break;
      case KeyKind::home: text += "<home>"; break;
      case KeyKind::end: text += "<end>"; break;
      case KeyKind::escape: text += "<escape>"; break;
    }
  }
  return text;
}

std::string keys_in(std::string_view bytes) {
  KeyReader reader;
  return text_of(reader.take(bytes)) + text_of(reader.pause());
}

}  // namespace

TEST_CASE("cursor keys are understood as every kind of terminal sends them", "[unit][bmuctl]") {
  CHECK(keys_in("q") == "q");
  CHECK(keys_in("\033[A\033OA\033[B\033OB") == "<up><up><down><down>");
  CHECK(keys_in("\033[5~\033[6~") == "<page up><page down>");
  CHECK(keys_in("\033[H\033[1~\033[7~\033OH") == "<home><home><home><home>");
  CHECK(keys_in("\033[F\033[4~\033[8~\033OF") == "<end><end><end><end>");
}

TEST_CASE("a key that nobody asked for is none, and what follows it is still one", "[unit][bmuctl]") {
  CHECK(keys_in("\033[15~q") == "q");
  CHECK(keys_in("\033[1;5Cq") == "q");
  CHECK(keys_in("\033Pq") == "q");
}

TEST_CASE("a sequence that arrives in pieces is one key, an escape alone is the escape key", "[unit][bmuctl]") {
  KeyReader reader;
  CHECK(reader.take("\033").empty());
  CHECK(reader.take("[").empty());
  CHECK(text_of(reader.take("5")).empty());
  CHECK(text_of(reader.take("~j")) == "<page up>j");
  CHECK(reader.pause().empty());
  CHECK(reader.take("\033").empty());
  CHECK(text_of(reader.pause()) == "<escape>");
  CHECK(text_of(reader.take("\033\033[A")) == "<escape><up>");
  CHECK(reader.take("\033[1").empty());
  CHECK(reader.pause().empty());  // truncated, and discarded
  CHECK(text_of(reader.take("q")) == "q");
}

}  // namespace bmu
