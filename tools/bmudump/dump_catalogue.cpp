#include "tools/bmudump/dump_catalogue.hpp"

#include "protocol/tables/internal_bus.hpp"
#include "protocol/tables/vehicle_bus.hpp"

namespace bmu::dump {

DumpCatalogue::DumpCatalogue(const Choice& choice, const Dialect& dialect)
    : dialect_(&dialect),
      vehicle_base_id_(choice.vehicle_base_id),
      internal_(choice.sensor_little_endian ? &internal_bus::catalogue_little_endian_sensor : &internal_bus::catalogue),
      row_of_id_(Catalogue::id_count, no_row) {
  for (const MessageSpec* message : dialect.rows) {
    MessageSpec moved = *message;
    moved.base_id =
        static_cast<std::uint16_t>(message->base_id - vehicle_bus::default_base_id + choice.vehicle_base_id);
    vehicle_rows_.push_back(moved);
  }
  for (const MessageSpec& row : vehicle_rows_) vehicle_messages_.push_back(&row);
  vehicle_ = std::make_unique<Catalogue>(vehicle_bus::catalogue.name(), vehicle_messages_);
  all_messages_.assign(internal_->messages().begin(), internal_->messages().end());
  all_messages_.insert(all_messages_.end(), vehicle_messages_.begin(), vehicle_messages_.end());
  all_ = std::make_unique<Catalogue>("all", all_messages_);
  for (std::size_t row = 0; row < all_messages_.size(); ++row) {
    const MessageSpec& message = *all_messages_[row];
    for (unsigned node = message.node_min; node <= message.node_max; ++node) {
      const std::size_t id = message.base_id + std::size_t{node};
      if (id < row_of_id_.size()) row_of_id_[id] = static_cast<std::uint8_t>(row);
    }
  }
}

}  // namespace bmu::dump
