// Base64 text of bytes by RFC 4648, with padding.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace bmu {

[[nodiscard]] std::string to_base64(std::span<const std::uint8_t> bytes);
/// Appends the bytes of `text`; false, and perhaps a part of them appended, if it is not base64 of whole bytes.
[[nodiscard]] bool append_base64(std::string_view text, std::vector<std::uint8_t>& to);

}  // namespace bmu
