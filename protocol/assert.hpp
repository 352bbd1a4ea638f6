// BMU_ASSERT: what must hold if our own code is right. Always on. A violated one aborts: the contactor command then
// expires at the receiver within 200 ms and the pack is open, which beats going on with a state nobody understands.
#pragma once

#include <cstdio>
#include <cstdlib>

namespace bmu {

[[noreturn]] inline void assertion_failed(const char* expression, const char* file, int line) {
  std::fprintf(stderr, "bmud: bug: %s does not hold (%s:%d)\n", expression, file, line);
  std::abort();
}

}  // namespace bmu

#define BMU_ASSERT(expression) \
  ((expression) ? static_cast<void>(0) : ::bmu::assertion_failed(#expression, __FILE__, __LINE__))
