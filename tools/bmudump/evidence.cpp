#include "tools/bmudump/evidence.hpp"

#include <algorithm>

namespace bmu::dump {

Evidence::PartSeen& Evidence::at(std::size_t part) {
  parts_.resize(std::max(parts_.size(), part + 1));
  return parts_[part];
}

void Evidence::note(const DumpCatalogue& catalogue, std::size_t row, Fit fit) {
  if (fit == Fit::no) return;
  for (const std::size_t part : catalogue.parts_of(row)) {
    if (has(part)) continue;
    if (fit == Fit::proven) {
      at(part).is_seen = true;
    } else {
      ++at(part).left_unknown;
    }
  }
}

}  // namespace bmu::dump
