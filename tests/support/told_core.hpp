// A core on its bench, and what the status socket tells of a daemon besides: for tests of answers. Its bus is there and
// brings nothing.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "daemon/shell/status_view.hpp"
#include "tests/support/core_bench.hpp"
#include "tests/support/one_bus.hpp"

namespace bmu::test {

class QuietPort final : public BusPort {
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

struct ToldCore {
  CoreBench bench;
  std::string_view pack_name = "pack";
  Buses buses = one_bus(std::make_unique<QuietPort>());
  LoopCounters counters{};
  DriveRecord drive{};
  std::unique_ptr<StateStore> store = std::move(*StateStore::open({}));
  HistoryStore history{{}, {}};
  RateFinding rate{};

  [[nodiscard]] StatusView view(const UserNames& users) const {
    return {.core = bench.core(),
            .buses = buses,
            .loop = counters,
            .drive = drive,
            .store = *store,
            .history = history,
            .rate = rate,
            .users = users,
            .pack_name = pack_name,
            .cell_name = "cell",
            .now = bench.now()};
  }
};

}  // namespace bmu::test
