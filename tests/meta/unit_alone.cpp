// An integrator of the module unit on a microcontroller must provide the handler of a violated BMU_ASSERT.
// microcontroller.sh links the unit with this one in place of the library's, which prints.
#include "protocol/assert.hpp"

namespace bmu {

void assertion_failed(const char* /*expression*/, const char* /*file*/, int /*line*/) {
  for (volatile bool is_stuck = true; is_stuck;) {
  }
  __builtin_unreachable();
}

}  // namespace bmu
