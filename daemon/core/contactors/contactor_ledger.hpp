// What each contactor has been through: the wear that decides when it is replaced. Counted when commanded; current as
// known at that moment.
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
  std::uint32_t openings_under_load = 0;   // more than a small current, or one nobody knew
  std::int32_t current_broken_max_mA = 0;  // the largest of those, as a magnitude
  std::int64_t current_broken_sum_mA = 0;

  friend constexpr bool operator==(const ContactorWear&, const ContactorWear&) = default;
};

using ContactorLedgerEntries = std::array<ContactorWear, contactor_id_count>;

class ContactorLedger {
 public:
  /// Before the first command: what a former life has counted.
  void restore(const ContactorLedgerEntries& entries) { entries_ = entries; }
  /// What is commanded from now on. True if anything was counted.
  bool command(const ContactorOutputs& outputs, const Measured<std::int32_t>& current_mA);

  [[nodiscard]] const ContactorLedgerEntries& entries() const { return entries_; }
  /// What flowed when the first of the main contactors was last commanded open: what it had to break. What flows when
  /// the other follows is what is left after that.
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
