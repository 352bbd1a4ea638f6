// What was counted (statistics.hpp), at the end, for a person or as JSON: what was on each bus, how often, what failed
// and why, and how busy the bus was.
//
// The load is what the frames shown took, over the time from the first to the last. It is the least there was: frames
// that were not received whole, and those of CAN FD, whose bits a log does not have, come on top. What the clock of a
// log was set by is no time in which anything could be sent (clock_jumps.hpp).
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
  /// `bit_rate` is what percentages refer to. `until_us`: up to then, without what the clock was set by, everything
  /// would have been received. `clock_jumps`: how often it was set.
  Summary(std::uint32_t bit_rate, std::int64_t until_us, std::uint64_t clock_jumps, TextWriter& out)
      : bit_rate_(bit_rate), until_us_(until_us), clock_jumps_(clock_jumps), out_(&out) {}

  /// A table a bus; a line for each identifier that was seen.
  void print_text(std::span<const std::unique_ptr<Bus>> buses) const;
  /// One object a bus and line.
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

/// Frames no catalogue knows, and frames that failed their check.
[[nodiscard]] std::uint64_t suspect_count(std::span<const std::unique_ptr<Bus>> buses);

}  // namespace bmu::dump
