// The key "derating" of a cell: permitted share of its current in the cold, in the heat, empty and full.
#pragma once

#include <array>
#include <string_view>

#include "config/json/json_reader.hpp"
#include "daemon/core/cell/derating.hpp"

namespace bmu {

/// One of the tables: a list of pairs, [temperature_dC, share_permille] or [soc_permille, share_permille].
struct DeratingField {
  std::string_view key;
  DeratingTable DeratingTables::*table;
  bool is_over_soc;
  bool is_charge;
};
inline constexpr std::array derating_fields{
    DeratingField{"charge_over_temperature", &DeratingTables::charge_over_temperature, false, true},
    DeratingField{"discharge_over_temperature", &DeratingTables::discharge_over_temperature, false, false},
    DeratingField{"charge_over_soc", &DeratingTables::charge_over_soc, true, true},
    DeratingField{"discharge_over_soc", &DeratingTables::discharge_over_soc, true, false},
};

/// The result is valid only if nothing was added to the problems. A missing table does not derate.
[[nodiscard]] DeratingTables read_derating(const JsonValue& object, const Place& place, ProblemList& problems);

}  // namespace bmu
