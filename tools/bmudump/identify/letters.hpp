// Text in a frame: names of products, marks of makers.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "protocol/signal.hpp"

namespace bmu::dump {

/// Text of a quantity without a number: up to eight letters, the first in the highest byte.
struct Letters {
  std::array<char, 8> bytes{};
  std::size_t count = 0;

  [[nodiscard]] std::string_view view() const { return {bytes.data(), count}; }
};
[[nodiscard]] Letters letters_of(const SignalSpec& signal, std::int64_t raw);

/// Number of printable letters at the start, spaces included.
[[nodiscard]] std::size_t printable_count(std::string_view letters);

/// True for printable letters followed only by zeros. Other bytes under the identifier of a name are from another
/// device: 621h is the product's version on one bus, and cells' temperatures on that of an Outlander's modules.
[[nodiscard]] bool is_text(std::string_view letters);

}  // namespace bmu::dump
