// The buses of a log or of a live run: each name has a receive check of its own, as counters and polls of one bus say
// nothing about another.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/receive_check.hpp"

namespace bmu::dump {

struct Bus {
  std::string name;
  std::size_t index;
  ReceiveCheck check;
};

class BusTable {
 public:
  static constexpr std::size_t bus_count_max = 16;

  explicit BusTable(const Catalogue& catalogue) : catalogue_(&catalogue) {}

  /// The bus of this name, made when first seen; null if there would be more than bus_count_max.
  [[nodiscard]] Bus* find(std::string_view name) {
    return last_ != nullptr && last_->name == name ? last_ : find_other(name);
  }
  [[nodiscard]] const std::vector<std::unique_ptr<Bus>>& buses() const { return buses_; }

 private:
  [[nodiscard]] Bus* find_other(std::string_view name);

  const Catalogue* catalogue_;
  std::vector<std::unique_ptr<Bus>> buses_;
  Bus* last_ = nullptr;  // logs come in runs of one name
};

}  // namespace bmu::dump
