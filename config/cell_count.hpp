// A pack with another number of cells than its file has: the file's text with that one number changed, read and
// checked as any other.
#pragma once

#include <cstddef>

#include "config/pack_config.hpp"

namespace bmu {

/// Of a pack with one module. More cells than one module has are spread over as few as carry them, at most
/// serial/modules_max, as evenly as possible, the first ones with one more: 13 cells are 7 and 6, as a front end needs
/// enough cells to live on. The others are like the module of the file, at the node numbers behind its own, each known
/// by the serial number that is found there. What the number makes wrong is told as of a file that has it. Its hash is
/// another one.
[[nodiscard]] Result<PackConfig, ConfigProblems> with_cell_count(const PackConfig& pack, std::size_t cell_count);

}  // namespace bmu
