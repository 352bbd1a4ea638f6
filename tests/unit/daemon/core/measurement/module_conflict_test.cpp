// Two modules with one node number: which conflicts belong to one answer, and how long a conflict is remembered.
#include "daemon/core/measurement/module_table.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;

namespace {

constexpr TimePoint start{10s};

/// Table with a conflict of node 1 at `start`, in its answer to the POLL 5 ms before.
ModuleTable contradicted_once() {
  ModuleTable table;
  table.init(test::small_pack());
  table.begin_cycle(start - 5ms, {});
  table.note_conflict(1, start);
  return table;
}

TimePoint rival_seen_at(const ModuleTable& table) {
  return table.find(1)->rival_seen_at;
}

}  // namespace

TEST_CASE("one contradiction may be chance", "[unit][modules][F30]") {
  CHECK(rival_seen_at(contradicted_once()) == TimePoint{});
}

TEST_CASE("all frames between two questions are one answer and contradict once", "[unit][modules][F30]") {
  ModuleTable table = contradicted_once();
  table.note_conflict(1, start + 1ms);
  table.note_conflict(1, start + 100ms);
  CHECK(rival_seen_at(table) == TimePoint{});
  table.begin_single(2, start + 110ms);  // poll of another module
  table.note_conflict(1, start + 111ms);
  CHECK(rival_seen_at(table) == TimePoint{});
}

TEST_CASE("answers to two questions contradict twice, however close the questions are", "[unit][modules][F30]") {
  ModuleTable polled = contradicted_once();
  polled.begin_cycle(start + 15ms, {});
  polled.note_conflict(1, start + 16ms);
  CHECK(rival_seen_at(polled) == start + 16ms);
  ModuleTable asked_alone = contradicted_once();
  asked_alone.begin_single(1, start + 10ms);
  asked_alone.note_conflict(1, start + 11ms);
  CHECK(rival_seen_at(asked_alone) == start + 11ms);
}

TEST_CASE("a second contradiction within 15 s means two modules, a later one is the first again",
          "[unit][modules][F30]") {
  const auto contradict = [](ModuleTable& table, TimePoint at) {
    table.begin_cycle(at - 5ms, {});
    table.note_conflict(1, at);
  };
  ModuleTable within = contradicted_once();
  contradict(within, start + 15s);
  CHECK(rival_seen_at(within) == start + 15s);
  ModuleTable later = contradicted_once();
  contradict(later, start + 15s + 1ns);
  CHECK(rival_seen_at(later) == TimePoint{});
  contradict(later, start + 30s);
  CHECK(rival_seen_at(later) == start + 30s);
}

TEST_CASE("a contradiction concerns its own node, and a node that is not ours nobody", "[unit][modules][F30]") {
  ModuleTable table = contradicted_once();
  table.begin_cycle(start + 1s, {});
  table.note_conflict(2, start + 1s);
  table.note_conflict(9, start + 1s);
  table.note_conflict(9, start + 2s);
  CHECK(rival_seen_at(table) == TimePoint{});
  CHECK(table.find(2)->rival_seen_at == TimePoint{});
}
