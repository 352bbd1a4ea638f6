#include "tools/bmudump/bus_table.hpp"

#include <algorithm>

namespace bmu::dump {

Bus* BusTable::find_other(std::string_view name) {
  const auto found =
      std::find_if(buses_.begin(), buses_.end(), [name](const std::unique_ptr<Bus>& bus) { return bus->name == name; });
  if (found != buses_.end()) return last_ = found->get();
  if (buses_.size() == bus_count_max) return nullptr;
  const auto own = std::find_if(device_buses_.begin(), device_buses_.end(),
                                [name](const DeviceBus& bus) { return bus.name == name || bus.name == every_bus; });
  const bool is_own = own != device_buses_.end();
  const DumpCatalogue& catalogue = is_own ? *own->catalogue : *catalogue_;
  const std::uint32_t vehicle_base_id = is_own ? DialectWatch::nowhere : catalogue.vehicle_base_id();
  buses_.push_back(std::make_unique<Bus>(Bus{.name = std::string(name),
                                             .index = buses_.size(),
                                             .reader = is_own ? own->reader : reader_,
                                             .check = ReceiveCheck(catalogue.all(), ReceiveCheck::Role::listener),
                                             .dialect = DialectWatch(dialects_, vehicle_base_id),
                                             .filter = filter_of(name),
                                             .statistics = {},
                                             .hint = {},
                                             .evidence = {}}));
  return last_ = buses_.back().get();
}

const Filter* BusTable::filter_of(std::string_view name) const {
  if (choices_.empty()) return &no_filter_;
  for (const BusChoice& choice : choices_) {
    if (choice.name == name || choice.name == every_bus) return &choice.filter;
  }
  return nullptr;
}

}  // namespace bmu::dump
