// What the samples of many cells of one model have in common when they are taken at one instant: the tables
// at their temperature, and what fades over the time since the samples before. An exponential for the pack instead of
// one for each cell. Whoever samples cells has one of these and gives it to all of them, and a new one for
// another model; what a cell is told is the same with it and without.
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

  /// What is left after that time of what fades with a time constant: of the model's pairs, and of something else,
  /// each of which has its own time constant.
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
