#include "mmu/devices/module_wire.hpp"

#include <algorithm>

namespace bmu {

namespace {

constexpr std::uint32_t ids_per_kind = 64;
constexpr std::size_t data_bytes = 6;  // counter and checksum follow

constexpr std::size_t kind_of(const CanFrame& frame) {
  return frame.id / ids_per_kind;
}
constexpr std::size_t kind_of(const MessageSpec& message) {
  return message.base_id / ids_per_kind;
}

constexpr OmittedFrames group_of(std::size_t kind) {
  if (kind == kind_of(internal_bus::status)) return OmittedFrames::status;
  if (kind >= kind_of(internal_bus::cells_1) && kind <= kind_of(internal_bus::cells_4)) return OmittedFrames::cells;
  if (kind == kind_of(internal_bus::temp_1) || kind == kind_of(internal_bus::temp_2)) {
    return OmittedFrames::temperatures;
  }
  if (kind == kind_of(internal_bus::module)) return OmittedFrames::module;
  if (kind == kind_of(internal_bus::ident)) return OmittedFrames::ident;
  return OmittedFrames::nothing;
}

/// Changes the module's description of itself.
void change_identity(std::size_t kind, const ModuleWireFaults& faults, CanFrame& frame) {
  if (kind == kind_of(internal_bus::status) && faults.cell_count) {
    write<internal_bus::status, "cell_count">(frame, *faults.cell_count);
  }
  if (kind != kind_of(internal_bus::ident)) return;
  if (faults.cell_count) write<internal_bus::ident, "cell_count">(frame, *faults.cell_count);
  if (faults.temperature_sensor_count) {
    write<internal_bus::ident, "temperature_sensor_count">(frame, *faults.temperature_sensor_count);
  }
  if (faults.protocol_version) write<internal_bus::ident, "protocol_version">(frame, *faults.protocol_version);
  if (faults.serial_number) write<internal_bus::ident, "serial_number">(frame, *faults.serial_number);
}

/// Changes the state of the switches that the module reads back.
void change_switches(std::size_t kind, CellMask on, CanFrame& frame) {
  if (kind == kind_of(internal_bus::status)) write<internal_bus::status, "balancing">(frame, on != 0);
  if (kind == kind_of(internal_bus::module)) write<internal_bus::module, "balancing_cells">(frame, on);
}

void add_flags(CellMask flags, CanFrame& frame) {
  const std::int64_t found = read_raw<internal_bus::status, "undervoltage_cells">(frame);
  write<internal_bus::status, "undervoltage_cells">(frame, found | flags);
}

}  // namespace

void ModuleWire::push(const MmuFrames& frames, const ModuleWireFaults& faults, TimePoint now) {
  if (faults.is_silent) {
    queue_.clear();
    return;
  }
  for (const CanFrame& frame : frames) {
    const OmittedFrames group = group_of(kind_of(frame));
    const bool is_omitted = group != OmittedFrames::nothing && group == faults.omitted;
    if (is_omitted || queue_.is_full()) continue;
    queue_.push(changed(frame, faults), now + faults.delay);
  }
}

CanFrame ModuleWire::changed(CanFrame frame, const ModuleWireFaults& faults) {
  const std::size_t kind = kind_of(frame);
  change_identity(kind, faults, frame);
  if (faults.balancing_cells) change_switches(kind, *faults.balancing_cells, frame);
  if (kind == kind_of(internal_bus::status)) add_flags(faults.undervoltage_flags, frame);
  if (kind != kind_of(internal_bus::response)) change_answer(kind, faults, frame);
  if (faults.node) frame.id = static_cast<std::uint32_t>(kind * ids_per_kind) + *faults.node;
  frame.data[7] = frame_crc(frame);
  if (faults.has_damaged_frames) frame.data[7] ^= 0x55U;
  return frame;
}

void ModuleWire::change_answer(std::size_t kind, const ModuleWireFaults& faults, CanFrame& frame) {
  Kept& kept = kept_[kind];
  if ((faults.is_stuck || faults.is_replaying) && kept.exists) {
    std::copy_n(kept.data.begin(), data_bytes, frame.data.begin());
  } else {
    kept = {frame.data, true};
  }
  if (faults.has_frozen_counter || faults.is_replaying) {
    frame.data[data_bytes] = counter_;
  } else {
    counter_ = frame.data[data_bytes];
  }
}

}  // namespace bmu
