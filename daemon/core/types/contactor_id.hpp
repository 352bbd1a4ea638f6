// The contactors, in the order of the bits of CONTACTOR_COMMAND.
#pragma once

#include <cstddef>
#include <cstdint>

namespace bmu {

enum class ContactorId : std::uint8_t { main_positive, main_negative, precharge, charge };
inline constexpr std::size_t contactor_id_count = 4;

/// Number of a contactor in elements (pack_state.hpp) and flags, from 1; 0: none.
[[nodiscard]] constexpr std::uint8_t contactor_number(ContactorId id) {
  return static_cast<std::uint8_t>(1 + static_cast<std::uint8_t>(id));
}

}  // namespace bmu
