#include "tools/common/glyphs.hpp"

#include <clocale>
#include <cstdlib>
#include <cstring>

#include <langinfo.h>

namespace bmu {

const Glyphs pretty_glyphs{.contact_closed = "●",
                           .contact_open = "○",
                           .contact_differs = "◐",
                           .contact_unknown = "?",
                           .line = "─",
                           .corner_down = "┬",
                           .corner_end = "┬",
                           .low_left = "└",
                           .low_right = "┘",
                           .bar_full = "█",
                           .bar_empty = "░",
                           .lowest = "▼",
                           .highest = "▲",
                           .bullet = "●",
                           .minus = "−",
                           .cut = "…",
                           .levels = {"▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"}};

const Glyphs plain_glyphs{.contact_closed = "#",
                          .contact_open = "o",
                          .contact_differs = "~",
                          .contact_unknown = "?",
                          .line = "-",
                          .corner_down = "+",
                          .corner_end = "+",
                          .low_left = "+",
                          .low_right = "+",
                          .bar_full = "#",
                          .bar_empty = ".",
                          .lowest = "v",
                          .highest = "^",
                          .bullet = "*",
                          .minus = "-",
                          .cut = ">",
                          .levels = {"1", "2", "3", "4", "5", "6", "7", "8"}};

namespace {

/// A console's font has 256 or 512 characters, without small bars. A real terminal of the VT family has no others at
/// all.
bool has_few_signs(std::string_view terminal) {
  return terminal == "linux" || terminal.substr(0, 2) == "vt" || terminal == "ansi" || terminal == "dumb";
}

}  // namespace

const Glyphs& glyphs_for_locale() {
  // NOLINTNEXTLINE(concurrency-mt-unsafe): one thread
  const char* const terminal = std::getenv("TERM");
  if (terminal != nullptr && has_few_signs(terminal)) return plain_glyphs;
  // NOLINTNEXTLINE(concurrency-mt-unsafe): one thread
  if (std::setlocale(LC_CTYPE, "") == nullptr) return plain_glyphs;
  return std::strcmp(nl_langinfo(CODESET), "UTF-8") == 0 ? pretty_glyphs : plain_glyphs;
}

}  // namespace bmu
