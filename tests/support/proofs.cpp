#include "tests/support/proofs.hpp"

#include <algorithm>
#include <fstream>

#include "protocol/tables/vehicle_bus.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"

namespace bmu::test {

namespace {

/// A decision, and a late one in a process.
constexpr Duration decision = 20ms;
/// Reaction to a module's answers, of any maker (docs/reaction-times.md).
constexpr Duration voltage_budget = 450ms;
/// No delay is allowed for a plug: its contacts part under the current that still flows (row 100).
constexpr Duration plug_budget = 100ms;

template <std::uint8_t node>
TimePoint module_heard_at(const Core& core, TimePoint /*now*/) {
  return core.modules().find(node)->last_answer_at;
}
TimePoint charger_heard_at(const Core& core, TimePoint /*now*/) {
  return core.chargers().unit(0).values_at;
}
TimePoint obeyed_until(const Core& core, TimePoint now) {
  return core.charger_watch().runs_away() ? TimePoint{} : now;
}
TimePoint plugged_in_until(const Core& core, TimePoint now) {
  return core.sensors().pdu.value.charger_connected ? now : TimePoint{};
}
TimePoint inverter_heard_at(const Core& core, TimePoint /*now*/) {
  return core.inverter().heard_at();
}
TimePoint in_range_until(const Core& core, TimePoint now) {
  return core.modules().find(2)->values_out_of_range == 0 ? now : TimePoint{};
}
/// No cell voltage is stuck although it should have changed.
TimePoint moving_until(const Core& core, TimePoint now) {
  return core.watchers().stuck.longest_ms(core.modules()).value == 0 ? now : TimePoint{};
}
/// Its data is valid until it is older than age_max.
TimePoint second_pack_known_until(const Core& core, TimePoint now) {
  return core.second_pack().soc_permille(now) ? now - SecondPack::age_max : TimePoint{};
}

}  // namespace

const std::vector<Proof>& proofs() {
  static const std::vector<Proof> rows{
      // Two and a half periods of its report, and a tenth of a second (docs/charging.md).
      {.name = "charger_loss",
       .well_until = charger_heard_at,
       .allowed = 2'600ms + decision,
       .fault = FaultId::charger_silent},
      {.name = "charger_own_bus",
       .well_until = charger_heard_at,
       .allowed = 2'600ms + decision,
       .fault = FaultId::charger_silent},
      // Confirmed after 0.25 s and two samples.
      {.name = "charger_runaway",
       .well_until = obeyed_until,
       .allowed = 250ms + 2 * decision,
       .fault = FaultId::charger_runaway},
      {.name = "plug_pulled",
       .well_until = plugged_in_until,
       .allowed = plug_budget,
       .cause = OpeningCause::request_over},
      // 5 s of silence, and at most 5 s until no current flows (docs/inverters.md).
      {.name = "inverter_silent",
       .well_until = inverter_heard_at,
       .allowed = 10s + decision,
       .fault = FaultId::inverter_lost},
      // It is reported once a second.
      {.name = "second_pack_silent",
       .well_until = second_pack_known_until,
       .allowed = SecondPack::age_max + vehicle_bus::pack_charge.period + decision,
       .cause = OpeningCause::none,
       .end = ProofEnd::tells_no_second_soc},
      {.name = "foreign_module_missing",
       .well_until = module_heard_at<3>,
       .allowed = voltage_budget,
       .fault = FaultId::module_lost},
      {.name = "outlander_stale",
       .well_until = module_heard_at<5>,
       .allowed = voltage_budget,
       .fault = FaultId::module_lost},
      // The limit of stuck_values, its two samples, and the step until which no change was due.
      {.name = "outlander_repeats",
       .well_until = moving_until,
       .allowed = 8s + voltage_budget,
       .fault = FaultId::stuck_values},
      {.name = "outlander_out_of_range",
       .well_until = in_range_until,
       .allowed = voltage_budget,
       .fault = FaultId::cell_not_measured},
      // Three of its last ten frames, which is sooner than its receive timeout.
      {.name = "i3_checksums",
       .well_until = module_heard_at<4>,
       .allowed = voltage_budget,
       .fault = FaultId::module_disturbed},
      // Two answers that contradict earlier ones under the same counter.
      {.name = "i3_counter",
       .well_until = module_heard_at<4>,
       .allowed = voltage_budget,
       .fault = FaultId::duplicate_node},
  };
  return rows;
}

std::string proof_folder() {
  return test::in_source("vcan-fixtures/proof");
}

std::string pack_file_of(const std::string& script) {
  constexpr std::string_view mark = "# Pack: ";
  std::ifstream stream(script);
  for (std::string line; std::getline(stream, line);) {
    if (line.starts_with(mark)) return test::in_source(line.substr(mark.size()));
  }
  FAIL(script << ": found no line '# Pack: FILE'");
  return "";
}

void ProofWatch::decided(TimePoint at, const Decisions& decisions) {
  if (ended_at_) return;
  if (is_end(decisions)) {
    ended_at_ = at;
    is_open_ = !decisions.outputs.any_contactor();
    opening_ = core_->last_opening();
    return;
  }
  was_closed_ = was_closed_ || core_->sequence().phase == Phase::closed;
  well_until_ = std::max(well_until_, proof_->well_until(*core_, at));
}

bool ProofWatch::is_end(const Decisions& decisions) {
  if (proof_->end == ProofEnd::opens) return was_closed_ && !decisions.outputs.any_contactor();
  bool is_told = false;
  for (const OutgoingFrame& out : decisions.frames) {
    if (out.frame.id != vehicle_bus::pack_charge.base_id) continue;
    const bool is_known = read<vehicle_bus::pack_charge, "soc_2_permille">(out.frame).is_valid();
    is_told = is_told || (was_second_soc_known_ && !is_known);
    was_second_soc_known_ = was_second_soc_known_ || is_known;
  }
  return is_told;
}

void ProofWatch::check() const {
  CHECK(was_closed_);
  REQUIRE(ended_at_);
  CHECK(to_text(opening_.cause) == to_text(proof_->cause));
  if (proof_->cause == OpeningCause::fault) CHECK(row_of(opening_.fault).name == row_of(proof_->fault).name);
  CHECK(is_open_ == (proof_->end == ProofEnd::opens));
  REQUIRE(well_until_ > TimePoint{});
  INFO("it took " << to_s(*ended_at_ - well_until_) << " s, allowed " << to_s(proof_->allowed) << " s");
  CHECK(*ended_at_ - well_until_ <= proof_->allowed);
}

}  // namespace bmu::test
