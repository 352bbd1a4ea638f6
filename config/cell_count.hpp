// A pack with another number of cells than its file has: the file's text with that one number changed, read and
// checked as any other.
#pragma once

#include <cstddef>

#include "config/pack_config.hpp"

namespace bmu {

/// Of a pack with one module. What the number makes wrong is told as of a file that has it. Its hash is another one.
[[nodiscard]] Result<PackConfig, ConfigProblems> with_cell_count(const PackConfig& pack, std::size_t cell_count);

}  // namespace bmu
