// FNV-1a, 64 bits, to distinguish two texts and to detect a damaged one; no protection against an attacker. Each step
// is a bijection of the state, so that one changed byte always changes the result.
#pragma once

#include <cstdint>
#include <string_view>

namespace bmu {

inline constexpr std::uint64_t fnv_start = 0xCBF2'9CE4'8422'2325;
inline constexpr std::uint64_t fnv_prime = 0x0000'0100'0000'01B3;

/// Hash of the bytes hashed so far followed by `bytes`.
[[nodiscard]] constexpr std::uint64_t continue_fnv(std::uint64_t hash, std::string_view bytes) {
  for (const char c : bytes) {
    hash ^= static_cast<std::uint8_t>(c);
    hash *= fnv_prime;
  }
  return hash;
}
static_assert(continue_fnv(fnv_start, "foobar") == 0x85944171F73967E8);

}  // namespace bmu
