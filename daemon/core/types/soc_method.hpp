// Methods for estimating the SOC.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

namespace bmu {

enum class SocMethod : unsigned char { ekf, mixed, coulomb };
inline constexpr std::size_t soc_methods = 3;
inline constexpr std::array<std::string_view, soc_methods> soc_method_names{"ekf", "mixed", "coulomb"};
[[nodiscard]] constexpr std::string_view to_text(SocMethod method) {
  return soc_method_names[static_cast<std::size_t>(method)];
}

}  // namespace bmu
