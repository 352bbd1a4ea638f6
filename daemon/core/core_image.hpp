// Complete state of a core, as bytes: a core with the same configuration that reads them continues exactly as the first
// one would have. For recordings that start in the middle of a session.
//
//   std::vector<std::uint8_t> bytes(core_image_size(core));
//   write_core_image(core, bytes);
//   Core other(config, TimePoint{});
//   if (const auto problem = read_core_image(bytes, other)) ...   // then `other` must not be used
//
// Values that follow from the configuration are not included; the caller has to check the configuration's hash. Only a
// build with the same members of the core can read the bytes: core_image_layout identifies them, and is the same for
// every compiler.
//
// No allocation. Cost and size: docs/performance.md.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "daemon/core/core.hpp"
#include "protocol/image.hpp"

namespace bmu {

[[nodiscard]] std::uint64_t core_image_layout();
[[nodiscard]] std::size_t core_image_size(const Core& core);
/// Precondition: `to` has the size core_image_size().
void write_core_image(const Core& core, std::span<std::uint8_t> to);
[[nodiscard]] std::optional<ImageProblem> read_core_image(std::span<const std::uint8_t> bytes, Core& core);

}  // namespace bmu
