// All messages that bmudump decodes on a bus: internal and vehicle bus together, because their identifiers do not
// collide and one interface may carry both, with the requested devices; or, on their own bus, devices alone. The
// vehicle bus has one catalogue for each dialect. Modules of another maker replace those of bmud: the other messages of
// the internal bus, contactors and sensors, are decoded beside them, because a pack has modules of one kind.
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

/// True if its names are those of bits, not of values.
[[nodiscard]] inline bool is_bit_set(const SignalSpec& signal) {
  return !signal.names.empty() && signal.name.ends_with("_bits");
}

/// The catalogue of a device, in the requested byte order if it has two.
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
  /// An identifier that two senders in the same catalogue have in common.
  struct Clash {
    std::uint32_t id = 0;
    bool is_extended = false;
    const Device* device = nullptr;  // null: both are of bmud
    std::string other;
  };

  explicit DumpCatalogue(const Choice& choice, const Dialect& dialect = dialect_table[0]);

  [[nodiscard]] const Dialect& dialect() const { return *dialect_; }
  [[nodiscard]] std::uint32_t vehicle_base_id() const { return vehicle_base_id_; }
  [[nodiscard]] const Catalogue& all() const { return *all_; }
  [[nodiscard]] const Catalogue& internal() const { return *internal_; }
  [[nodiscard]] const Catalogue& vehicle() const { return *vehicle_; }
  /// True if the row of this index in all() is one of internal().
  [[nodiscard]] bool is_internal(std::size_t row) const { return row < internal_->messages().size(); }
  /// True if the row of this index in all() is one of vehicle().
  [[nodiscard]] bool is_vehicle(std::size_t row) const {
    return row >= internal_->messages().size() && row - internal_->messages().size() < vehicle_->messages().size();
  }
  /// True if that row belongs to a device alone, and to neither the internal bus nor the vehicle messages.
  [[nodiscard]] bool is_device(std::size_t row) const {
    return row >= internal_->messages().size() + vehicle_->messages().size();
  }
  /// The part that added the row to all(): one index for the internal bus, for the vehicle messages and for each
  /// device.
  [[nodiscard]] std::size_t part_of(std::size_t row) const;
  /// All parts that contain the row.
  [[nodiscard]] std::span<const std::size_t> parts_of(std::size_t row) const { return parts_of_row_[row]; }
  [[nodiscard]] std::size_t part_count() const { return parts_.size(); }
  /// Null if it is a part of bmud.
  [[nodiscard]] const Device* device_of(std::size_t part) const { return parts_[part].device; }
  /// The first clash: the vehicle messages were moved onto other identifiers in use, or devices collide.
  [[nodiscard]] std::optional<Clash> clash() const;

 private:
  /// Start of the rows of a part in all().
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
