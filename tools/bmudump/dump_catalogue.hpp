// Every message bmudump knows, internal and vehicle bus together: their identifiers do not collide, and one interface
// may carry both. Of the vehicle bus there is one catalogue for each dialect.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "protocol/message.hpp"
#include "tools/bmudump/dialect.hpp"

namespace bmu::dump {

/// Its names are those of bits, not of values.
[[nodiscard]] inline bool is_bit_set(const SignalSpec& signal) {
  return !signal.names.empty() && signal.name.ends_with("_bits");
}

class DumpCatalogue {
 public:
  struct Choice {
    std::uint32_t vehicle_base_id = 0x620;
    bool sensor_little_endian = false;
  };
  static constexpr std::uint8_t no_row = 0xFF;

  explicit DumpCatalogue(const Choice& choice, const Dialect& dialect = dialect_table[0]);

  [[nodiscard]] const Dialect& dialect() const { return *dialect_; }
  [[nodiscard]] std::uint32_t vehicle_base_id() const { return vehicle_base_id_; }
  [[nodiscard]] const Catalogue& all() const { return *all_; }
  [[nodiscard]] const Catalogue& internal() const { return *internal_; }
  [[nodiscard]] const Catalogue& vehicle() const { return *vehicle_; }
  /// False if the vehicle messages were moved onto identifiers of others, or beyond 7FF.
  [[nodiscard]] bool ids_unique() const { return all_->ids_unique(); }
  /// Index of an identifier's message in all().messages(); no_row if there is none.
  [[nodiscard]] std::uint8_t row_of(std::uint32_t id) const { return id < row_of_id_.size() ? row_of_id_[id] : no_row; }

 private:
  const Dialect* dialect_;
  std::uint32_t vehicle_base_id_;
  std::vector<MessageSpec> vehicle_rows_;
  std::vector<const MessageSpec*> vehicle_messages_;
  std::vector<const MessageSpec*> all_messages_;
  const Catalogue* internal_;
  std::unique_ptr<Catalogue> vehicle_;
  std::unique_ptr<Catalogue> all_;
  std::vector<std::uint8_t> row_of_id_;
};

}  // namespace bmu::dump
