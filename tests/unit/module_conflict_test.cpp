// Two modules under one node number: which contradictions are one answer, and for how long one is remembered.
#include "daemon/core/module_table.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;

namespace {

constexpr TimePoint start{10s};

/// A table in which node 1 was contradicted at `start`.
ModuleTable contradicted_once() {
  ModuleTable table;
  table.init(test::small_pack());
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

TEST_CASE("frames within 50 ms are one answer and contradict once", "[unit][modules][F30]") {
  ModuleTable table = contradicted_once();
  table.note_conflict(1, start + 50ms - 1ns);
  CHECK(rival_seen_at(table) == TimePoint{});
  table.note_conflict(1, start + 50ms);
  CHECK(rival_seen_at(table) == start + 50ms);
}

TEST_CASE("a second contradiction within 15 s means two modules, a later one is the first again",
          "[unit][modules][F30]") {
  ModuleTable within = contradicted_once();
  within.note_conflict(1, start + 15s);
  CHECK(rival_seen_at(within) == start + 15s);
  ModuleTable later = contradicted_once();
  later.note_conflict(1, start + 15s + 1ns);
  CHECK(rival_seen_at(later) == TimePoint{});
  later.note_conflict(1, start + 30s);
  CHECK(rival_seen_at(later) == start + 30s);
}

TEST_CASE("a contradiction concerns its own node, and a node that is not ours nobody", "[unit][modules][F30]") {
  ModuleTable table = contradicted_once();
  table.note_conflict(2, start + 1s);
  table.note_conflict(9, start + 1s);
  table.note_conflict(9, start + 2s);
  CHECK(rival_seen_at(table) == TimePoint{});
  CHECK(table.find(2)->rival_seen_at == TimePoint{});
}
