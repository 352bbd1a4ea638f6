// The dialects of the traction-pack messages 620h to 628h, one row each.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "protocol/row_order.hpp"
#include "protocol/tables/vehicle_bus.hpp"
#include "protocol/tables/vehicle_bus_elithion.hpp"
#include "protocol/tables/vehicle_bus_original.hpp"

namespace bmu {

enum class VehicleDialect : std::uint8_t { iha, original, elithion };
inline constexpr std::size_t vehicle_dialect_count = 3;

struct VehicleDialectRow {
  VehicleDialect dialect;
  std::string_view name;
  const Catalogue* catalogue;  // nine rows, in the order of their identifiers, from vehicle_bus::default_base_id on
};

/// In the order of VehicleDialect.
inline constexpr std::array<VehicleDialectRow, vehicle_dialect_count> vehicle_dialects{{
    {VehicleDialect::iha, "iha", &vehicle_bus::catalogue},
    {VehicleDialect::original, "original", &vehicle_bus_original::catalogue},
    {VehicleDialect::elithion, "elithion", &vehicle_bus_elithion::catalogue},
}};
static_assert(rows_are_in_order(vehicle_dialects, &VehicleDialectRow::dialect));

[[nodiscard]] constexpr const VehicleDialectRow& row_of(VehicleDialect dialect) {
  return vehicle_dialects[static_cast<std::size_t>(dialect)];
}

}  // namespace bmu
