// The bus of the pack's charger or inverter, apart from that of its modules: master, devices and another node on a wire
// with the same kinds of faults (faulty_wire.hpp). If the pack file has it so, the messages to the vehicle share it.
//
// It advances by whole milliseconds: at most one frame is completed in each, so that frames in the master's queue wait
// a little longer than on a real bus.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "tests/simulation/faulty_wire.hpp"
#include "tests/support/wired_pack.hpp"

namespace bmu::test {

class OuterBus {
 public:
  OuterBus(const CoreConfig& config, std::uint64_t seed);

  /// Whether the pack has a device on it.
  [[nodiscard]] bool is_there() const {
    return config_->charger.driver != nullptr || config_->inverter.driver != nullptr;
  }
  /// The master's port that receives its frames.
  [[nodiscard]] Port port() const { return port_; }

  /// Puts the master's frames into its queue here; those that do not fit have failed.
  void take_decided(const Decisions& decisions, WiredPack& pack);
  /// Every millisecond.
  void tick(WiredPack& pack);
  /// Power of the master's machine; state of its interface.
  void set_power(bool is_on, TimePoint now);
  void set_port(bool is_up, WiredPack& pack);
  [[nodiscard]] bool is_port_up() const { return is_port_up_; }
  /// Whether frames of the master do not come through as they should.
  [[nodiscard]] bool is_disturbed() const;

  FaultyWire wire;
  std::optional<CanFrame> flood;  // sent continuously by another node
  void send_as_stranger(const CanFrame& frame);
  /// A frame of the master is complete; `is_taken_in`: its devices have received it.
  std::function<void(const CanFrame& frame, bool is_taken_in)> on_carried;

 private:
  struct Due {
    TimePoint at;
    CanFrame frame;
  };
  void put(Station station, const CanFrame& frame);
  void carry(const CanFrame& frame, TimePoint now);
  void take_heard(const BusEvent& event, WiredPack& pack);

  const CoreConfig* config_;
  Port port_;
  CanBus bus_;
  std::vector<Due> late_;
  bool is_idle_ = true;  // no frame on the bus, and none waits
  bool is_port_up_ = true;
};

}  // namespace bmu::test
