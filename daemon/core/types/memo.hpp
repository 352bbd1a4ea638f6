// The last answer of a dear function, for whoever asks the same again and again: the cells of a module, one after
// another, ask for the same temperature. What is asked with must be equal, not near, so that nobody can tell an answer
// that was kept from one that was worked out; not-a-number is never equal, and always worked out.
//
//   Memo<double, CellDynamics::Row> rows;
//   const CellDynamics::Row& row = rows.of(temperature_C, [&] { return row_at(cell, temperature_C); });
//
// One memo is for one function: of one model. Cost: a comparison.
#pragma once

#include <optional>

namespace bmu {

template <class Asked, class Answer>
class Memo {
 public:
  /// Valid until the next call.
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
