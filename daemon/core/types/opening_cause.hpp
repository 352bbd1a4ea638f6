// Why the contactors opened; its text is event.hpp's.
#pragma once

#include <cstdint>

namespace bmu {

enum class OpeningCause : std::uint8_t {
  none,
  fault,
  request_over,  // vehicle off and charger gone
  shut_down,
  precharge_retry,  // too slow, but there is another try
  permission,       // withdrawn for a reason that is not (yet) a fault: see the blocker
};

}  // namespace bmu
