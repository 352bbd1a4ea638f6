// A charger or a load that conducts as soon as the main contacts make: its current moves the voltages of cells, pack
// and DC link between two samples of them, whatever their offset to the contact. There is no fault, and the first
// closing must be the last.
//
// Swept: the current, the offset of the devices' periods to the core's ticks, the rise of the DC link voltage, so that
// the precharge ends anywhere between its threshold and the pack voltage, and the time between the sensor's two
// voltages. Each combination is tried (whole_range.hpp).
#include <chrono>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "config/pack_config.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/whole_range.hpp"
#include "tests/support/wired_pack.hpp"

namespace bmu {
namespace {

using test::Fate;
using test::WholeRange;
using test::WiredPack;

CoreConfig pack_of(const std::string& name) {
  const auto pack = load_pack_config(test::in_source("config/packs/" + name + ".json"));
  REQUIRE(pack);
  return pack->core;
}

/// How the sensor sends its two voltages.
struct Apart {
  const MessageSpec* later = nullptr;  // none: together
  Duration by{};
};
const std::vector<Apart> together_and_apart{{}, {&internal_bus::sensor_u1, 25ms}, {&internal_bus::sensor_u2, 25ms}};

struct Sweep {
  std::string pack;
  std::string request;             // the close request
  std::vector<std::string> draws;  // events that set the current
  std::vector<Apart> voltages;
  std::vector<int> capacitances_uF;
};

/// Devices that have run for this long, ready for a close request.
WiredPack ready_pack(const CoreConfig& config, int ahead_ms, const Apart& apart) {
  WiredPack pack(config, std::chrono::milliseconds(ahead_ms));
  // Such a sample is older than its time of arrival.
  if (apart.later != nullptr) {
    const Apart held = apart;
    pack.on_sent = [held](CanFrame& frame, const WiredPack&) {
      return frame.id == held.later->base_id ? Fate{.delay = held.by} : Fate{};
    };
  }
  pack.apply("pack soc_permille 300; charger obeys nobody");
  pack.run(1800ms);
  return pack;
}

/// One closing: whether the pack stayed closed at its first attempt.
bool closes(WiredPack pack, const std::string& events) {
  pack.apply(events);
  const bool has_closed = pack.run_until([](const WiredPack& it) { return it.phase() == Phase::closed; }, 4s);
  if (!has_closed) return false;
  pack.run(500ms);
  return pack.phase() == Phase::closed && pack.phases_entered(Phase::main_positive) == 1;
}

std::string text_of(const Sweep& sweep, const Apart& apart, int ahead_ms, const std::string& events) {
  return sweep.pack + ", devices " + std::to_string(ahead_ms) + " ms ahead, " +
         (apart.later ? std::string(apart.later->name) : "no voltage") + " later; " + events;
}

void sweep_all(WholeRange& range, const Sweep& sweep) {
  const CoreConfig config = pack_of(sweep.pack);
  for (std::size_t apart = 0; apart < sweep.voltages.size(); ++apart) {
    for (std::size_t ahead = 0; ahead < 5; ++ahead) {
      const int ahead_ms = static_cast<int>(ahead) * 13;
      std::optional<WiredPack> ready;
      for (std::size_t draw = 0; draw < sweep.draws.size(); ++draw) {
        for (std::size_t capacitance = 0; capacitance < sweep.capacitances_uF.size(); ++capacitance) {
          const std::string events = "link capacitance_uF " + std::to_string(sweep.capacitances_uF[capacitance]) +
                                     "; " + sweep.draws[draw] + "; " + sweep.request;
          const auto text = text_of(sweep, sweep.voltages[apart], ahead_ms, events);
          range.attempt(text, apart + ahead + draw + capacitance, [&] {
            if (!ready) ready = ready_pack(config, ahead_ms, sweep.voltages[apart]);
            return closes(*ready, events) ? "" : "it does not stay closed at its first try";
          });
        }
      }
    }
  }
}

void check(const std::vector<Sweep>& sweeps) {
  WholeRange range;
  for (const Sweep& sweep : sweeps) sweep_all(range, sweep);
  range.check();
}

TEST_CASE("a pack stays closed at its first try, whatever current flows as soon as the contacts make",
          "[property][contactors]") {
  check({{.pack = "demo-48s",
          .request = "charger connected",
          .draws = {"charger current_A 10", "charger current_A 15"},
          .voltages = together_and_apart,
          .capacitances_uF = {500, 620, 740}},
         {.pack = "demo-48s",
          .request = "vehicle on",
          .draws = {"load current_A 10", "load current_A 60"},
          .voltages = together_and_apart,
          .capacitances_uF = {500, 620, 740}}});
}

TEST_CASE("a pack of 192 cells stays closed at its first try, whatever current flows as soon as the contacts make",
          "[property][contactors][slow]") {
  check({{.pack = "traction-16x12",
          .request = "charger connected",
          .draws = {"charger current_A 1", "charger current_A 20"},
          .voltages = together_and_apart,
          .capacitances_uF = {500, 620, 740, 1000, 2000}},
         {.pack = "traction-16x12",
          .request = "vehicle on",
          .draws = {"load current_A 60"},
          .voltages = together_and_apart,
          .capacitances_uF = {500, 620, 740, 1000, 2000}}});
}

}  // namespace
}  // namespace bmu
