// Selection of the frames to show: candump's filters, and message names. A hidden frame is checked nevertheless.
//
//   143              a hexadecimal identifier; of eight digits: a 29-bit one
//   CELLS_1, CELLS_* a message, or all with names that start so; upper or lower case
//   123:7F0          frames with an identifier that equals 123h in the bits of the mask
//   123~7F0          all others
//   #FFFFFFFF        error frames of these classes
//   j                all masks must match a frame, instead of one of them
//
// As in candump: eight digits before ':' or '~' mean a 29-bit identifier; bit 31 of the mask then compares this
// property, bit 30 the remote flag; a shorter mask compares neither. Error frames pass a filter only by '#'; with '#'
// filters only, all other frames pass.
#pragma once

#include <bitset>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/frame.hpp"
#include "protocol/message.hpp"

namespace bmu::dump {

/// "0x1F", "1f": the whole word is a hexadecimal number of 32 bits.
[[nodiscard]] std::optional<std::uint32_t> parse_hex(std::string_view word);

/// Passes all frames if it is empty.
class Filter {
 public:
  /// Adds one word; false if it has none of the forms above.
  [[nodiscard]] bool add(const std::string& word, const Catalogue& catalogue);
  [[nodiscard]] bool passes(const CanFrame& frame) const { return is_empty_ || passes_words(frame); }

 private:
  struct Mask {
    std::uint32_t id = 0;
    std::uint32_t mask = 0;
    bool is_inverse = false;
  };

  bool add_names(std::string_view word, const Catalogue& catalogue);
  void add_id_of(const MessageSpec& message, unsigned node);
  bool add_mask(std::string_view word);
  bool add_id(std::string_view word);
  [[nodiscard]] bool passes_words(const CanFrame& frame) const;

  bool is_empty_ = true;
  bool has_data_words_ = false;
  bool has_ids_ = false;
  bool wants_all_ = false;        // 'j'
  std::uint32_t error_mask_ = 0;  // '#'
  std::bitset<Catalogue::id_count> ids_;
  std::vector<Mask> masks_;
};

}  // namespace bmu::dump
