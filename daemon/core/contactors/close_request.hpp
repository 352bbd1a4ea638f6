// Close request: the edges of the inputs vehicle-on and charger-connected.
//
// Closing requires an edge: an input that was off since start, or since the inputs were last unknown, and then switched
// on. Each input has a request of its own, which ends with the input: unplugging a charger ends its request and does
// not leave the pack closed for a key that has not been turned since.
#pragma once

#include "daemon/core/measurement/sensor_table.hpp"
#include "protocol/fields.hpp"

namespace bmu {

class CloseRequest {
 public:
  /// Updates the requests from the inputs of a fresh PDU state. True if this changed is_present().
  bool follow(const PduState& pdu, bool contactors_open, TimePoint now);
  /// The inputs are unknown: the next state gives their levels, and no edge.
  void lose_sight() { lines_known_ = false; }
  /// Ends the present requests, after an opening for a reason or a refusal.
  void drop();
  /// Ends the charger's request alone.
  void drop_charger();
  /// Lets a charger that stayed plugged in request again, as by an edge of its input.
  void plug_in_again() { charger_.was_on = false; }

  [[nodiscard]] bool is_present() const { return vehicle_.is_wished || charger_.is_wished; }
  [[nodiscard]] bool is_by_vehicle() const { return vehicle_.is_wished; }
  [[nodiscard]] bool is_by_charger() const { return charger_.is_wished; }
  [[nodiscard]] TimePoint since() const { return since_; }
  /// The charger requested last, and its input has ended. Implies that no request is present: while the vehicle
  /// requests, it counts as the last.
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
