// Result<T, E>: a value or the reason why there is none.
#pragma once

#include <tl/expected.hpp>

namespace bmu {

template <class T, class E>
using Result = tl::expected<T, E>;

/// The error side of a Result: `return failure(DecodeError::bad_crc);`
template <class E>
[[nodiscard]] constexpr tl::unexpected<std::decay_t<E>> failure(E&& error) {
  return tl::unexpected<std::decay_t<E>>(std::forward<E>(error));
}

}  // namespace bmu
