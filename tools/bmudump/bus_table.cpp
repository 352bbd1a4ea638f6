#include "tools/bmudump/bus_table.hpp"

#include <algorithm>

namespace bmu::dump {

Bus* BusTable::find_other(std::string_view name) {
  const auto found =
      std::find_if(buses_.begin(), buses_.end(), [name](const std::unique_ptr<Bus>& bus) { return bus->name == name; });
  if (found != buses_.end()) return last_ = found->get();
  if (buses_.size() == bus_count_max) return nullptr;
  buses_.push_back(std::make_unique<Bus>(
      Bus{std::string(name), buses_.size(), ReceiveCheck(*catalogue_, ReceiveCheck::Role::listener)}));
  return last_ = buses_.back().get();
}

}  // namespace bmu::dump
