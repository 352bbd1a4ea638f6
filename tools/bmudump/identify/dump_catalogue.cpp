#include "tools/bmudump/identify/dump_catalogue.hpp"

#include <algorithm>

#include "protocol/tables/internal_bus.hpp"
#include "protocol/tables/vehicle_bus.hpp"

namespace bmu::dump {
namespace {

/// Replaces the internal bus if it is not selected.
constexpr Catalogue no_messages{"none", {}};

const Catalogue* internal_catalogue(const DumpCatalogue::Choice& choice) {
  using namespace internal_bus;
  if (!choice.has_internal) return &no_messages;
  const bool has_other_modules = std::any_of(choice.devices.begin(), choice.devices.end(),
                                             [](const Device* device) { return device->kind == DeviceKind::modules; });
  if (has_other_modules) {
    return choice.sensor_little_endian ? &catalogue_without_modules_little_endian_sensor : &catalogue_without_modules;
  }
  return choice.sensor_little_endian ? &catalogue_little_endian_sensor : &catalogue;
}

/// An identifier that both rows have.
std::optional<std::uint32_t> common_id(const MessageSpec& one, const MessageSpec& other) {
  if (one.is_extended != other.is_extended) return std::nullopt;
  for (unsigned node = one.node_min; node <= one.node_max; ++node) {
    for (unsigned other_node = other.node_min; other_node <= other.node_max; ++other_node) {
      if (one.id_of(node) == other.id_of(other_node)) return one.id_of(node);
    }
  }
  return std::nullopt;
}

}  // namespace

const Catalogue& catalogue_of(const Device& device, bool sensor_little_endian) {
  return sensor_little_endian && device.little_endian != nullptr ? *device.little_endian : *device.catalogue;
}

DumpCatalogue::DumpCatalogue(const Choice& choice, const Dialect& dialect)
    : dialect_(&dialect), vehicle_base_id_(choice.vehicle_base_id), internal_(internal_catalogue(choice)) {
  for (const MessageSpec* message : dialect.rows) {
    if (!choice.has_vehicle) break;
    MessageSpec moved = *message;
    moved.base_id = message->base_id - vehicle_bus::default_base_id + choice.vehicle_base_id;
    vehicle_rows_.push_back(moved);
  }
  for (const MessageSpec& row : vehicle_rows_) vehicle_messages_.push_back(&row);
  vehicle_ = std::make_unique<Catalogue>(vehicle_bus::catalogue.name(), vehicle_messages_);
  add(internal_->messages(), "the internal bus", nullptr);
  add(vehicle_messages_, "the vehicle messages", nullptr);
  for (const Device* device : choice.devices) {
    add(catalogue_of(*device, choice.sensor_little_endian).messages(), std::string(device->name), device);
  }
  all_ = std::make_unique<Catalogue>(choice.name, all_messages_);
}

/// A row that is already present is the same message, in any part.
void DumpCatalogue::add(std::span<const MessageSpec* const> rows, std::string name, const Device* device) {
  const std::size_t part = parts_.size();
  parts_.push_back({.begin = all_messages_.size(), .name = std::move(name), .device = device});
  for (const MessageSpec* row : rows) {
    const auto known = std::find(all_messages_.begin(), all_messages_.end(), row);
    const auto index = static_cast<std::size_t>(known - all_messages_.begin());
    if (known == all_messages_.end()) {
      all_messages_.push_back(row);
      parts_of_row_.emplace_back();
    }
    parts_of_row_[index].push_back(part);
  }
}

std::size_t DumpCatalogue::part_of(std::size_t row) const {
  const auto behind = std::upper_bound(parts_.begin(), parts_.end(), row,
                                       [](std::size_t at, const Part& part) { return at < part.begin; });
  return static_cast<std::size_t>(behind - parts_.begin()) - 1;
}

std::optional<DumpCatalogue::Clash> DumpCatalogue::clash() const {
  if (all_->ids_unique()) return std::nullopt;
  for (std::size_t row = 0; row < all_messages_.size(); ++row) {
    for (std::size_t before = 0; before < row; ++before) {
      const std::optional<std::uint32_t> id = common_id(*all_messages_[row], *all_messages_[before]);
      if (!id) continue;
      return Clash{.id = *id,
                   .is_extended = all_messages_[row]->is_extended,
                   .device = device_of(part_of(row)),
                   .other = parts_[part_of(before)].name};
    }
  }
  return Clash{};  // an identifier above 7FFh
}

}  // namespace bmu::dump
