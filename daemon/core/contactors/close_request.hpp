// Who asks for a closed pack: the edges of vehicle-on and charger-connected.
//
// Closing needs an edge: a line that was seen off since start, or since we last knew nothing, and then came on. Each
// line has a wish of its own, which ends with the line: a charger that is pulled out takes its wish with it and does
// not leave the pack closed for a key that has not been turned since.
#pragma once

#include "daemon/core/measurement/sensor_table.hpp"
#include "protocol/fields.hpp"

namespace bmu {

class CloseRequest {
 public:
  /// The lines of a fresh word of the unit. True if this changed whether somebody asks.
  bool follow(const PduState& pdu, bool contactors_open, TimePoint now);
  /// Nobody knows the lines: the next word shows where they stand, and no edge.
  void lose_sight() { lines_known_ = false; }
  /// The wishes so far have been dealt with: opened for a reason, or refused.
  void drop();
  /// The charger's alone.
  void drop_charger();
  /// A charger that stayed plugged in asks again: as an edge of its line.
  void plug_in_again() { charger_.was_on = false; }

  [[nodiscard]] bool is_present() const { return vehicle_.is_wished || charger_.is_wished; }
  [[nodiscard]] bool is_by_vehicle() const { return vehicle_.is_wished; }
  [[nodiscard]] bool is_by_charger() const { return charger_.is_wished; }
  [[nodiscard]] TimePoint since() const { return since_; }
  /// The charger asked last, and its line has ended. Nobody asks then: a vehicle that asks has asked last.
  [[nodiscard]] bool is_unplugged() const { return has_charger_asked_last_ && !is_plugged_in_; }

 private:
  struct Line {
    bool was_on = false;
    bool is_wished = false;

    void follow(bool is_on);
  };

  Line vehicle_;
  Line charger_;
  bool lines_known_ = false;
  bool is_plugged_in_ = false;
  bool has_charger_asked_last_ = false;  // where both did, the vehicle has
  TimePoint since_{};
  BMU_FIELDS(vehicle_, charger_, lines_known_, is_plugged_in_, has_charger_asked_last_, since_)
};

}  // namespace bmu
