// Monitor of the state of the buses, and of nodes that must not be on them.
//
// A controller that goes bus-off repeatedly needs repair, not a restart: three times within a minute is a fault of its
// own. An observation is kept for as long as it is valid for the present.
#pragma once

#include <array>
#include <cstdint>

#include "protocol/fields.hpp"
#include "protocol/time.hpp"

namespace bmu {

class BusWatch {
 public:
  static constexpr std::size_t storm_count = 3;
  static constexpr Duration storm_span = 60s;
  /// A single frame of a module that the pack does not have may be chance; a second one within this time confirms a
  /// module.
  static constexpr Duration stranger_memory = 5s;
  static constexpr Duration reporter_memory = 5s;
  static constexpr Duration misplaced_memory = 5s;

  void note_bus_off(TimePoint at);
  void note_error_passive(bool is_passive) { is_error_passive_ = is_passive; }
  void note_unknown_module(std::uint8_t node, TimePoint at);
  /// The module has another node now.
  void forget_unknown_module(std::uint8_t node);
  /// Another node sends the messages of 620h to 628h.
  void note_foreign_report(TimePoint at) { foreign_report_at_ = at; }

  /// A frame on the vehicle bus that indicates swapped buses (swapped_buses.hpp).
  void note_misplaced_frame(TimePoint at) { misplaced_at_ = at; }

  [[nodiscard]] bool is_storm(TimePoint now) const;
  [[nodiscard]] bool is_error_passive() const { return is_error_passive_; }
  /// Node number of the unknown module; 0: none.
  [[nodiscard]] std::uint8_t unknown_module(TimePoint now) const;
  [[nodiscard]] bool has_foreign_report(TimePoint now) const;
  [[nodiscard]] bool has_misplaced_frames(TimePoint now) const;
  [[nodiscard]] TimePoint unknown_module_at() const { return unknown_at_; }
  [[nodiscard]] TimePoint foreign_report_at() const { return foreign_report_at_; }

 private:
  std::array<TimePoint, storm_count> bus_off_at_{};  // a ring
  std::size_t head_ = 0;
  bool is_error_passive_ = false;
  std::uint8_t unknown_node_ = 0;
  TimePoint unknown_at_{};            // its latest frame
  TimePoint unknown_confirmed_at_{};  // its latest confirming frame
  TimePoint foreign_report_at_{};
  TimePoint misplaced_at_{};
  [[nodiscard]] bool are_fields_possible() const { return head_ < bus_off_at_.size(); }
  BMU_FIELDS(bus_off_at_, head_, is_error_passive_, unknown_node_, unknown_at_, unknown_confirmed_at_,
             foreign_report_at_, misplaced_at_)
};

}  // namespace bmu
