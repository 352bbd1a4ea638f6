// Numbers and failures as text, for output that is printed once and not a million times a second.
#pragma once

#include <string>

#include "tools/bmudump/statistics.hpp"
#include "tools/common/formatted.hpp"

namespace bmu::dump {

/// "CSC_STATUS number 2" if that is the maker's number and no node of a pack; else "CELLS_1 node 3"; "unknown" without
/// a message.
[[nodiscard]] std::string name_text(const MessageSpec* message, std::uint8_t node);
/// "wrong crc 2, late 1, unknown 5"; empty if all passed, or all are unknown.
[[nodiscard]] std::string failures_text(const IdStatistics& row);

}  // namespace bmu::dump
