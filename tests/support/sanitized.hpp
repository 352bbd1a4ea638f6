// Whether a sanitizer watches this program, and so what is built with it: memory and locks of pages are then not those
// of what is shipped.
#pragma once

namespace bmu::test {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool is_sanitized = true;
#elif defined(__has_feature)
constexpr bool is_sanitized = __has_feature(address_sanitizer) || __has_feature(thread_sanitizer);
#else
constexpr bool is_sanitized = false;
#endif

}  // namespace bmu::test
