// Cost of an answer of the status socket for the control loop, which makes it and decides nothing meanwhile.
#include <memory>

#include <benchmark/benchmark.h>

#include "daemon/shell/status/status_requests.hpp"
#include "tests/support/told_core.hpp"

namespace bmu {

namespace {

/// A pack of 4 modules of 12 cells that drives, if requested with an earlier freeze frame of each fault.
test::ToldCore driving(bool is_recorded) {
  PersistentState state;
  for (FaultRecord& record : state.faults) {
    if (!is_recorded) break;
    record = {
        .count = 3,
        .first_unix_time_ms = 1'700'000'000'000,
        .last_unix_time_ms = 1'700'000'000'000,
        .cleared = ClearRecord{.unix_time_ms = 1'700'000'000'000},
        .frame = FreezeFrame{.unix_time_ms = 1'700'000'000'000, .outputs = ContactorOutputs{}, .inputs = PduState{}}};
  }
  test::CoreBench bench(test::pack_of(4), state);
  static_cast<void>(bench.close());
  return {.bench = bench};
}

class Desk {
 public:
  explicit Desk(bool is_recorded) : told_(driving(is_recorded)) {}

  [[nodiscard]] const StatusRequests& requests() const { return requests_; }

 private:
  test::ToldCore told_;
  Access access_{{.own_user_id = 0}, UserNames("/dev/null"), [](std::string_view) {}};
  StatusRequests requests_{{.make_view = [this] { return told_.view(access_.users()); },
                            .carry_out = [](const CommandGiven&) {},
                            .log = [](std::string_view) {},
                            .access = access_,
                            .reload = [](const Peer&) { return StatusReply{}; }}};
};

void answer(benchmark::State& state, std::string_view command) {
  const Desk desk(state.range(0) != 0);
  const std::string request = Json{{"cmd", command}}.dump();
  std::size_t length = 0;
  for ([[maybe_unused]] auto _ : state) length = desk.requests().answer(request, {.user_id = 0}).line.size();
  state.counters["bytes"] = static_cast<double>(length);
}

/// The update for all watching clients, made once for all.
void answer_picture(benchmark::State& state) {
  const Desk desk(state.range(0) != 0);
  std::size_t length = 0;
  for ([[maybe_unused]] auto _ : state) length = desk.requests().picture().size();
  state.counters["bytes"] = static_cast<double>(length);
}

// Without and with a record of each fault.
BENCHMARK_CAPTURE(answer, status, "status")->Arg(0)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(answer, cells, "cells")->Arg(0)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(answer, why, "why")->Arg(0)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(answer, modules, "modules")->Arg(0)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(answer, health, "health")->Arg(0)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(answer, balance, "balance")->Arg(0)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(answer, faults, "faults")->Arg(0)->Arg(1)->Unit(benchmark::kMicrosecond);
BENCHMARK(answer_picture)->Arg(0)->Arg(1)->Unit(benchmark::kMicrosecond);

}  // namespace

}  // namespace bmu
