// BMU_ASSERT: checks an invariant of the program's own code. Always active. A violation aborts: the contactor command
// then expires at the receiver within 200 ms and the pack opens, which is safer than continuing in an undefined state.
#pragma once

namespace bmu {

/// Prints the failed expression on stderr and aborts. A target without stderr or abort() links its own definition
/// before this library; it must not return.
[[noreturn]] void assertion_failed(const char* expression, const char* file, int line);

}  // namespace bmu

#define BMU_ASSERT(expression) \
  ((expression) ? static_cast<void>(0) : ::bmu::assertion_failed(#expression, __FILE__, __LINE__))
