// The buses of a log or of a live run: each name has its own receive check, because counters and polls of one bus do
// not apply to another, and its own dialect.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/receive_check.hpp"
#include "tools/bmudump/filter.hpp"
#include "tools/bmudump/identify/device_hint.hpp"
#include "tools/bmudump/identify/dialect.hpp"
#include "tools/bmudump/identify/dump_catalogue.hpp"
#include "tools/bmudump/identify/evidence.hpp"
#include "tools/bmudump/statistics.hpp"

namespace bmu::dump {

/// Bus name that stands for all buses.
inline constexpr std::string_view every_bus = "any";

/// A bus the user named, every_bus for all, with its filter.
struct BusChoice {
  std::string name;
  Filter filter;
};

/// A bus that is decoded by its own catalogue, every_bus for all, whatever dialect is detected there.
struct DeviceBus {
  std::string name;
  std::size_t reader;
  const DumpCatalogue* catalogue;
};

struct Bus {
  std::string name;
  std::size_t index;
  std::size_t reader;  // index of the DumpCatalogue that decodes its frames
  ReceiveCheck check;
  DialectWatch dialect;
  const Filter* filter;  // null: no frame of it is shown
  BusStatistics statistics;
  DeviceHint hint;
  Evidence evidence;
};

class BusTable {
 public:
  static constexpr std::size_t bus_count_max = 16;

  /// `choices` empty: all buses are shown. New buses are decoded by `catalogue`, that of index `reader`, except those
  /// of `device_buses`.
  BusTable(const DumpCatalogue& catalogue, std::size_t reader, std::span<const Dialect> dialects,
           std::span<const BusChoice> choices, std::span<const DeviceBus> device_buses = {})
      : catalogue_(&catalogue), reader_(reader), dialects_(dialects), choices_(choices), device_buses_(device_buses) {}

  /// The bus of this name, created on first use; null if there would be more than bus_count_max.
  [[nodiscard]] Bus* find(std::string_view name) {
    return last_ != nullptr && last_->name == name ? last_ : find_other(name);
  }
  [[nodiscard]] const std::vector<std::unique_ptr<Bus>>& buses() const { return buses_; }

 private:
  [[nodiscard]] Bus* find_other(std::string_view name);

  [[nodiscard]] const Filter* filter_of(std::string_view name) const;

  const DumpCatalogue* catalogue_;
  std::size_t reader_;
  std::span<const Dialect> dialects_;
  std::span<const BusChoice> choices_;
  std::span<const DeviceBus> device_buses_;
  Filter no_filter_;
  std::vector<std::unique_ptr<Bus>> buses_;
  Bus* last_ = nullptr;  // logs contain runs of one name
};

}  // namespace bmu::dump
