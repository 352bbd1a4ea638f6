#include "daemon/core/estimation/soc/model_memo.hpp"

#include <cmath>

namespace bmu {

const std::array<double, CellDynamics::pairs>& ModelMemo::pairs_left(const CellDynamics& cell, double passed_s) {
  return pairs_left_.of(passed_s, [&] {
    std::array<double, CellDynamics::pairs> left{};
    for (std::size_t pair = 0; pair < CellDynamics::pairs; ++pair) {
      left[pair] = std::exp(-passed_s / cell.pair_time_constant_s[pair]);
    }
    return left;
  });
}

double ModelMemo::left(Fading what, double passed_s, double time_constant_s) {
  return left_[static_cast<std::size_t>(what)].of({passed_s, time_constant_s},
                                                  [&] { return std::exp(-passed_s / time_constant_s); });
}

}  // namespace bmu
