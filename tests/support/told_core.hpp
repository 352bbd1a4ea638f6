// A core on its bench, and the other data of a daemon that the status socket reports: for tests of its replies. Its bus
// is up and delivers nothing.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "daemon/shell/status/status_view.hpp"
#include "tests/support/core_bench.hpp"
#include "tests/support/one_bus.hpp"
#include "tests/support/quiet_port.hpp"

namespace bmu::test {

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
