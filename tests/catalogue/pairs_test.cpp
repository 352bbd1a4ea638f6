// Row 104: two faults at once. Row 105: a fault in each step of the closing.
#include <algorithm>
#include <cstdlib>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "mmu/devices/random.hpp"
#include "tests/catalogue/catalogue.hpp"
#include "tests/support/catch.hpp"

namespace bmu::test {
namespace {

constexpr std::uint64_t usual_seed = 1;

struct Opening {
  const Case* what;
  Duration allowed;
};

/// Cases of rows 1 to 30 that open a closed pack.
std::vector<Opening> openings() {
  std::vector<Opening> cases;
  for (const Row* row : all_rows()) {
    if (row->number > 30 || !row->state.empty()) continue;
    for (const Case& one : row->cases) {
      const bool opens = one.outcome == Outcome::opens && one.until == Until::command;
      if (opens && one.in_phase == Phase::closed && one.inject) cases.push_back({&one, row->allowed});
    }
  }
  return cases;
}

/// The second does not undo the first: two that forge the same frames may make correct ones of them.
bool can_be_together(const Case& one, const Case& other, const WiredPack& pack) {
  WiredPack with_one = pack;
  WiredPack with_other = pack;
  one.inject(with_one);
  other.inject(with_other);
  return !(with_one.on_sent && with_other.on_sent) && !(with_one.each_ms && with_other.each_ms);
}

Duration configured(const Case& one, const Pack& pack) {
  return one.configured(pack.config, *find_fault(one.fault));
}

std::uint64_t seed() {
  const char* const wanted = std::getenv("BMUD_SEED");
  return wanted == nullptr ? usual_seed : std::strtoull(wanted, nullptr, 10);
}

/// A part of the pairs, from the first one on: "2/3" are the second, fifth, ... All of them take minutes.
struct Part {
  std::size_t first = 0;
  std::size_t of = 1;
};
Part wanted_part() {
  const char* const wanted = std::getenv("BMUD_PAIRS_PART");
  if (wanted == nullptr) return {};
  std::size_t number = 0;
  std::size_t of = 0;
  char slash = 0;
  std::istringstream text(wanted);
  const bool is_part = text >> number >> slash >> of && slash == '/' && number >= 1 && number <= of && text.eof();
  INFO("BMUD_PAIRS_PART: found '" << wanted << "', expected K/N, as 2/3");
  REQUIRE(is_part);
  return {.first = number - 1, .of = of};
}

}  // namespace

namespace {

constexpr std::size_t pairs_of_large_pack = 60;

using Faults = std::vector<std::string_view>;

bool has(const Faults& faults, const Case& one) {
  return std::find(faults.begin(), faults.end(), one.fault) != faults.end();
}

// Each list is of one quantity of the emulated pack: the later cause would replace the earlier.
const Faults last_cells_voltage{"cell_overvoltage", "cell_undervoltage", "cell_deep_discharge", "cell_imbalance"};
const Faults temperatures{"cell_overtemperature", "cell_undertemperature", "charge_overtemperature",
                          "charge_undertemperature", "temperature_rise"};
const Faults currents{"discharge_overcurrent", "charge_overcurrent", "current_contradicts_voltage", "stuck_values"};

bool are_of_one_thing(const Case& one, const Case& other) {
  const auto are_both_of = [&](const Faults& faults) { return has(faults, one) && has(faults, other); };
  return are_both_of(last_cells_voltage) || are_both_of(temperatures) || are_both_of(currents);
}

const Faults of_modules{"cell_overvoltage",
                        "cell_undervoltage",
                        "cell_deep_discharge",
                        "cell_imbalance",
                        "cell_overtemperature",
                        "cell_undertemperature",
                        "charge_overtemperature",
                        "charge_undertemperature",
                        "temperature_rise",
                        "board_overtemperature",
                        "temperature_not_measured",
                        "cell_not_measured",
                        "open_wire",
                        "module_disturbed",
                        "duplicate_node",
                        "pack_voltage_mismatch",
                        "stuck_values"};
const Faults of_temperatures{"cell_overtemperature",    "cell_undertemperature", "charge_overtemperature",
                             "charge_undertemperature", "temperature_rise",      "board_overtemperature"};

/// Faults that the cause of another one hides while both last.
struct Hiding {
  Faults by;
  Faults faults;
};
const std::vector<Hiding> hidings{
    // A module that sends nothing, nothing valid or nothing new.
    {{"module_lost", "module_disturbed", "stuck_values"}, of_modules},
    // Cells without a measurement cannot be wrong, nor can their sum; nor can sensors without one.
    {{"cell_not_measured", "open_wire"}, last_cells_voltage},
    {{"cell_not_measured", "open_wire", "voltage_sensor_lost", "current_sensor_lost"}, {"pack_voltage_mismatch"}},
    {{"cell_not_measured"}, {"stuck_values"}},
    {{"temperature_not_measured"}, of_temperatures},
    {{"current_sensor_lost"}, {"current_sensors_disagree"}},
    // A cell that is reported higher or lower moves the sum to the sensor's error.
    {last_cells_voltage, {"pack_voltage_mismatch"}},
    // A changed counter comes with a new checksum.
    {{"pdu_opened_by_itself"}, {"pdu_lost"}},
};

bool is_hidden(const Case& one, const Case& other) {
  constexpr std::string_view all_silent = "everybody but the master falls silent";
  if (other.what == all_silent) return true;
  return std::any_of(hidings.begin(), hidings.end(),
                     [&](const Hiding& each) { return has(each.faults, one) && has(each.by, other); });
}

/// The shorter time of the visible faults.
Duration allowed_for(const Opening& first, const Opening& second) {
  const bool is_first_hidden = is_hidden(*first.what, *second.what);
  const bool is_second_hidden = is_hidden(*second.what, *first.what);
  if (is_first_hidden && !is_second_hidden) return second.allowed;
  if (is_second_hidden && !is_first_hidden) return first.allowed;
  return std::min(first.allowed, second.allowed);
}

/// A closed pack with the configuration and preparation of both cases; none if they need different requests, or each a
/// preparation of its own.
std::optional<WiredPack> closed_for(const Case& one, const Case& other, const Pack& pack) {
  if (one.switch_on != other.switch_on || (one.prepare && other.prepare)) return std::nullopt;
  CoreConfig config = config_for(one, pack);
  if (other.fit != nullptr) other.fit(config);
  WiredPack closed(config);
  closed.run(2500ms);
  for (const Case* each : {&one, &other}) {
    if (each->prepare) each->prepare(closed);
  }
  closed.apply(one.switch_on);
  REQUIRE(closed.run_until([](const WiredPack& now) { return now.phase() == Phase::closed; }, 5s));
  closed.run(500ms);
  return closed;
}

/// Both faults at once: open within the shorter time, each reported within its own, and nothing closes again.
void check_pair(const Opening& first, const Opening& second, WiredPack pack) {
  const Case& one = *first.what;
  const Case& other = *second.what;
  const TimePoint broken_at = pack.now();
  one.inject(pack);
  other.inject(pack);
  INFO("'" << one.fault << "' and '" << other.fault << "'");
  const Duration opens_within = allowed_for(first, second);
  CHECK(pack.run_until([](const WiredPack& now) { return is_open(now, Until::command); }, opens_within));
  const auto is_told = [&](const Case& what, const Case& beside, Duration allowed) {
    // The first opening ends a fault that only a closed pack shows; but one of the two must be present.
    if (is_hidden(what, beside)) return true;
    if (!what.is_seen_open && !is_hidden(beside, what)) return true;
    return pack.run_until([&](const WiredPack& now) { return is_present(now, what.fault); },
                          broken_at + allowed + 100ms - pack.now());
  };
  CHECK(is_told(one, other, first.allowed));
  CHECK(is_told(other, one, second.allowed));
  CHECK((is_present(pack, one.fault) || is_present(pack, other.fault)));
  pack.run(13s);
  CHECK_FALSE(pack.coils_are_driven());
}

}  // namespace

TEST_CASE("F104: every two faults at once open within the shorter of their times, and both are told",
          "[catalogue][F104][slow]") {
  const std::vector<Opening> cases = openings();
  REQUIRE(cases.size() > 40);
  const std::uint64_t used = seed();
  RandomSource random(used);
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (std::size_t one = 0; one < cases.size(); ++one) {
    for (std::size_t other = one + 1; other < cases.size(); ++other) pairs.emplace_back(one, other);
  }
  const Part part = wanted_part();
  std::size_t on_large = 0;
  std::size_t tried = 0;
  for (std::size_t index = 0; index < pairs.size(); ++index) {
    const Opening& first = cases[pairs[index].first];
    const Opening& second = cases[pairs[index].second];
    const bool is_for_large = random.next() % pairs.size() < pairs_of_large_pack;
    const auto waits = Duration{1ms} * static_cast<std::int64_t>(random.next() % 500);
    if (index % part.of != part.first) continue;
    for (const Pack& config : packs()) {
      const bool is_large = &config != &packs().front();
      if (is_large && !is_for_large) continue;
      INFO(first.what->what << "; " << second.what->what << "; pack of " << config.name);
      INFO("to repeat: BMUD_SEED=" << used << " BMUD_PAIRS_PART=" << index + 1 << '/' << pairs.size()
                                   << " test_catalogue \"[F104]\"");
      if (are_of_one_thing(*first.what, *second.what)) continue;
      std::optional<WiredPack> pack = closed_for(*first.what, *second.what, config);
      if (!pack) continue;
      pack->run(waits);
      if (!can_be_together(*first.what, *second.what, *pack)) continue;
      check_pair(first, second, std::move(*pack));
      ++tried;
      on_large += is_large ? 1 : 0;
    }
  }
  CHECK(tried >= 500 / part.of);
  CHECK(on_large >= 20 / part.of);
}

namespace {

struct Step {
  std::string_view name;
  Phase phase;
};
constexpr Step steps[] = {{"main negative", Phase::main_negative},
                          {"precharge", Phase::precharge},
                          {"main positive", Phase::main_positive},
                          {"closed", Phase::closed}};

}  // namespace

/// In each step of the closing, at its beginning and at every few milliseconds of it, a fault has the same effect as in
/// a closed pack, in the same time. A fault that only shows in a closed pack (a current, a contact) is left out here.
TEST_CASE("F105: a fault in a step of the closing opens as it does later", "[catalogue][F105][slow]") {
  const std::vector<Opening> cases = openings();
  for (const Pack& config : packs()) {
    for (const Opening& opening : cases) {
      const Case* const one = opening.what;
      if (!one->is_seen_open || one->prepare || one->fit != nullptr || one->configured == nullptr) continue;
      for (const Step& step : steps) {
        for (const Duration later : {0ms, 13ms, 26ms, 49ms}) {
          INFO(one->what << ", in step " << step.name << " after " << ms_text(later) << " ms, pack of " << config.name);
          Case in_step = *one;
          in_step.in_phase = step.phase;
          const std::optional<WiredPack> begun = pack_in(in_step, config);
          REQUIRE(begun);
          WiredPack pack = *begun;
          pack.run(later);
          const TimePoint broken_at = pack.now();
          one->inject(pack);
          const bool is_opened = pack.run_until([](const WiredPack& now) { return is_open(now, Until::command); }, 2s);
          REQUIRE(is_opened);
          CHECK(pack.now() - broken_at <= configured(*one, config));
          CHECK(pack.run_until([&](const WiredPack& now) { return is_present(now, one->fault); }, 200ms));
        }
      }
    }
  }
}

/// In an open pack a fault is reported in its time and keeps the pack open; during the opening it does not delay it.
TEST_CASE("F105: a fault in an open pack, or while it opens, is told, and nothing closes", "[catalogue][F105][slow]") {
  const auto is_phase = [](Phase phase) { return [phase](const WiredPack& now) { return now.phase() == phase; }; };
  for (const Pack& config : packs()) {
    WiredPack loaded = closed_pack(config);
    loaded.apply("load current_A 80");
    loaded.run(500ms);
    for (const Opening& opening : openings()) {
      const Case& one = *opening.what;
      if (!one.is_seen_open || one.prepare || one.fit != nullptr || one.configured == nullptr) continue;
      if (one.fault == "pdu_opened_by_itself") continue;  // an open pack cannot be opened
      for (const Phase phase : {Phase::open, Phase::ramp_down, Phase::breaking}) {
        INFO(one.what << ", in step " << to_text(phase) << ", pack of " << config.name);
        WiredPack pack = loaded;
        pack.apply("vehicle off");
        REQUIRE(pack.run_until(is_phase(phase), 2s));
        const TimePoint broken_at = pack.now();
        one.inject(pack);
        CHECK(pack.run_until([](const WiredPack& now) { return is_open(now, Until::command); }, 300ms));
        CHECK(pack.run_until([&one](const WiredPack& now) { return is_present(now, one.fault); },
                             broken_at + configured(one, config) + 100ms - pack.now()));
        pack.apply("vehicle on");
        CHECK_FALSE(pack.run_until([](const WiredPack& now) { return now.coils_are_driven(); }, 12s));
      }
    }
  }
}

TEST_CASE("F105: in whatever step the daemon dies, the coils are released within a quarter of a second",
          "[catalogue][F105]") {
  for (const Pack& config : packs()) {
    for (const Phase phase : all_phases) {
      for (const Duration later : {0ms, 7ms, 23ms, 41ms}) {
        INFO("in step " << to_text(phase) << " after " << ms_text(later) << " ms, pack of " << config.name);
        const bool is_on_the_way_back = phase == Phase::ramp_down || phase == Phase::breaking;
        const Case there{.what = "", .in_phase = is_on_the_way_back ? Phase::closed : phase};
        std::optional<WiredPack> pack = pack_in(there, config);
        REQUIRE(pack);
        if (is_on_the_way_back) {
          pack->apply("load current_A 80");
          pack->run(500ms);
          pack->apply("vehicle off");
          REQUIRE(pack->run_until([phase](const WiredPack& now) { return now.phase() == phase; }, 2s));
        }
        pack->run(later);
        const bool were_driven = pack->coils_are_driven();
        pack->stall(251ms);
        CHECK_FALSE(pack->coils_are_driven());
        if (phase == Phase::closed) CHECK(were_driven);
      }
    }
  }
}

}  // namespace bmu::test
