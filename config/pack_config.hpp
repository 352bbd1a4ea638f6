// Reader of a pack file, which is JSON: gives a complete, valid configuration, or every problem at once.
//
// Comments (// and /* */) are allowed anywhere, an unknown key is a problem, and a key that is a quantity ends with its
// unit. A cell type is a file of its own (config/cells/), named relative to the pack file, or an object in place.
// docs/configuration.md lists every key with unit, range and default.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "config/json/problem.hpp"
#include "config/types/pack.hpp"
#include "protocol/result.hpp"

namespace bmu {

/// Gives the buses other names than the file has, as the command line may: the names determine which roles share a bus.
void set_buses(PackConfig& pack, const BusNames& names);

/// Reads and checks a pack file and the cell file it names. Never throws; reports all problems, not only the first.
[[nodiscard]] Result<PackConfig, ConfigProblems> load_pack_config(const std::filesystem::path& file);

/// The same from text; `directory` is the base of a cell file's relative name.
[[nodiscard]] Result<PackConfig, ConfigProblems> parse_pack_config(std::string_view text, std::string_view file_name,
                                                                   const std::filesystem::path& directory);

/// The same from texts alone: no file is read.
[[nodiscard]] Result<PackConfig, ConfigProblems> parse_pack_config(const PackSources& sources);

}  // namespace bmu
