// Pack with another number of cells than its file has: the file's text with that one number changed, read and checked
// like any other.
#pragma once

#include <cstddef>

#include "config/pack_config.hpp"

namespace bmu {

/// Precondition: a pack with one module. More cells than one module can have are spread over the minimum number of
/// modules, at most serial/modules_max, as evenly as possible, the first ones with one more: 13 cells are 7 and 6, as a
/// front end needs enough cells for its supply. The others are like the module of the file, at the following node
/// numbers, each identified by the serial number that is found there. Errors due to the number are reported as for a
/// file that has it. The hash is another one.
[[nodiscard]] Result<PackConfig, ConfigProblems> with_cell_count(const PackConfig& pack, std::size_t cell_count);

}  // namespace bmu
