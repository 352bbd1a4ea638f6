// Cache of values that the samples of many cells of one model have in common when they are taken at one instant: the
// tables at their temperature, and the decay over the time since the previous samples. It needs one exponential for the
// pack instead of one for each cell. The caller passes one cache to all cells of a model, and another one for another
// model; the results are the same with and without it.
#pragma once

#include <array>
#include <cstddef>

#include "daemon/core/cell/cell_dynamics.hpp"
#include "daemon/core/types/memo.hpp"

namespace bmu {

class ModelMemo {
 public:
  /// Valid until the next call.
  [[nodiscard]] const CellDynamics::Row& row(const CellDynamics& cell, double temperature_C) {
    return rows_.of(temperature_C, [&] { return row_at(cell, temperature_C); });
  }

  /// Remaining share, after that time, of a quantity that decays with a time constant: of the model's RC elements, and
  /// of another state, each of which has its own time constant.
  [[nodiscard]] const std::array<double, CellDynamics::pairs>& pairs_left(const CellDynamics& cell, double passed_s);
  enum class Fading : unsigned char { error, offset, resistance, surprise };
  [[nodiscard]] double left(Fading what, double passed_s, double time_constant_s);

 private:
  struct Span {
    double passed_s = 0.0;
    double time_constant_s = 0.0;
    friend bool operator==(const Span&, const Span&) = default;
  };

  Memo<double, CellDynamics::Row> rows_;
  Memo<double, std::array<double, CellDynamics::pairs>> pairs_left_;
  std::array<Memo<Span, double>, 4> left_;
};

}  // namespace bmu
