#include "tools/bmudump/identify/evidence.hpp"

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

void Evidence::note_seal(bool is_right) {
  constexpr std::uint64_t wrong_of_first_max = 1;
  constexpr std::uint64_t wrong_of_each_other_max = 8;
  ++(is_right ? right_seals_ : wrong_seals_);
  if (right_seals_ == 0) return;
  has_internal_ = wrong_seals_ <= wrong_of_first_max + wrong_of_each_other_max * (right_seals_ - 1);
}

}  // namespace bmu::dump
