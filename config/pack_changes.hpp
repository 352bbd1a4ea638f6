// Differences between two packs, for display: each value of the pack file, and of the cell's, that has changed.
#pragma once

#include <string>
#include <vector>

#include "config/pack_config.hpp"

namespace bmu {

struct PackChange {
  std::string file;
  std::string path;    // JSON pointer, "/limits/cell_overvoltage/open_mV"
  std::string before;  // as a message shows it; "" if there was none
  std::string now;     // "" if there is none
};

/// "pack.json: /poll/period_ms: 100, now 50"; "... not there, now 50"; "... 100, now not there"
[[nodiscard]] std::string to_text(const PackChange& change);

/// Precondition: two packs that were read. In the order of the keys; empty if the texts differ only in comments or
/// blanks. Lists are compared by index: a module that is inserted at the front changes all after it.
[[nodiscard]] std::vector<PackChange> pack_changes(const PackSources& before, const PackSources& now);

}  // namespace bmu
