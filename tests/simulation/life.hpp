// Run of one seed: the plan's drive and faults on their stage, checked by the oracle.
//
//   Outcome outcome = live(draw_plan(17), {});
//   if (outcome.violation) ...
//
// 3 s of settling, then drive and faults until 40 s after the start, then all causes are removed: 25 s later faults are
// cleared with authority, the key is turned, and the pack has to close within 5 s. About a minute and a quarter in all.
// A pack with a charger on a bus is plugged in instead, and has to charge; one with an inverter has to allow it
// something.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tests/simulation/oracle.hpp"
#include "tests/simulation/plan.hpp"

namespace bmu::test {

/// A defect between the core and everything else, the oracle included: mutants test whether the oracle detects it.
struct Mutant {
  std::string_view name;
  Rule noticed_by{};
  std::uint64_t seed = 0;  // of a run in which it is detected; if it is not any more, another one is searched
  std::function<void(ObservedThing&, TimePoint)> told{};  // after the oracle has received the real one
  std::function<void(Decisions&, const Stage&)> decided{};
  std::function<void(View&, TimePoint)> published{};
  std::function<void(Decisions&, TimePoint)> sent{};  // after the oracle has received the decision
};

struct LifeOptions {
  TimePoint starts_at = WiredPack::start;  // value of the clock
  const Mutant* mutant = nullptr;
  std::ostream* trace = nullptr;  // log of the run
};

struct Outcome {
  std::optional<Violation> violation;
  std::uint64_t hash = 0;  // of all decisions, with their times since the start
  std::vector<TimedOpening> reactions;
  std::vector<const FaultKind*> faults;  // that have started
  Duration lived{};
  std::uint64_t times_closed = 0;
  std::uint64_t times_opened = 0;
};

[[nodiscard]] Outcome live(const Plan& plan, const LifeOptions& options);

/// The plan reduced to faults that break the same rule: each is left out in turn.
[[nodiscard]] Plan minimise(const Plan& plan, Rule rule, const LifeOptions& options);

}  // namespace bmu::test
