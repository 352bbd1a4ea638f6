// Every message bmudump knows on a bus: internal and vehicle bus together, as their identifiers do not collide and one
// interface may carry both, with the devices that were asked for; or, on a bus of their own, devices alone. Of the
// vehicle bus there is one catalogue for each dialect. Modules of another maker stand in the place of ours: of the
// internal bus the rest is read beside them, contactors and sensors, as a pack has modules of one kind.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "devices/device.hpp"
#include "protocol/message.hpp"
#include "tools/bmudump/identify/dialect.hpp"

namespace bmu::dump {

/// Its names are those of bits, not of values.
[[nodiscard]] inline bool is_bit_set(const SignalSpec& signal) {
  return !signal.names.empty() && signal.name.ends_with("_bits");
}

/// Of a device, in the order of bytes that was asked for, where it has two.
[[nodiscard]] const Catalogue& catalogue_of(const Device& device, bool sensor_little_endian);

class DumpCatalogue {
 public:
  struct Choice {
    std::uint32_t vehicle_base_id = 0x620;
    bool sensor_little_endian = false;
    bool has_internal = true;
    bool has_vehicle = true;
    std::vector<const Device*> devices{};
    std::string_view name = "all";  // of all()
  };
  /// An identifier that two of those have who are read together.
  struct Clash {
    std::uint32_t id = 0;
    bool is_extended = false;
    const Device* device = nullptr;  // null: both are ours
    std::string other;
  };

  explicit DumpCatalogue(const Choice& choice, const Dialect& dialect = dialect_table[0]);

  [[nodiscard]] const Dialect& dialect() const { return *dialect_; }
  [[nodiscard]] std::uint32_t vehicle_base_id() const { return vehicle_base_id_; }
  [[nodiscard]] const Catalogue& all() const { return *all_; }
  [[nodiscard]] const Catalogue& internal() const { return *internal_; }
  [[nodiscard]] const Catalogue& vehicle() const { return *vehicle_; }
  /// Whether the row of this index in all() is one of internal().
  [[nodiscard]] bool is_internal(std::size_t row) const { return row < internal_->messages().size(); }
  /// Whether the row of this index in all() is one of vehicle().
  [[nodiscard]] bool is_vehicle(std::size_t row) const {
    return row >= internal_->messages().size() && row - internal_->messages().size() < vehicle_->messages().size();
  }
  /// Whether that row is one of a device alone, and not of the internal bus or the vehicle, too.
  [[nodiscard]] bool is_device(std::size_t row) const {
    return row >= internal_->messages().size() + vehicle_->messages().size();
  }
  /// Who has that row in all(): one index for the internal bus, for the vehicle messages and for each device.
  [[nodiscard]] std::size_t part_of(std::size_t row) const;
  /// All that have it.
  [[nodiscard]] std::span<const std::size_t> parts_of(std::size_t row) const { return parts_of_row_[row]; }
  [[nodiscard]] std::size_t part_count() const { return parts_.size(); }
  /// Null if it is ours.
  [[nodiscard]] const Device* device_of(std::size_t part) const { return parts_[part].device; }
  /// The first there is: the vehicle messages were moved onto identifiers of others, or devices collide.
  [[nodiscard]] std::optional<Clash> clash() const;

 private:
  /// Whose rows begin where in all().
  struct Part {
    std::size_t begin = 0;
    std::string name;
    const Device* device = nullptr;
  };

  void add(std::span<const MessageSpec* const> rows, std::string name, const Device* device);

  const Dialect* dialect_;
  std::uint32_t vehicle_base_id_;
  std::vector<MessageSpec> vehicle_rows_;
  std::vector<const MessageSpec*> vehicle_messages_;
  std::vector<const MessageSpec*> all_messages_;
  std::vector<std::vector<std::size_t>> parts_of_row_;
  std::vector<Part> parts_;
  const Catalogue* internal_;
  std::unique_ptr<Catalogue> vehicle_;
  std::unique_ptr<Catalogue> all_;
};

}  // namespace bmu::dump
