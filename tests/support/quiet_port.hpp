// A bus that is up and delivers nothing; sent frames are discarded.
#pragma once

#include <cstdint>
#include <string>

#include "daemon/shell/can/bus_port.hpp"

namespace bmu::test {

class QuietPort : public BusPort {
 public:
  [[nodiscard]] int fd() const override { return -1; }
  [[nodiscard]] ReadStatus read(ReceivedFrame& /*out*/) override { return ReadStatus::empty; }
  [[nodiscard]] Result<void, SendError> send(const CanFrame& /*frame*/) override { return {}; }
  void maintain() override {}
  [[nodiscard]] BusState state() const override { return BusState::up; }
  [[nodiscard]] std::uint64_t frames_lost() const override { return 0; }
  [[nodiscard]] const std::string& name() const override { return name_; }
  [[nodiscard]] std::string last_error() const override { return {}; }

 private:
  std::string name_ = "can0";
};

}  // namespace bmu::test
