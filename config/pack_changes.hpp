// What differs between two packs, for people: each value of the pack file, and of the cell's, that is another one now.
#pragma once

#include <string>
#include <vector>

#include "config/pack_config.hpp"

namespace bmu {

struct PackChange {
  std::string file;
  std::string path;    // JSON pointer, "/limits/cell_overvoltage/open_mV"
  std::string before;  // as a message shows it; "" where there was none
  std::string now;     // "" where there is none any more
};

/// "pack.json: /poll/period_ms: 100, now 50"; "... not there, now 50"; "... 100, now not there"
[[nodiscard]] std::string to_text(const PackChange& change);

/// Of two packs that were read, in the order of the keys. Empty although the texts differ where only comments or blanks
/// do. Lists are compared by place: a module put in front changes all behind it.
[[nodiscard]] std::vector<PackChange> pack_changes(const PackSources& before, const PackSources& now);

}  // namespace bmu
