#include "daemon/core/contactors/contactor_ledger.hpp"

#include <algorithm>
#include <cstdlib>

namespace bmu {

namespace {

constexpr bool is_main(std::size_t index) {
  return index == static_cast<std::size_t>(ContactorId::main_positive) ||
         index == static_cast<std::size_t>(ContactorId::main_negative);
}

}  // namespace

void ContactorLedger::note_main(bool is_closing, const Measured<std::int32_t>& current_mA) {
  if (!is_closing && !is_broken_) broken_mA_ = current_mA;
  is_broken_ = !is_closing;
}

bool ContactorLedger::command(const ContactorOutputs& outputs, const Measured<std::int32_t>& current_mA) {
  const std::array commanded{outputs.main_positive, outputs.main_negative, outputs.precharge, outputs.charge};
  const bool is_under_load = !current_mA.is_valid() || !is_small_current(current_mA.value);
  bool is_counted = false;
  for (std::size_t index = 0; index < contactor_id_count; ++index) {
    if (commanded[index] == is_closed_[index]) continue;
    is_closed_[index] = commanded[index];
    is_counted = true;
    if (is_main(index)) note_main(commanded[index], current_mA);
    ContactorWear& wear = entries_[index];
    if (commanded[index]) {
      ++wear.closings;
      continue;
    }
    ++wear.openings;
    if (!is_under_load) continue;
    ++wear.openings_under_load;
    const std::int32_t magnitude_mA = current_mA.is_valid() ? std::abs(current_mA.value) : 0;
    wear.current_broken_max_mA = std::max(wear.current_broken_max_mA, magnitude_mA);
    wear.current_broken_sum_mA += magnitude_mA;
  }
  return is_counted;
}

}  // namespace bmu
