// Cause of an opening of the contactors; event.hpp has its text.
#pragma once

#include <cstdint>

namespace bmu {

enum class OpeningCause : std::uint8_t {
  none,
  fault,
  request_over,  // vehicle off and charger disconnected
  shut_down,
  precharge_retry,  // too slow, with an attempt left
  permission,       // withdrawn without a (confirmed) fault: see the blocker
};

}  // namespace bmu
