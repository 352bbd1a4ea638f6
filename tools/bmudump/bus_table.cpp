#include "tools/bmudump/bus_table.hpp"

#include <algorithm>

namespace bmu::dump {

Bus* BusTable::find_other(std::string_view name) {
  const auto found =
      std::find_if(buses_.begin(), buses_.end(), [name](const std::unique_ptr<Bus>& bus) { return bus->name == name; });
  if (found != buses_.end()) return last_ = found->get();
  if (buses_.size() == bus_count_max) return nullptr;
  buses_.push_back(std::make_unique<Bus>(Bus{.name = std::string(name),
                                             .index = buses_.size(),
                                             .reader = reader_,
                                             .check = ReceiveCheck(catalogue_->all(), ReceiveCheck::Role::listener),
                                             .dialect = DialectWatch(dialects_, catalogue_->vehicle_base_id()),
                                             .filter = filter_of(name),
                                             .statistics = {}}));
  return last_ = buses_.back().get();
}

const Filter* BusTable::filter_of(std::string_view name) const {
  if (choices_.empty()) return &no_filter_;
  for (const BusChoice& choice : choices_) {
    if (choice.name == name || choice.name == "any") return &choice.filter;
  }
  return nullptr;
}

}  // namespace bmu::dump
