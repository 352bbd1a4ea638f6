// Splits the bytes of a serial port into lines, whatever arrives: ended by CR, LF or CR LF, and dropped completely
// where they are too long or contain characters that no keyboard sends.
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
    unprintable,  // a byte that is not printable ASCII; no text
  };

  Kind kind = Kind::good;
  std::string text{};
};

class SerialLines {
 public:
  static constexpr std::size_t line_max = 64;

  /// A line, if this byte ends one. Empty lines are dropped.
  [[nodiscard]] std::optional<SerialLine> take(char byte);
  /// Drops the partial line of a user who hung up.
  void forget();

 private:
  SerialLine line_;
  bool was_cr_ = false;
};

}  // namespace bmu
