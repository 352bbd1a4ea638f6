#include "protocol/assert.hpp"

#include <cstdio>
#include <cstdlib>

namespace bmu {

void assertion_failed(const char* expression, const char* file, int line) {
  std::fprintf(stderr, "bmud: bug: %s does not hold (%s:%d)\n", expression, file, line);
  std::abort();
}

}  // namespace bmu
