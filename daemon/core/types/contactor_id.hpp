// The contactors, as the bits of CONTACTOR_COMMAND count them.
#pragma once

#include <cstddef>
#include <cstdint>

namespace bmu {

enum class ContactorId : std::uint8_t { main_positive, main_negative, precharge, charge };
inline constexpr std::size_t contactor_id_count = 4;

/// As elements (pack_state.hpp) and flags count them: 0 is none.
[[nodiscard]] constexpr std::uint8_t contactor_number(ContactorId id) {
  return static_cast<std::uint8_t>(1 + static_cast<std::uint8_t>(id));
}

}  // namespace bmu
