// Charge and energy that have flowed through the pack in all sessions of the daemon, for its age: 625h transmits the
// energy. A session counts from its start (coulomb_counter.hpp) and adds the totals of the previous ones. The charge
// that flowed while no daemon was running is missing, and that after the last record of one that was killed: at most
// `totals_step_permille` of the capacity each time.
#pragma once

#include <cstdint>

#include "daemon/core/estimation/soc/coulomb_counter.hpp"

namespace bmu {

/// All 0 or more.
struct PackTotals {
  std::int64_t charge_out_uAs = 0;
  std::int64_t charge_in_uAs = 0;
  std::int64_t energy_out_mWh = 0;
  std::int64_t energy_in_mWh = 0;

  friend bool operator==(const PackTotals&, const PackTotals&) = default;
};

/// Share of the capacity, out and in together: an increase by this is worth a record.
inline constexpr std::int64_t totals_step_permille = 20;

[[nodiscard]] constexpr PackTotals totals_with(const PackTotals& former, const ChargeState& life) {
  return {.charge_out_uAs = former.charge_out_uAs + life.out_uAs,
          .charge_in_uAs = former.charge_in_uAs + life.in_uAs,
          .energy_out_mWh = former.energy_out_mWh + life.energy_out_mWh,
          .energy_in_mWh = former.energy_in_mWh + life.energy_in_mWh};
}

/// Full cycles: discharged charge as a multiple of the capacity. `capacity_uAs` above 0.
[[nodiscard]] constexpr std::int64_t cycles_permille(const PackTotals& totals, std::int64_t capacity_uAs) {
  return static_cast<std::int64_t>(static_cast<double>(totals.charge_out_uAs) * 1e3 /
                                   static_cast<double>(capacity_uAs));
}

[[nodiscard]] constexpr bool is_worth_recording(const PackTotals& older, const PackTotals& newer,
                                                std::int64_t capacity_uAs) {
  const std::int64_t more_uAs = newer.charge_out_uAs - older.charge_out_uAs + newer.charge_in_uAs - older.charge_in_uAs;
  return more_uAs >= capacity_uAs / 1'000 * totals_step_permille;
}

}  // namespace bmu
