// Whether a sanitizer monitors this program, and so all of this build: use of memory and locked pages then differ from
// those of the shipped programs.
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
