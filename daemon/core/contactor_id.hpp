// The contactors, as the bits of CONTACTOR_COMMAND count them.
#pragma once

#include <cstddef>
#include <cstdint>

namespace bmu {

enum class ContactorId : std::uint8_t { main_positive, main_negative, precharge, charge };
inline constexpr std::size_t contactor_id_count = 4;

}  // namespace bmu
