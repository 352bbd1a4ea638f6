// The bus on which the pack's charger or inverter is, apart from that of its modules: master, devices and a stranger on
// a wire that fails as the other does (faulty_wire.hpp). Where the pack file has it so, the messages to the vehicle
// share it.
//
// It goes by whole milliseconds: at most one frame is through in each, so that what waits in the master's queue waits
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

  /// The pack has somebody on it.
  [[nodiscard]] bool is_there() const {
    return config_->charger.driver != nullptr || config_->inverter.driver != nullptr;
  }
  /// Which port of the master tells its frames.
  [[nodiscard]] Port port() const { return port_; }

  /// What the master sends goes into its queue here; what does not fit it has failed.
  void take_decided(const Decisions& decisions, WiredPack& pack);
  /// Every millisecond.
  void tick(WiredPack& pack);
  /// Of the master's machine, and back; of its interface.
  void set_power(bool is_on, TimePoint now);
  void set_port(bool is_up, WiredPack& pack);
  [[nodiscard]] bool is_port_up() const { return is_port_up_; }
  /// Frames of the master do not come through as they should.
  [[nodiscard]] bool is_disturbed() const;

  FaultyWire wire;
  std::optional<CanFrame> flood;  // whenever the stranger has sent it, it sends it again
  void send_as_stranger(const CanFrame& frame);
  /// A frame of the master is through; whether its devices took it in.
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
  bool is_idle_ = true;  // nothing is carried, and nobody waits
  bool is_port_up_ = true;
};

}  // namespace bmu::test
