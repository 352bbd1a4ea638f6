// All that a core knows, as bytes: whoever reads them into a core with the same configuration has one that goes on
// exactly as the first would have. For recordings that begin in the middle of a life.
//
//   std::vector<std::uint8_t> bytes(core_image_size(core));
//   write_core_image(core, bytes);
//   Core other(config, TimePoint{});
//   if (const auto problem = read_core_image(bytes, other)) ...   // then `other` is good for nothing
//
// What follows from the configuration is not in it; the configuration's hash is up to whoever keeps both. Only a build
// whose core has the same members reads it: core_image_layout says so, and is the same for every compiler.
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
/// `to` has room for core_image_size().
void write_core_image(const Core& core, std::span<std::uint8_t> to);
[[nodiscard]] std::optional<ImageProblem> read_core_image(std::span<const std::uint8_t> bytes, Core& core);

}  // namespace bmu
