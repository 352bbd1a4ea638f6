// BMU_ASSERT: what must hold if our own code is right. Always on. A violated one aborts: the contactor command then
// expires at the receiver within 200 ms and the pack is open, which beats going on with a state nobody understands.
#pragma once

namespace bmu {

/// Says what does not hold on stderr and aborts. Who links these parts into something without either defines it
/// himself, before the library; it must not return.
[[noreturn]] void assertion_failed(const char* expression, const char* file, int line);

}  // namespace bmu

#define BMU_ASSERT(expression) \
  ((expression) ? static_cast<void>(0) : ::bmu::assertion_failed(#expression, __FILE__, __LINE__))
