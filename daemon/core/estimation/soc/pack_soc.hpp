// State of charge of a pack in series from those of its cells, which all carry the same current: it is empty when the
// first of them is empty, and full when the first is full.
//
//   out = min over cells (capacity * soc)          charge that can be taken before the emptiest is empty
//   in  = min over cells (capacity * (1 - soc))    charge that can be put in before the fullest is full
//   SOC = out / (out + in)
//
// The usable capacity out + in is that of the weakest cell while all are balanced, and less by their imbalance.
//
// Cost: a pass over the cells.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>

#include "daemon/core/estimation/soc/soc_estimate.hpp"
#include "daemon/core/types/core_config.hpp"
#include "protocol/fields.hpp"

namespace bmu {

struct CellSoc {
  SocEstimate estimate;
  double capacity_As = 0.0;  // above 0
};

struct PackSoc {
  bool is_known = false;  // only with every cell; otherwise the other members are not valid
  double soc = 0.0;       // 0 to 1
  double sigma = 1.0;     // the errors of the two cells that determine it count as equal: they have one sensor
  double out_As = 0.0;
  double in_As = 0.0;
  std::size_t emptiest = 0;  // cells by number through the pack, from 0
  std::size_t fullest = 0;

  [[nodiscard]] double capacity_As() const { return out_As + in_As; }
  [[nodiscard]] bool are_fields_possible() const {
    return emptiest < cells_max && fullest < cells_max && is_within(out_As, 0.0, charge_most_As) &&
           is_within(in_As, 0.0, charge_most_As);
  }
};

[[nodiscard]] inline PackSoc pack_soc(std::span<const CellSoc> cells) {
  PackSoc pack;
  if (cells.empty()) return pack;
  for (std::size_t number = 0; number < cells.size(); ++number) {
    const CellSoc& cell = cells[number];
    if (!cell.estimate.is_known || !(cell.capacity_As > 0.0)) return {};
    const double out_As = cell.capacity_As * cell.estimate.soc;
    const double in_As = cell.capacity_As * (1.0 - cell.estimate.soc);
    if (number == 0 || out_As < pack.out_As) {
      pack.out_As = out_As;
      pack.emptiest = number;
    }
    if (number == 0 || in_As < pack.in_As) {
      pack.in_As = in_As;
      pack.fullest = number;
    }
  }
  pack.is_known = true;
  // One cell empty and another one full: no charge can be taken or put in, and the state of charge can only be empty.
  const double all_As = pack.capacity_As();
  pack.soc = all_As > 0.0 ? pack.out_As / all_As : 0.0;
  const CellSoc& low = cells[pack.emptiest];
  const CellSoc& high = cells[pack.fullest];
  const double doubt_As =
      (1.0 - pack.soc) * low.capacity_As * low.estimate.sigma + pack.soc * high.capacity_As * high.estimate.sigma;
  pack.sigma = all_As > 0.0 ? std::min(doubt_As / all_As, 1.0) : 1.0;
  return pack;
}

}  // namespace bmu
