// Wear of each contactor, which decides when it is replaced. Counted when commanded, with the current that is known at
// that instant.
#pragma once

#include <array>
#include <cstdint>

#include "daemon/core/contactors/contactor_sequence.hpp"
#include "daemon/core/types/measured.hpp"
#include "protocol/fields.hpp"

namespace bmu {

struct ContactorWear {
  std::uint32_t closings = 0;
  std::uint32_t openings = 0;
  std::uint32_t openings_under_load = 0;   // above small_current_mA, or with an unknown current
  std::int32_t current_broken_max_mA = 0;  // the largest of those, as a magnitude
  std::int64_t current_broken_sum_mA = 0;

  friend constexpr bool operator==(const ContactorWear&, const ContactorWear&) = default;
};

using ContactorLedgerEntries = std::array<ContactorWear, contactor_id_count>;

class ContactorLedger {
 public:
  /// Counts of the previous sessions; call before the first command().
  void restore(const ContactorLedgerEntries& entries) { entries_ = entries; }
  /// Takes over the commanded outputs. True if anything was counted.
  bool command(const ContactorOutputs& outputs, const Measured<std::int32_t>& current_mA);

  [[nodiscard]] const ContactorLedgerEntries& entries() const { return entries_; }
  /// Current when the first of the main contactors was last commanded open, which it had to break. The other one
  /// follows with the current that remains after that.
  [[nodiscard]] const Measured<std::int32_t>& broken_mA() const { return broken_mA_; }

 private:
  void note_main(bool is_closing, const Measured<std::int32_t>& current_mA);

  ContactorLedgerEntries entries_{};
  std::array<bool, contactor_id_count> is_closed_{};
  Measured<std::int32_t> broken_mA_;
  bool is_broken_ = false;  // a main contactor was commanded open, and none closed since
  BMU_FIELDS(entries_, is_closed_, broken_mA_, is_broken_)
};

}  // namespace bmu
