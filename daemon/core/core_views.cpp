// Queries between the stages of the core, and its views for fault evaluation and reports.
#include <algorithm>
#include <cstdlib>
#include <optional>

#include "daemon/core/core.hpp"

namespace bmu {

namespace {

/// They differ by at least two amperes, and their sum is at most a tenth of the difference.
bool are_mirrored(const std::optional<std::int32_t>& one_mA, const std::optional<std::int32_t>& other_mA) {
  constexpr std::int64_t apart_min_mA = 2'000;
  if (!one_mA || !other_mA) return false;
  const std::int64_t apart_mA = std::llabs(std::int64_t{*one_mA} - *other_mA);
  return apart_mA >= apart_min_mA && 10 * std::llabs(std::int64_t{*one_mA} + *other_mA) <= apart_mA;
}

}  // namespace

std::optional<std::int32_t> Core::soc_permille() const {
  if (!estimate_.pack().is_known) return std::nullopt;
  return estimate_.told_permille();
}

Temperature_dC Core::intake_air_dC(TimePoint now) const {
  const IntakeAirConfig& air = config_.intake_air;
  Temperature_dC found = sensors_.intake_air_dC;
  Duration age_max = air.age_max;
  if (air.source == AirSource::none) return {};
  if (air.source == AirSource::module) {
    const ModuleRecord* const module = modules_.find(air.node);
    if (module == nullptr) return {};
    found = module->board_temperature_dC[air.sensor - 1U];
    age_max = config_.ages.temperature;
  }
  if (!found.is_usable(now, age_max)) found.validity = found.is_valid() ? Validity::unknown : found.validity;
  return found;
}

PowerLimits Core::power_limits() const {
  return bmu::power_limits(limits_, pack_, load_resistance(estimate_));
}

FaultInputs Core::fault_inputs(TimePoint now) const {
  return {.now = now,
          .config = &config_,
          .pack = &pack_,
          .modules = &modules_,
          .sensors = &sensors_,
          .watchers = &watchers_,
          .soc_disagreement_permille = estimate_.disagreement_permille(),
          .cell_misfit_permille = estimate_.misfit_permille(),
          .flags = flags_,
          .second_pack = &second_pack_,
          .chargers = &chargers_,
          .charger_watch = &charger_watch_,
          .inverter = &inverter_,
          .has_started = has_started(now)};
}

VehicleView Core::vehicle_view(TimePoint now) const {
  const PduState& pdu = sensors_.pdu.value;
  const bool is_interlock_known = pdu_fresh(now);
  return {.mode = mode_inputs(now),
          .uptime = now - started_at_,
          .codes = trouble_codes(faults_),
          .faults = elithion_faults(faults_),
          .interlock_tripped = !is_interlock_known || !pdu.interlock_closed || pdu.interlocks_open != 0,
          .close_requested = request_.is_present(),
          .pack = &pack_,
          .limits = &limits_,
          .intake_air_dC = intake_air_dC(now),
          .soc_permille = soc_permille(),
          .soc_2_permille = second_pack_.soc_permille(now),
          .depth_of_discharge_uAs =
              estimate_.pack().is_known ? std::optional(estimate_.depth_of_discharge_uAs()) : std::nullopt,
          .capacity_uAs = config_.cell.capacity_uAs,
          .totals = totals(),
          .starts = starts(),
          .estimate = &estimate_};
}

InverterView Core::inverter_view(TimePoint now) const {
  const bool is_closed = sequence_.phase == Phase::closed && permission_.may_stay_closed && !shutting_down_;
  const InverterConfig& inverter = config_.inverter;
  const bool is_held_back =
      inverter.when_silent != SilentInverter::warn && inverter.silence_max > Duration{} && !inverter_.is_talking(now);
  return {.now = now,
          .may_charge = is_closed && permission_.may_charge,
          .may_discharge = is_closed && permission_.may_discharge,
          .is_held_back = is_held_back,
          .pack = &pack_,
          .limits = &limits_,
          .faults = &faults_,
          .stricter = &config_.stricter_reactions,
          .wish = wish(),
          .is_closed = sequence_.phase == Phase::closed,
          .is_plugged_in = pdu_fresh(now) && sensors_.pdu.value.charger_connected,
          .soc_permille = soc_permille(),
          .estimate = &estimate_,
          .capacity_uAs = config_.cell.capacity_uAs,
          .module_count = static_cast<std::uint8_t>(config_.modules.size())};
}

LikelyCause Core::likely_cause(FaultId fault, TimePoint now) const {
  constexpr Duration refused_within = 1s;
  constexpr Duration mirrored_within = 1s;
  const FreezeFrame frame = persistent_.faults[static_cast<std::size_t>(fault)].frame.value_or(FreezeFrame{});
  const TimePoint mirrored_at = charger_watch_.mirrored_at();
  const RefusedResults& refused = sensors_.refused;
  const bool is_refused_now = refused.last_at != TimePoint{} && now - refused.last_at <= refused_within;
  return bmu::likely_cause(
      fault,
      {.is_without_charger = frame.inputs && !frame.inputs->charger_connected,
       .do_cells_move_against_current = watchers_.steps.latest_contradiction() == Contradiction::against,
       .do_cells_oppose_steps = watchers_.steps.latest_answer() == StepAnswer::against,
       .do_cells_follow_steps = watchers_.steps.latest_answer() == StepAnswer::with,
       .is_charger_mirrored =
           mirrored_at != TimePoint{} && mirrored_at >= faults_.state(fault).confirmed_at - mirrored_within,
       .are_sensors_mirrored = are_mirrored(frame.current_mA, frame.current_2_mA),
       .are_results_out_of_range = is_refused_now && refused.last == ResultRefusal::out_of_range,
       .are_buses_swapped = are_buses_swapped(now),
       .link_time_constant = frame.link_time_constant_ms
                                 ? std::optional<Duration>(std::chrono::milliseconds{*frame.link_time_constant_ms})
                                 : watchers_.link.time_constant(),
       .link_followed_after = watchers_.rise.followed_after(),
       .slow_rise = watchers_.rise.slow_rise()},
      config_.contactors);
}

ModeInputs Core::mode_inputs(TimePoint now) const {
  const auto any = [this](auto holds) {
    return std::any_of(fault_table().begin(), fault_table().end(),
                       [&](const FaultRow& row) { return holds(row, faults_.state(row.id)); });
  };
  const PduState pdu = pdu_fresh(now) ? sensors_.pdu.value : PduState{};  // an unknown input is off
  return {.phase = sequence_.phase,
          .rest = rest_.phase(),
          .has_fault = any([this](const FaultRow& row, const FaultState& state) {
            return state.is_present() &&
                   reaction_of(row, config_.stricter_reactions).reaction >= Reaction::open_after_grace;
          }),
          .fault_opens = any([this](const FaultRow& row, const FaultState& state) {
            return opens_for(row, state, wish(), config_.stricter_reactions);
          }),
          .may_discharge = permission_.may_discharge,
          .vehicle_on = pdu.vehicle_on,
          .charger_connected = pdu.charger_connected,
          .current_mA = pack_.current_mA.is_valid() ? pack_.current_mA.value : 0,
          .outputs = outputs_,
          .has_relay_fault = has_relay_fault(faults_)};
}

/// The DC link is at pack voltage before the precharge contactor is commanded, which must not occur. The two samples
/// need not be of one instant: this only inhibits, and if one of them has changed it delays a closing by a period of
/// the sensor.
bool Core::link_follows_though_open() const {
  const bool is_open = sequence_.phase == Phase::open || sequence_.phase == Phase::main_negative;
  return is_open && pack_.is_sensed() &&
         link_follows(pack_.pack_voltage_mV.value, pack_.link_voltage_mV.value, config_.contactors);
}

bool Core::pdu_fresh(TimePoint now) const {
  return sensors_.pdu.is_usable(now, config_.ages.pdu_status);
}

bool Core::inputs_healthy(TimePoint now) const {
  return pdu_fresh(now) && sensors_.pdu.value.is_healthy();
}

bool Core::insulation_known(TimePoint now) const {
  const bool is_asked_for = config_.insulation.monitoring == InsulationMonitoring::measured;
  return !is_asked_for || (pdu_fresh(now) && knows_insulation(sensors_.pdu.value));
}

bool Core::has_started(TimePoint now) const {
  if (rest_.is_resting()) return false;  // no module is polled, none answers
  return seen_complete_ || (flags_.internal_bus_up && now - view_began_at_ >= start_grace);
}

/// The key is on or a charger is connected, whether or not its request was refused.
bool Core::could_ask(TimePoint now) const {
  const PduState& pdu = sensors_.pdu.value;
  return pdu_fresh(now) && (pdu.vehicle_on || pdu.charger_connected);
}

}  // namespace bmu
