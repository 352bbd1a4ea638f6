// Cache of the last result of an expensive function, for repeated calls with the same argument: e.g. the cells of a
// module, evaluated one after another, have the same temperature. The argument must be equal, not close, so that a
// cached result is identical to a computed one; not-a-number is never equal and always computed.
//
//   Memo<double, CellDynamics::Row> rows;
//   const CellDynamics::Row& row = rows.of(temperature_C, [&] { return row_at(cell, temperature_C); });
//
// One cache serves one function of one model. Cost: a comparison.
#pragma once

#include <optional>

namespace bmu {

template <class Asked, class Answer>
class Memo {
 public:
  /// The reference is valid until the next call.
  template <class WorkOut>
  const Answer& of(const Asked& asked, WorkOut work_out) {
    if (!asked_ || !(*asked_ == asked)) {
      answer_ = work_out();
      asked_ = asked;
    }
    return answer_;
  }

 private:
  std::optional<Asked> asked_;
  Answer answer_{};
};

}  // namespace bmu
