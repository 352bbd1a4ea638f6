// Reactions in a pack file: reactions that may be stricter, their parsing, and the effect on times with a budget.
#include <string>

#include "config/pack_changes.hpp"
#include "config/pack_config.hpp"
#include "daemon/core/faults/fault_table.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/changed_pack.hpp"
#include "tests/support/core_bench.hpp"

namespace bmu {
namespace {

/// Demonstration pack with one entry of "faults".
std::vector<Change> with(const std::string& fault, const Json& entry) {
  return {{"/faults", Json{{fault, entry}}}};
}

FaultReaction reaction_in(const std::string& fault, const Json& entry) {
  const auto pack = parse(changed(with(fault, entry)).dump());
  INFO((pack ? "" : all_text(pack.error())));
  REQUIRE(pack);
  REQUIRE(pack->core.stricter_reactions.size() == 1);
  for (const FaultRow& row : fault_table()) {
    if (row.name == fault) return reaction_of(row, pack->core.stricter_reactions);
  }
  FAIL("no such fault");
  return {};
}

}  // namespace

TEST_CASE("a pack file without the key leaves every reaction as it is", "[unit][config][reactions]") {
  const auto pack = parse(valid_pack().dump());
  REQUIRE(pack);
  CHECK(pack->core.stricter_reactions.empty());
  accepts({{"/faults", Json::object()}});
}

TEST_CASE("a reaction may be made stricter, and a grace shorter", "[unit][config][reactions]") {
  const FaultReaction low = reaction_in("supply_low", {{"reaction", "open_now"}});
  CHECK(low.reaction == Reaction::open_now);
  CHECK(low.grace == Duration{});
  CHECK(low.is_stricter);
  CHECK(reaction_in("module_warning", {{"reaction", "refuse_close"}}).reaction == Reaction::refuse_close);
  CHECK(reaction_in("cell_resistance", {{"reaction", "refuse_close"}}).reaction == Reaction::refuse_close);
  CHECK(reaction_in("cell_imbalance", {{"reaction", "open_now"}}).reaction == Reaction::open_now);
  const FaultReaction imbalance = reaction_in("cell_imbalance", {{"reaction", "open_after_grace"}, {"grace_ms", 249}});
  CHECK(imbalance.reaction == Reaction::open_after_grace);
  CHECK(imbalance.grace == 249ms);
  CHECK(reaction_in("disk_low", {{"reaction", "open_after_grace"}, {"grace_ms", 5'000}}).grace == 5s);
}

TEST_CASE("every fault takes each reaction that is stricter than its own, and refuses the others",
          "[unit][config][reactions][contract]") {
  const std::vector<std::pair<std::string, Reaction>> reactions{{"warn", Reaction::warn},
                                                                {"refuse_close", Reaction::refuse_close},
                                                                {"open_after_grace", Reaction::open_after_grace},
                                                                {"open_now", Reaction::open_now}};
  const Json pack = changed({{"/confirm/module_warning_ms", 100}});
  for (const FaultRow& row : fault_table()) {
    for (const auto& [word, reaction] : reactions) {
      INFO(row.name << ": " << word);
      Json entry{{"reaction", word}};
      if (reaction == Reaction::open_after_grace) entry["grace_ms"] = 1;
      Json tree = pack;
      tree["faults"] = {{std::string(row.name), entry}};
      const bool is_shorter = reaction == Reaction::open_after_grace && row.reaction == reaction;
      const bool is_stricter = reaction > row.reaction || is_shorter;
      const ConfigProblems problems = problems_of(tree.dump());
      INFO(all_text(problems));
      CHECK(problems.empty() == (is_stricter && reaction <= strictest_reaction(row)));
    }
  }
}

TEST_CASE("what is no fault, or no stricter reaction, is refused with what may stand there",
          "[unit][config][reactions]") {
  refuses(with("cell_imbalanse", {{"reaction", "open_now"}}), "/faults/cell_imbalanse", "cell_imbalance");
  refuses({{"/faults", 3}}, "/faults", "found 3");
  refuses(with("supply_low", "open_now"), "/faults/supply_low", "found \"open_now\"");
  refuses(with("supply_low", Json::object()), "/faults/supply_low/reaction", "required");
  refuses(with("supply_low", {{"reaction", "open_now"}, {"latch", true}}), "/faults/supply_low/latch", "grace_ms");
  refuses(with("supply_low", {{"reaction", "open"}}), "/faults/supply_low/reaction", "open_after_grace or open_now");
  refuses(with("supply_low", {{"reaction", "warn"}}), "/faults/supply_low/reaction",
          "found \"warn\", expected open_after_grace or open_now, stricter than the fault's own, refuse_close");
  refuses(with("cell_imbalance", {{"reaction", "refuse_close"}}), "/faults/cell_imbalance/reaction",
          "expected open_after_grace or open_now, stricter than the fault's own, open_after_grace");
  refuses(with("emergency_stop", {{"reaction", "open_now"}}), "/faults/emergency_stop",
          "expected no entry: this fault opens at once in every pack, which cannot be made stricter");
  refuses(with("emergency_stop", {{"reaction", "warn"}}), "/faults/emergency_stop", "cannot be made stricter");
  refuses(with("pack_resistance", {{"reaction", "open_now"}}), "/faults/pack_resistance/reaction",
          "expected refuse_close at most: one sample confirms this fault, and one alone opens nothing");
}

TEST_CASE("a grace stands exactly beside open_after_grace, and is shorter than the fault's own",
          "[unit][config][reactions]") {
  refuses(with("cell_imbalance", {{"reaction", "open_after_grace"}}), "/faults/cell_imbalance/grace_ms",
          "missing, expected a whole number from 1 to 249, less than the fault's own grace of 250 ms");
  refuses(with("cell_imbalance", {{"reaction", "open_after_grace"}, {"grace_ms", 250}}),
          "/faults/cell_imbalance/grace_ms", "found 250, expected a whole number from 1 to 249");
  refuses(with("supply_low", {{"reaction", "open_after_grace"}, {"grace_ms", 0}}), "/faults/supply_low/grace_ms",
          "found 0, expected a whole number from 1 to 5000");
  refuses(with("supply_low", {{"reaction", "open_after_grace"}, {"grace_ms", 5'001}}), "/faults/supply_low/grace_ms",
          "found 5001");
  refuses(with("supply_low", {{"reaction", "open_now"}, {"grace_ms", 20}}), "/faults/supply_low/grace_ms",
          "found 20, expected no grace beside open_now");
}

TEST_CASE("a shorter grace leaves more of the budget to the confirm time, a fault that opens has one",
          "[unit][config][reactions][FS_2]") {
  const Change slow{"/limits/cell_undertemperature/confirm_ms", 191};
  refuses({slow}, slow.first, "its grace of 150 ms included");
  accepts({slow, {"/faults", {{"cell_undertemperature", {{"reaction", "open_after_grace"}, {"grace_ms", 149}}}}}});
  accepts({{slow.first, 340}, {"/faults", {{"cell_undertemperature", {{"reaction", "open_now"}}}}}});
  refuses({{slow.first, 341}, {"/faults", {{"cell_undertemperature", {{"reaction", "open_now"}}}}}}, slow.first,
          "at most 340");

  const Change warning{"/confirm/module_warning_ms", 151};
  const auto opening = [](const Json& entry) { return Change{"/faults", Json{{"module_warning", entry}}}; };
  accepts({warning});
  accepts({warning, opening({{"reaction", "refuse_close"}})});
  refuses({warning, opening({{"reaction", "open_now"}})}, warning.first,
          "found 151, expected at most 150, so that module_warning, which opens this pack, does so within 450 ms");
  accepts({{warning.first, 150}, opening({{"reaction", "open_now"}})});
  accepts({{warning.first, 100}, opening({{"reaction", "open_after_grace"}, {"grace_ms", 50}})});
  refuses({{warning.first, 100}, opening({{"reaction", "open_after_grace"}, {"grace_ms", 51}})}, warning.first,
          "at most 99");
  refuses({opening({{"reaction", "open_after_grace"}, {"grace_ms", 150}})}, "/faults/module_warning/grace_ms",
          "less than 150");
}

TEST_CASE("a reload names a reaction that has changed", "[unit][config][reactions]") {
  const auto before = parse(valid_pack().dump());
  const auto now = parse(changed(with("supply_low", {{"reaction", "open_now"}})).dump());
  REQUIRE(before);
  REQUIRE(now);
  const auto changes = pack_changes(before->sources, now->sources);
  REQUIRE(changes.size() == 1);
  CHECK(to_text(changes[0]) == "pack.json: /faults: absent -> {\"supply_low\":{\"reaction\":\"open_now\"}}");
}

TEST_CASE("a fault that warns in every other pack opens this one, and keeps it open", "[unit][core][reactions]") {
  const auto opens = [](const CoreConfig& config) {
    test::CoreBench bench(config);
    REQUIRE(bench.close());
    bench.modules[0].board_too_hot = true;  // a bit of STATUS that module_warning reads
    REQUIRE(bench.run_until([&] { return bench.is_active(FaultId::module_warning); }, 2s));
    bench.run(100ms);
    const bool is_open = !bench.core().outputs().any_contactor();
    if (is_open) CHECK(bench.core().last_opening().fault == FaultId::module_warning);
    return is_open;
  };
  CoreConfig config = test::small_pack();
  CHECK_FALSE(opens(config));
  config.stricter_reactions.push_back({.fault = FaultId::module_warning, .reaction = Reaction::open_now});
  CHECK(opens(config));
}

}  // namespace bmu
