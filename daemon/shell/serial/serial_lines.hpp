// Lines out of the bytes of a serial line, whatever comes: ended by CR, LF or CR LF, and dropped whole where they are
// too long or hold what no keyboard sends.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

namespace bmu {

struct SerialLine {
  enum class Kind : std::uint8_t {
    good,
    too_long,     // more than line_max bytes; no text
    unprintable,  // a byte that is no printable ASCII; no text
  };

  Kind kind = Kind::good;
  std::string text{};
};

class SerialLines {
 public:
  static constexpr std::size_t line_max = 64;

  /// A line, if this byte ends one. Empty lines are none.
  [[nodiscard]] std::optional<SerialLine> take(char byte);
  /// What was begun belongs to somebody who hung up.
  void forget();

 private:
  SerialLine line_;
  bool was_cr_ = false;
};

}  // namespace bmu
