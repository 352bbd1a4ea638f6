// Counts instead of lines: what was on each bus, what failed and why, and how busy the bus was.
//
// The load is what the frames shown took, each with its own bits (protocol/can_bits.hpp), over the time from the first
// to the last. It is the least there was: frames that were not received whole, and those of CAN FD, whose bits a log
// does not have, come on top.
#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "tools/bmudump/bus_table.hpp"
#include "tools/bmudump/dump_catalogue.hpp"
#include "tools/bmudump/frame_text.hpp"

namespace bmu::dump {

class Summary {
 public:
  explicit Summary(const DumpCatalogue& catalogue, std::uint32_t bit_rate)
      : catalogue_(&catalogue), bit_rate_(bit_rate) {}

  void count(const Bus& bus, const SeenFrame& seen);
  [[nodiscard]] std::string text() const;
  /// Frames no catalogue knows, and frames that failed their check.
  [[nodiscard]] std::uint64_t suspect_count() const;

 private:
  struct MessageCounts {
    std::uint64_t accepted = 0;
    std::array<std::uint64_t, reject_reason_count> failed{};
    std::bitset<64> nodes;
  };
  struct BusCounts {
    std::string name;
    std::vector<MessageCounts> messages;  // by row
    std::uint64_t frames = 0;
    std::uint64_t unknown = 0;
    std::uint64_t remote = 0;
    std::uint64_t error = 0;
    std::uint64_t fd = 0;
    std::int64_t bits = 0;  // of classic frames, but for the first, which was over when the time began
    std::int64_t first_us = 0;
    std::int64_t last_us = 0;
    std::vector<std::uint64_t> unknown_ids = std::vector<std::uint64_t>(Catalogue::id_count);  // 11-bit ones
  };

  BusCounts& counts_of(const Bus& bus);
  static void count_unjudged(BusCounts& counts, const SeenFrame& seen);
  [[nodiscard]] std::string bus_text(const BusCounts& bus) const;
  [[nodiscard]] std::string message_line(const MessageSpec& message, const MessageCounts& counts) const;
  [[nodiscard]] std::string load_text(const BusCounts& bus) const;

  const DumpCatalogue* catalogue_;
  std::uint32_t bit_rate_;
  std::vector<BusCounts> buses_;  // by index of the bus
};

}  // namespace bmu::dump
