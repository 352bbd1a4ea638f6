// One seed, lived: the plan's drive and faults on their stage, and the oracle beside it.
//
//   Outcome outcome = live(draw_plan(17), {});
//   if (outcome.violation) ...
//
// 3 s of settling, 40 s with drive and faults, then people put everything right: 25 s later faults are cleared with
// authority, the key is turned, and the pack has to close within 5 s. About a minute and a quarter in all. One with a
// charger on a bus is plugged in instead, and has to charge; one with an inverter has to be allowed something.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tests/simulation/oracle.hpp"
#include "tests/simulation/plan.hpp"

namespace bmu::test {

/// Somebody between the core and everything else, the oracle included, who does it harm: whether the oracle notices is
/// what mutants are for.
struct Mutant {
  std::string_view name;
  Rule noticed_by{};
  std::uint64_t seed = 0;  // in whose life it is noticed; another one is looked for if that is so no longer
  std::function<void(ObservedThing&, TimePoint)> told{};  // after the oracle has heard the real one
  std::function<void(Decisions&, const Stage&)> decided{};
  std::function<void(View&, TimePoint)> published{};
  std::function<void(Decisions&, TimePoint)> sent{};  // after the oracle has seen what was decided
};

struct LifeOptions {
  TimePoint starts_at = WiredPack::start;  // what the clock shows
  const Mutant* mutant = nullptr;
  std::ostream* trace = nullptr;  // what happens is told here
};

struct Outcome {
  std::optional<Violation> violation;
  std::uint64_t hash = 0;  // of all decisions, with their times since the start
  std::vector<TimedOpening> reactions;
  std::vector<const FaultKind*> faults;  // that have begun
  Duration lived{};
  std::uint64_t times_closed = 0;
  std::uint64_t times_opened = 0;
};

[[nodiscard]] Outcome live(const Plan& plan, const LifeOptions& options);

/// The plan with as few of its faults as break the same rule: each is left out in turn.
[[nodiscard]] Plan minimise(const Plan& plan, Rule rule, const LifeOptions& options);

}  // namespace bmu::test
