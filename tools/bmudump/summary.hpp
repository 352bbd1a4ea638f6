// The final report of the counters (statistics.hpp), as text or JSON: frames of each bus, rates, failures and their
// reasons, and bus load.
//
// The load is that of the frames shown, over the time from the first to the last. It is a lower bound: frames that were
// not received completely, and those of CAN FD, with bits that a log does not record, add to it. A change of the log's
// clock is no time in which frames could be sent (clock_jumps.hpp).
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "tools/bmudump/bus_table.hpp"
#include "tools/bmudump/text_writer.hpp"

namespace bmu::dump {

class Summary {
 public:
  /// `bit_rate`: reference of the percentages. `until_us`: time, without the changes of the clock, until which all
  /// frames would have been received. `clock_jumps`: number of changes of the clock.
  Summary(std::uint32_t bit_rate, std::int64_t until_us, std::uint64_t clock_jumps, TextWriter& out)
      : bit_rate_(bit_rate), until_us_(until_us), clock_jumps_(clock_jumps), out_(&out) {}

  /// A table per bus; a line for each received identifier.
  void print_text(std::span<const std::unique_ptr<Bus>> buses) const;
  /// One object and line per bus.
  void print_json(std::span<const std::unique_ptr<Bus>> buses) const;

 private:
  void print_bus(const Bus& bus) const;
  [[nodiscard]] std::string remarks_on(const IdStatistics& row) const;
  void print_load(const BusStatistics& bus) const;
  void print_row(std::string_view id, const IdStatistics& row, const BusStatistics& bus) const;
  void print_bus_json(const Bus& bus) const;
  void print_row_json(std::string_view id, const IdStatistics& row) const;

  std::uint32_t bit_rate_;
  std::int64_t until_us_;
  std::uint64_t clock_jumps_;
  TextWriter* out_;
};

/// Frames unknown to all catalogues, and frames that failed their check.
[[nodiscard]] std::uint64_t suspect_count(std::span<const std::unique_ptr<Bus>> buses);

}  // namespace bmu::dump
