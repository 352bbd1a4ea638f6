#include "daemon/shell/status/status_json.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "daemon/core/estimation/energy_left.hpp"
#include "daemon/shell/json/switches_json.hpp"
#include "daemon/shell/status/balance_json.hpp"
#include "daemon/shell/status/health_json.hpp"
#include "daemon/shell/status/measured_json.hpp"
#include "daemon/shell/status/modules_json.hpp"
#include "daemon/shell/status/why_json.hpp"
#include "daemon/shell/status/why_limits.hpp"
#include "devices/device_list.hpp"

namespace bmu {

namespace {

constexpr std::size_t rejected_ids_shown = 5;

// --- measurements ---------------------------------------------------------------------------------------------------

/// With its source; null without one.
void put_intake_air(JsonText& to, const StatusView& view) {
  const IntakeAirConfig& air = view.core.config().intake_air;
  if (air.source == AirSource::none) return to.put("intake_air", nullptr);
  const Temperature_dC temperature_dC = view.core.intake_air_dC(view.now);
  to.object("intake_air", [&] {
    to.put("source", air_source_names.at(static_cast<std::size_t>(air.source)));
    to.put("temperature_dC", if_known(temperature_dC.is_valid(), temperature_dC.value));
    to.put("temperature_age_ms", ago_ms(view, temperature_dC.taken_at));
  });
}

void put_values(JsonText& to, const StatusView& view) {
  const PackState& pack = view.core.pack();
  const SensorTable& sensors = view.core.sensors();
  const AgeConfig& ages = view.core.config().ages;
  const auto sum = [](const Measured<std::int32_t>& value) { return if_known(value.is_valid(), value.value); };
  to.object("values", [&] {
    put_measured(to, "pack_voltage", Unit::mV, sensors.pack_voltage_mV, view, ages.pack_voltage);
    put_measured(to, "link_voltage", Unit::mV, sensors.link_voltage_mV, view, ages.pack_voltage);
    put_measured(to, "current", Unit::mA, sensors.current_mA, view, ages.pack_current);
    to.put("cell_voltage_sum_mV", sum(pack.cell_voltage_sum_mV));
    to.put("module_voltage_sum_mV", sum(pack.module_voltage_sum_mV));
    put_spread(to, "cell_voltage", pack.cell_voltage_uV, Unit::uV, view);
    put_spread(to, "cell_temperature", pack.cell_temperature_dC, Unit::dC, view);
    put_spread(to, "board_temperature", pack.board_temperature_dC, Unit::dC, view);
    put_intake_air(to, view);
  });
}

std::int64_t in_uAs(double charge_As) {
  return std::llround(charge_As * 1e6);
}

std::optional<std::int64_t> in_ms(const std::optional<Duration>& span) {
  return span ? std::optional(to_ms(*span)) : std::nullopt;
}

/// State of energy, with the load that it applies to.
void put_energy_left(JsonText& to, const StatusView& view) {
  const EnergyLeft energy = energy_left(view.core.estimate(), view.core.config());
  to.put("energy_left_mWh", if_known(energy.is_known, in_mWh(energy.energy_Wh)));
  to.put("energy_left_sigma_mWh", if_known(energy.is_known, in_mWh(energy.sigma_Wh)));
  to.put("energy_left_load_mA", if_known(energy.is_known, std::llround(energy.load_A * 1e3)));
}

/// The values of the chosen method; those of each method for all cells are in `cells`.
void put_charge(JsonText& to, const StatusView& view) {
  const ChargeState& charge = view.core.charge();
  const PackEstimate& estimate = view.core.estimate();
  const bool is_known = estimate.pack().is_known;
  to.object("charge", [&] {
    to.put("is_known", is_known);
    to.put("soc_permille", if_known(is_known, estimate.told_permille()));
    to.put("soc_sigma_permille", if_known(is_known, in_permille(estimate.pack().sigma)));
    to.put("estimated_soc_permille", if_known(is_known, in_permille(estimate.pack().soc)));
    to.put("method", to_text(estimate.method()));
    to.put("origin", to_text(estimate.origin()));
    to.put("record_age_ms", in_ms(estimate.record_age()));
    to.put("anchored_ago_ms", ago_ms(view, estimate.anchored_at()));
    to.put("emptiest_cell", if_known(is_known, estimate.pack().emptiest + 1));
    to.put("fullest_cell", if_known(is_known, estimate.pack().fullest + 1));
    to.put("depth_of_discharge_uAs", if_known(is_known, estimate.depth_of_discharge_uAs()));
    to.put("usable_capacity_uAs", if_known(is_known, in_uAs(estimate.pack().capacity_As())));
    to.put("capacity_uAs", view.core.config().cell.capacity_uAs);
    put_energy_left(to, view);
    to.put("empty_in_ms", in_ms(estimate.empty_in()));
    to.put("full_in_ms", in_ms(estimate.full_in()));
    to.put("energy_out_mWh", charge.energy_out_mWh);
    to.put("energy_in_mWh", charge.energy_in_mWh);
    to.put("uncounted_ms", to_ms(charge.uncounted));
  });
}

// --- state ----------------------------------------------------------------------------------------------------------

std::string_view name_of(std::span<const RawName> names, std::int64_t raw) {
  const auto found = std::find_if(names.begin(), names.end(), [raw](const RawName& name) { return name.raw == raw; });
  return found == names.end() ? "?" : found->name;
}

/// Names of the set bits of the elithion state: "K1 on, K3 on".
std::string elithion_state_text(std::uint8_t state) {
  constexpr std::array<std::string_view, 5> names{"fault", "K1 on", "K2 on", "K3 on", "relay fault"};
  std::string text;
  for (std::size_t bit = 0; bit < names.size(); ++bit) {
    if ((state >> bit & 1U) == 0) continue;
    text.append(text.empty() ? "" : ", ").append(names.at(bit));
  }
  return text.empty() ? "no fault, contactors off" : text;
}

/// Text of the state in the dialect.
std::string vehicle_state_text(VehicleDialect dialect, std::uint8_t state) {
  switch (dialect) {
    case VehicleDialect::iha: break;
    case VehicleDialect::original: return std::string(name_of(vehicle_bus_original::state_names, state));
    case VehicleDialect::elithion: return elithion_state_text(state);
  }
  return std::string(name_of(vehicle_bus::state_names, state));
}

std::string_view mode_text(internal_bus::Mode mode) {
  return name_of(internal_bus::mode_names, static_cast<std::int64_t>(mode));
}

/// For display only: contacts and inputs, or those that the PDU reports while the lines of this machine cannot be read.
struct SwitchesSeen {
  Measured<PduState> pdu;
  bool is_heard = false;
  bool are_lines_missing = false;
};

SwitchesSeen switches_seen(const StatusView& view) {
  const SensorTable& sensors = view.core.sensors();
  const CoreConfig& config = view.core.config();
  const auto is_usable = [&](const Measured<PduState>& word) {
    return word.is_usable(view.now, config.ages.pdu_status);
  };
  SwitchesSeen seen{.pdu = sensors.pdu, .is_heard = is_usable(sensors.pdu)};
  const bool says_unit_alone = !seen.is_heard && config.contactors.has_pdu && is_usable(sensors.pdu_word);
  if (!says_unit_alone) return seen;
  seen = {.pdu = sensors.pdu_word, .is_heard = true, .are_lines_missing = true};
  if (config.insulation.is_heard_itself()) {
    seen.pdu.value.insulation_state = sensors.insulation.state;
    seen.pdu.value.insulation_resistance_Ohm = sensors.insulation.resistance_Ohm;
  }
  return seen;
}

void put_switches(JsonText& to, const StatusView& view) {
  const SwitchesSeen seen = switches_seen(view);
  const LinesConfig* const missing = seen.are_lines_missing ? &view.core.config().lines : nullptr;
  if (seen.is_heard) {
    put_feedback(to, seen.pdu.value, missing);
    put_inputs(to, seen.pdu.value, missing);
  } else {
    to.put("feedback", nullptr);
    to.put("inputs", nullptr);
  }
  to.put("feedback_age_ms", ago_ms(view, seen.pdu.taken_at));
}

void put_state(JsonText& to, const StatusView& view) {
  const Core& core = view.core;
  const VehicleDialect dialect = core.config().vehicle.dialect;
  to.object("state", [&] {
    to.put("phase", to_text(core.sequence().phase));
    to.put("phase_for_ms", to_ms(view.now - std::max(core.sequence().entered_at, core.started_at())));
    to.put("vehicle_state", vehicle_state_text(dialect, vehicle_state(dialect, core.mode_inputs(view.now))));
    to.put("mode", to_text(core.mode(view.now)));
    to.put("claim", to_text(core.claim().stage()));
    to.put("close_requested", core.is_close_requested());
    to.object("wish", [&] {
      to.put("by_vehicle", core.wish().by_vehicle);
      to.put("by_charger", core.wish().by_charger);
    });
    to.put("rest", to_text(core.rest().phase()));
    to.put("rest_for_ms", ago_ms(view, core.rest().since()));
    put_outputs(to, core.outputs());
    put_switches(to, view);
  });
}

void put_last_refusal(JsonText& to, const StatusView& view) {
  const RefusalRecord& refusal = view.core.last_refusal();
  if (!refusal.has_happened) return to.put("last_refusal", nullptr);
  to.object("last_refusal", [&] {
    to.put("refused_ago_ms", ago_ms(view, refusal.at));
    to.put("blocker", to_text(refusal.blocker));
    to.put("text", refusal_text(refusal.blocker, refusal.fault, refusal.reading, refusal.threshold));
  });
}

void put_permission(JsonText& to, const StatusView& view) {
  const Permission& permission = view.core.permission();
  const Duration locked_out = std::max(view.core.locked_out_until() - view.now, Duration{});
  to.object("permission", [&] {
    to.put("may_close", permission.may_close);
    to.put("may_stay_closed", permission.may_stay_closed);
    to.put("may_charge", permission.may_charge);
    to.put("may_discharge", permission.may_discharge);
    to.put("locked_out_for_ms", to_ms(locked_out));
    to.array("blockers", [&] {
      for (const Blocker blocker : permission.blockers) to.add(to_text(blocker));
    });
    put_last_refusal(to, view);
  });
}

void put_limits(JsonText& to, const Core& core) {
  const CurrentLimits& limits = core.limits();
  to.object("limits", [&] {
    to.put("discharge", limit_json(limits.discharge, core.config()));
    to.put("charge", limit_json(limits.charge, core.config()));
    to.put("discharge_continuous", limit_json(limits.discharge_continuous, core.config()));
    to.put("charge_continuous", limit_json(limits.charge_continuous, core.config()));
  });
}

/// Permissible powers, in addition to the currents.
void put_power_limits(JsonText& to, const Core& core) {
  const PowerLimits powers = core.power_limits();
  const auto put_one = [&to](std::string_view name, const PowerLimit& power) {
    to.object(name, [&] {
      to.put("limit_W", power.limit_W);
      to.put("cause", to_text(power.cause));
    });
  };
  to.object("power_limits", [&] {
    put_one("discharge", powers.discharge);
    put_one("charge", powers.charge);
    put_one("discharge_continuous", powers.discharge_continuous);
    put_one("charge_continuous", powers.charge_continuous);
  });
}

void put_overload(JsonText& to, const Core& core) {
  const OverloadCounter& overload = core.watchers().overload;
  to.object("overload", [&] {
    to.put("discharge_used_permille", overload.discharge_used_permille());
    to.put("charge_used_permille", overload.charge_used_permille());
  });
}

// --- contactors, lines, store ---------------------------------------------------------------------------------------

void put_precharge_guard(JsonText& to, const Core& core) {
  const PrechargeGuard& guard = core.precharge_guard();
  const ContactorConfig& config = core.config().contactors;
  const std::int64_t heat_max_mJ = std::int64_t{config.precharge_energy_J} * 1'000;
  to.object("precharge_guard", [&] {
    to.put("tries_failed", guard.tries_failed());
    to.put("tries_max", config.precharge_tries);
    to.put("is_cool", guard.is_cool());
    to.put("heat_mJ", guard.heat_mJ());
    to.put("heat_max_mJ", if_known(heat_max_mJ > 0, heat_max_mJ));
  });
}

void put_wear(JsonText& to, const Core& core) {
  to.object("contactors", [&] {
    for (std::size_t i = 0; i < contactor_id_count; ++i) {
      const ContactorWear& wear = core.persistent().contactors[i];
      to.object(gpio_output_names[i], [&] {
        to.put("closings", wear.closings);
        to.put("openings", wear.openings);
        to.put("openings_under_load", wear.openings_under_load);
        to.put("current_broken_max_mA", wear.current_broken_max_mA);
        to.put("current_broken_sum_mA", wear.current_broken_sum_mA);
      });
    }
  });
}

/// Bits by the names of their inputs.
void put_bits(JsonText& to, std::string_view name, unsigned bits, const std::vector<std::string_view>& names) {
  to.object(name, [&] {
    for (std::size_t i = 0; i < names.size(); ++i) to.put(names[i], ((bits >> i) & 1U) != 0);
  });
}

/// Levels of the last read; null if it failed.
void put_levels(JsonText& to, const StatusView& view) {
  const GpioLines& lines = view.lines->lines();
  const LineImage& image = view.lines->last();
  const LinesConfig& used = view.core.config().lines;
  if (image.is_failed) return to.put("levels", nullptr);
  to.object("levels", [&] {
    to.object("closed_contacts", [&] {
      for (std::size_t i = 0; i < contactor_id_count; ++i) {
        if (((used.feedback >> i) & 1U) == 0) continue;
        to.put(gpio_output_names[i], ((image.closed_contacts >> i) & 1U) != 0);
      }
    });
    put_bits(to, "estops_pressed", image.estops_pressed, lines.names_of(GpioInputKind::estop));
    put_bits(to, "interlocks_open", image.interlocks_open, lines.names_of(GpioInputKind::interlock));
    to.put("vehicle_on", if_known(used.has_vehicle_on, image.vehicle_on));
    to.put("charger_connected", if_known(used.has_charger_connected, image.charger_connected));
    to.put("resume_button", if_known(used.has_resume_button, image.resume_button));
    to.put("insulation_ok", if_known(used.has_insulation_ok, image.insulation_ok));
    to.put("supply_ok", if_known(used.has_supply_ok, image.supply_ok));
  });
}

/// The GPIO lines of this machine; null if the pack file has none.
void put_lines(JsonText& to, const StatusView& view) {
  if (view.lines == nullptr) return to.put("lines", nullptr);
  const GpioLines& lines = view.lines->lines();
  to.object("lines", [&] {
    to.put("chip", lines.chip());
    to.put("state", to_text(lines.state()));
    to.put("last_error", if_known(lines.state() == GpioState::failed, lines.last_error()));
    put_levels(to, view);
  });
}

/// The state file; null if there is none.
void put_store(JsonText& to, const StatusView& view) {
  const StateStore& store = view.store;
  if (store.path().empty()) return to.put("store", nullptr);
  const OwnHealth health = store.health();
  const std::string error = store.last_error();
  to.object("store", [&] {
    to.put("path", store.path());
    to.put("found_at_start", to_text(store.found().found));
    to.put("unknown_names", store.found().unknown_names);
    to.put("writes", store.writes());
    to.put("write_failed", health.store_write_failed);
    to.put("last_error", if_known(!error.empty(), error));
    to.put("disk_low", health.disk_low);
  });
}

/// The recorder and its files; null if nothing is recorded.
void put_recorder(JsonText& to, const StatusView& view) {
  if (view.recorder == nullptr) return to.put("recorder", nullptr);
  const RecorderStatus status = view.recorder->status();
  to.object("recorder", [&] {
    to.put("record_path", if_known(!status.record_path.empty(), status.record_path));
    to.put("recorded_bytes", status.recorded_bytes);
    to.put("record_error", if_known(!status.record_error.empty(), status.record_error));
    to.put("pieces_lost", view.recorder->pieces_lost());
    to.put("seconds_lost", status.frames_lost);
    to.put("black_boxes", status.black_boxes);
    to.put("black_boxes_lost", status.black_boxes_lost);
    to.put("black_box_path", if_known(!status.black_box_path.empty(), status.black_box_path));
    to.put("black_box_error", if_known(!status.black_box_error.empty(), status.black_box_error));
    to.put("memory_bytes", status.memory_bytes);
    to.put("memory_ms", to_ms(status.memory_length));
  });
}

/// The database of the history; null if there is none.
void put_history(JsonText& to, const StatusView& view) {
  if (view.history.path().empty()) return to.put("history", nullptr);
  const HistoryHealth health = view.history.health();
  to.object("history", [&] {
    to.put("path", view.history.path());
    to.put("state", to_text(health.state));
    to.put("rows_written", health.rows_written);
    to.put("rows_lost", health.rows_lost);
    to.put("rows_waiting", health.rows_waiting);
    to.put("events_written", health.events_written);
    to.put("events_lost", health.events_lost);
    to.put("size_bytes", health.size_bytes);
    to.put("last_error", if_known(!health.last_error.empty(), health.last_error));
    to.put("put_aside", if_known(!health.put_aside.empty(), health.put_aside));
  });
}

// --- faults ---------------------------------------------------------------------------------------------------------

void put_fault_names(JsonText& to, std::string_view name, const Core& core, bool (*is_wanted)(const FaultState&)) {
  to.array(name, [&] {
    for (const FaultRow& row : fault_table()) {
      if (is_wanted(core.faults().state(row.id))) to.add(row.name);
    }
  });
}

// --- buses ----------------------------------------------------------------------------------------------------------

/// Null for a bus that is not an interface. A value that its driver does not report is null, too.
void put_controller(JsonText& to, const std::string& bus_name, const StatusView& view) {
  const auto report = view.links == nullptr ? std::nullopt : view.links->report(bus_name);
  if (!report) return to.put("controller", nullptr);
  const LinkDetails& details = report->details;
  const ErrorCounters errors = details.errors.value_or(ErrorCounters{});
  const ControllerHistory history = details.history.value_or(ControllerHistory{});
  const bool has_history = details.history.has_value();
  to.object("controller", [&] {
    to.put("state", to_text(details.state));
    to.put("send_errors", if_known(details.errors.has_value(), errors.sending));
    to.put("receive_errors", if_known(details.errors.has_value(), errors.receiving));
    to.put("restart_ms", if_known(details.is_can, details.restart_ms));
    to.put("restarts", if_known(has_history, history.restarts));
    to.put("times_bus_off", if_known(has_history, history.times_bus_off));
    to.put("times_passive", if_known(has_history, history.times_passive));
    to.put("bus_errors", if_known(has_history, history.bus_errors));
    to.put("set_up", to_text(report->set_up));
  });
}

void put_port(JsonText& to, Port port, const StatusView& view) {
  const BusPort& bus = view.buses.serving(port);
  const PortStatus& counts = view.core.port(port);
  const bool is_judged = &bus == &view.buses.internal();  // view.rate is that of the internal bus alone
  const std::uint32_t rate_bit_per_s = bus.rate_bit_per_s();
  const Port counted = view.buses.served_by[static_cast<std::size_t>(port)];
  to.put("port", to_text(port));
  to.put("bus", bus.name());
  to.put("state", to_text(bus.state()));
  to.put("is_shared", view.buses.is_shared(port));
  to.put("rate_bit_per_s", if_known(rate_bit_per_s > 0, rate_bit_per_s));
  to.put("rate_wanted_bit_per_s", if_known(is_judged && rate_bit_per_s > 0, view.rate.wanted_bit_per_s));
  to.put("rate_planned_bit_per_s", if_known(is_judged, view.rate.wanted_bit_per_s));
  to.put("rate_verdict", to_text(is_judged ? view.rate.verdict : RateVerdict::unknown));
  to.put("bits_seen", view.loop.bits_seen[static_cast<std::size_t>(counted)]);
  to.put("frames_sent", counts.frames_sent);
  to.put("frames_echoed", counts.frames_echoed);
  to.put("sends_failed", counts.sends_failed);
  to.put("frames_lost", counts.frames_lost);
  to.put("error_frames", counts.error_frames);
  to.put("times_down", counts.times_down);
  put_controller(to, bus.name(), view);
  to.put("last_error", bus.last_error());
}

/// Includes the identifiers of the vehicle reports: where both buses are one, another node may send them there.
MessageMatch find_message(std::uint32_t id, const Core& core) {
  const CoreConfig& config = core.config();
  const MessageMatch foreign = are_modules_ours(config) ? MessageMatch{} : config.foreign.driver->catalogue->find(id);
  if (foreign.message != nullptr) return foreign;
  const MessageMatch match = core.receive_check().catalogue().find(id);
  if (match.message != nullptr) return match;
  const SensorSetUpDriver* const set_up = config.sensor.set_up;
  const MessageMatch of_sensor = set_up != nullptr ? find_device(set_up->name)->catalogue->find(id) : MessageMatch{};
  if (of_sensor.message != nullptr) return of_sensor;
  return row_of(config.vehicle.dialect).catalogue->find(id - config.vehicle.base_id + vehicle_bus::default_base_id);
}

void put_most_rejected(JsonText& to, const Core& core) {
  struct Rejected {
    std::uint32_t id;
    std::uint32_t count;
  };
  std::vector<Rejected> rejected;
  for (std::uint32_t id = 0; id < Catalogue::id_count; ++id) {
    const std::uint32_t count = core.receive_check().rejected_under(id) + core.foreign_check().rejected_under(id);
    if (count > 0) rejected.push_back({id, count});
  }
  std::sort(rejected.begin(), rejected.end(), [](const Rejected& a, const Rejected& b) { return a.count > b.count; });
  if (rejected.size() > rejected_ids_shown) rejected.resize(rejected_ids_shown);
  to.array("most_rejected", [&] {
    for (const Rejected& one : rejected) {
      const MessageMatch match = find_message(one.id, core);
      to.object([&] {
        to.put("id", id_text(one.id));
        to.put("message", match.message != nullptr ? std::optional(match.message->name) : std::nullopt);
        to.put("node", match.node);
        to.put("count", one.count);
      });
    }
  });
}

/// The count of each reason.
template <class Reason, std::size_t Size>
void put_by_reason(JsonText& to, std::string_view name, const std::array<std::uint64_t, Size>& counts) {
  to.object(name, [&] {
    for (std::size_t reason = 0; reason < Size; ++reason) to.put(to_text(static_cast<Reason>(reason)), counts[reason]);
  });
}

void put_receive(JsonText& to, const Core& core) {
  const ReceiveCounts counts = core.receive_counts();
  const RefusedResults& refused = core.sensors().refused;  // valid frames without a usable result
  to.object("receive", [&] {
    to.put("accepted", counts.accepted);
    to.put("rejected", counts.rejected_total());
    put_by_reason<RejectReason>(to, "rejected_by_reason", counts.rejected);
    put_most_rejected(to, core);
    to.put("sensor_results_refused", refused.count());
    put_by_reason<ResultRefusal>(to, "sensor_results_refused_by_reason", refused.by_reason);
    to.put("sensor_result_refused_last", if_known(refused.count() > 0, to_text(refused.last)));
  });
}

void put_module_summary(JsonText& to, std::size_t index, const StatusView& view) {
  const ModuleRecord& module = view.core.modules().modules()[index];
  const AgeConfig& ages = view.core.config().ages;
  const bool has_status = module.status.is_usable(view.now, ages.module_status);
  to.put("node", module.config.node);
  to.put("is_answering", is_answering(module, ages, view.now));
  to.put("mode", if_known(has_status, mode_text(module.status.value.mode)));
  to.put("serial_number", if_known(module.identity.is_valid(), module.identity.value.serial_number));
  to.put("limits_set", if_known(has_status, !module.status.value.limits_not_set));
  to.put("limits_refused", view.core.module_setup().is_refused(index));
  to.put("place", are_modules_ours(view.core.config()) ? to_text(view.core.finding(module).place) : "not told");
  to.put("answer_latency_ms", to_ms(module.answer_times.last()));
  to.put("answers_complete", module.answers_complete);
  to.put("answers_missed", module.answers_missed);
  to.put("last_answer_age_ms", ago_ms(view, module.last_answer_at));
}

// --- the last closing and opening ---

void put_last_precharge(JsonText& to, const StatusView& view) {
  const PrechargeRecord& record = view.core.last_precharge();
  if (!record.has_run) return to.put("last_precharge", nullptr);
  to.object("last_precharge", [&] {
    to.put("was_successful", record.was_successful);
    to.put("ended_ago_ms", ago_ms(view, record.ended_at));
    to.put("took_ms", to_ms(record.took));
    to.put("pack_voltage_mV", record.pack_mV);
    to.put("link_voltage_mV", record.link_mV);
    to.put("current_mA", record.current_mA);
  });
}

void put_drive(JsonText& to, const StatusView& view) {
  const DriveRecord& drive = view.drive;
  if (!drive.has_run) return to.put("drive", nullptr);
  to.object("drive", [&] {
    to.put("is_running", drive.is_running);
    to.put("closed_ago_ms", ago_ms(view, drive.closed_at));
    to.put("lasted_ms", to_ms(drive.lasted));
    to.put("charge_used_uAs", drive.charge_used_uAs);
    to.put("energy_out_mWh", drive.energy_out_mWh);
    to.put("energy_in_mWh", drive.energy_in_mWh);
  });
}

void put_daemon(JsonText& to, const StatusView& view) {
  to.object("daemon", [&] {
    to.put("version", BMUD_VERSION);
    to.put("uptime_ms", ago_ms(view, view.core.started_at()));
    to.put("reloads", view.reloads);
    to.put("ticks", view.core.ticks());
    to.put("ticks_late", view.loop.ticks_late);
    to.put("tick_latest_us", std::chrono::duration_cast<std::chrono::microseconds>(view.loop.latest).count());
    to.put("gate_refusals", view.core.gate_refusals());
    to.put("log_lines_lost", view.log_lines_lost);
    to.put("notify_sends_failed", view.notify_sends_failed);
    to.put("clients_dropped", view.clients_dropped);
  });
}

void put_pack(JsonText& to, const StatusView& view) {
  const CoreConfig& config = view.core.config();
  std::array<char, 20> hash{};
  std::snprintf(hash.data(), hash.size(), "%016llx", static_cast<unsigned long long>(config.hash));
  to.object("pack", [&] {
    to.put("name", view.pack_name);
    to.put("cell_name", view.cell_name);
    to.put("config_hash", hash.data());
    to.put("module_count", config.modules.size());
    to.put("cell_count", cell_count(config));
  });
}

// --- devices of other makers ----------------------------------------------------------------------------------------

void put_charger_unit(JsonText& to, std::size_t index, const StatusView& view) {
  const ChargerTable& table = view.core.chargers();
  const ChargerUnit& unit = table.unit(index);
  const bool talks = table.is_talking(index, view.now);
  const auto value = [talks](const SignalValue& one) { return if_known(talks && one.is_valid(), one.value); };
  to.put("unit", index + 1);
  to.put("is_talking", talks);
  to.put("heard_ago_ms", ago_ms(view, unit.values_at));
  to.put("voltage_mV", value(unit.report.voltage_mV));
  to.put("current_mA", value(unit.report.current_mA));
  to.put("mains_voltage_mV", value(unit.report.mains_voltage_mV));
  to.put("mains_current_mA", value(unit.report.mains_current_mA));
  to.put("temperature_dC", value(view.core.chargers().temperature_dC(index, view.now)));
  to.array("troubles", [&] {
    for (std::size_t number = 0; talks && number < charger_trouble_count; ++number) {
      const auto trouble = static_cast<ChargerTrouble>(number);
      if ((unit.report.troubles & bit_of(trouble)) != 0) to.add(to_text(trouble));
    }
  });
  to.put("frames_refused", unit.frames_refused);
  to.put("values_out_of_range", unit.values_out_of_range);
  to.put("values_unknown", unit.values_unknown);
}

/// Null if no charger is controlled.
void put_charger(JsonText& to, const StatusView& view) {
  const ChargerTable& table = view.core.chargers();
  if (!table.is_there()) return to.put("charger", nullptr);
  const ChargeControl& charge = view.core.charge_control();
  to.object("charger", [&] {
    to.put("protocol", table.driver().name);
    to.put("stage", to_text(charge.stage()));
    to.put("stage_for_ms", ago_ms(view, charge.since()));
    to.put("is_held", charge.is_held());
    to.put("goes_on_when_heard", view.core.is_resume_pending());
    to.put("asked_mA", charge.current_mA());
    to.put("asked_mV", charge.voltage_mV());
    to.put("cell_full_uV", charge.cell_full_uV());
    to.array("units", [&] {
      for (std::size_t index = 0; index < table.unit_count(); ++index) {
        to.object([&] { put_charger_unit(to, index, view); });
      }
    });
  });
}

/// Null without an inverter. The limits and values reported to it are the present ones; one that is not sent is null.
void put_inverter(JsonText& to, const StatusView& view) {
  const InverterWatch& watch = view.core.inverter();
  if (!watch.is_there()) return to.put("inverter", nullptr);
  const BatteryReport told = view.core.inverter_report();
  const InverterReport& said = watch.report();
  const bool talks = watch.is_talking(view.now);
  const auto value = [](const SignalValue& one) { return if_known(one.is_valid(), one.value); };
  const auto heard = [talks](const SignalValue& one) { return if_known(talks && one.is_valid(), one.value); };
  to.object("inverter", [&] {
    to.put("protocol", watch.config().driver->name);
    to.put("is_talking", talks);
    to.put("is_silent", view.core.is_inverter_silent());
    to.put("heard_ago_ms", ago_ms(view, watch.heard_at()));
    to.put("has_failed", talks && said.has_failed);
    to.put("has_warning", talks && said.has_warning);
    to.put("error_number", if_known(talks, said.error_number));
    to.put("voltage_mV", heard(said.voltage_mV));
    to.put("current_mA", heard(said.current_mA));
    to.put("temperature_dC", heard(said.temperature_dC));
    to.object("told", [&] {
      to.put("charge_limit_mA", told.charge_limit_mA);
      to.put("discharge_limit_mA", told.discharge_limit_mA);
      to.put("charge_voltage_limit_mV", told.charge_voltage_limit_mV);
      to.put("discharge_voltage_limit_mV", told.discharge_voltage_limit_mV);
      to.put("asks_for_charge", told.asks_for_charge);
      to.put("asks_for_full_charge", told.asks_for_full_charge);
      to.put("soc_permille", value(told.soc_permille));
      to.put("soh_permille", value(told.soh_permille));
    });
    to.put("frames_taken", watch.frames_taken());
    to.put("frames_refused", watch.frames_refused());
    to.put("values_out_of_range", said.values_out_of_range);
  });
}

void put_current_sensor(JsonText& to, std::string_view name, const Measured<std::int32_t>& current,
                        const CurrentSensorDriver* driver, const StatusView& view) {
  const Duration age_max = view.core.config().ages.pack_current;
  to.object(name, [&] {
    to.put("protocol", driver != nullptr ? std::optional(driver->name) : std::nullopt);
    to.put("current_mA", if_known(current.is_usable(view.now, age_max), current.value));
    to.put("heard_ago_ms", ago_ms(view, current.taken_at));
  });
}

/// Setup of a sensor that is queried for its settings; null if there is none.
void put_sensor_setup(JsonText& to, std::string_view name, const SensorSetup& setup, bool is_configured,
                      const StatusView& view) {
  if (!setup.is_there()) return to.put(name, nullptr);
  to.object(name, [&] {
    to.put("protocol", view.core.config().sensor.set_up->name);
    to.put("wanted", is_configured ? "configure" : "verify");
    to.put("stage", to_text(setup.stage()));
    to.put("results_count", setup.are_results_good(view.now));
    to.put("problem", if_known(setup.has_failed(), to_text(setup.problem())));
    to.put("restarts", setup.restarts());
    to.put("answers_refused", setup.answers_refused());
  });
}

/// The sensors that measure the currents.
void put_sensor(JsonText& to, const StatusView& view) {
  const SensorConfig& config = view.core.config().sensor;
  const SensorTable& sensors = view.core.sensors();
  to.object("sensor", [&] {
    put_current_sensor(to, "first", sensors.current_mA, config.first, view);
    if (config.has_second_current) {
      put_current_sensor(to, "second", sensors.current_2_mA, config.second, view);
    } else {
      to.put("second", nullptr);
    }
    const RefusedResults& refused = sensors.refused;
    to.put("results_refused", refused.count());
    put_by_reason<ResultRefusal>(to, "results_refused_by_reason", refused.by_reason);
    to.put("last_refused_because", if_known(refused.count() > 0, to_text(refused.last)));
    put_by_reason<RejectReason>(to, "frames_rejected_by_reason", refused.frames);
    put_sensor_setup(to, "set_up", view.core.sensor_setup(), config.is_configured, view);
    put_sensor_setup(to, "second_set_up", view.core.second_sensor_setup(), false, view);
  });
}

/// Null if no monitor is received directly.
void put_insulation(JsonText& to, const StatusView& view) {
  const InsulationTable& table = view.core.insulation();
  if (!table.is_there()) return to.put("insulation", nullptr);
  const InsulationWord word = table.word(view.now);
  const MonitorReport& report = table.report();
  const bool has_pulses = view.core.config().insulation.has_pulse_line;
  const ir155::Pwm pulses = table.pulses(view.now);
  const TimePoint pulsed_at = pulses.frequency_mHz > 0 ? view.now - pulses.since_edge : TimePoint{};
  to.object("insulation", [&] {
    to.put("protocol", table.protocol());
    to.put("is_talking", table.is_talking(view.now));
    to.put("heard_ago_ms", ago_ms(view, has_pulses ? pulsed_at : table.heard_at()));
    to.put("frequency_mHz", if_known(has_pulses, pulses.frequency_mHz));
    to.put("duty_permille", if_known(has_pulses, pulses.duty_permille));
    to.put("state", to_text(word.state));
    to.put("resistance_Ohm", if_known(word.resistance_Ohm.is_valid(), word.resistance_Ohm.value));
    to.put("is_low", !word.is_ok);
    to.put("is_warning", report.is_warning);
    to.put("is_testing", report.is_testing);
    to.put("is_test_pending", report.is_test_pending);
    to.put("frames_refused", table.frames_refused());
    if (has_pulses) {
      put_by_reason<ir155::Misfit>(to, "pulses_refused_by_reason", view.core.sensors().refused_pulses.by_reason);
    } else {
      to.put("pulses_refused_by_reason", nullptr);
    }
  });
}

/// Null if no second pack is expected; a stale value is null.
void put_second_pack(JsonText& to, const StatusView& view) {
  const SecondPack& pack = view.core.second_pack();
  if (!pack.is_expected()) return to.put("second_pack", nullptr);
  const SecondPack::Values& values = pack.values();
  const auto fresh = [&](const Measured<std::int32_t>& one) {
    return if_known(one.is_usable(view.now, SecondPack::age_max), one.value);
  };
  const bool has_name = values.name[0] != '\0';
  const bool has_state = values.state.is_usable(view.now, SecondPack::age_max);
  const auto state = static_cast<std::uint8_t>(values.state.value);
  to.object("second_pack", [&] {
    to.put("dialect", row_of(pack.dialect()).name);
    to.put("name", if_known(has_name, std::string(values.name.begin(), values.name.end())));
    to.put("is_silent", pack.is_silent(view.now));
    to.put("heard_ago_ms", ago_ms(view, pack.heard_at()));
    to.put("state", if_known(has_state, vehicle_state_text(pack.dialect(), state)));
    to.put("soc_permille", fresh(values.soc_permille));
    to.put("soh_permille", fresh(values.soh_permille));
    to.put("pack_voltage_mV", fresh(values.pack_voltage_mV));
    to.put("current_mA", fresh(values.current_mA));
    to.put("charge_limit_mA", fresh(values.charge_limit_mA));
    to.put("discharge_limit_mA", fresh(values.discharge_limit_mA));
    to.put("cell_voltage_min_uV", fresh(values.cell_voltage_min_uV));
    to.put("cell_voltage_max_uV", fresh(values.cell_voltage_max_uV));
    to.put("cell_temperature_min_dC", fresh(values.cell_temperature_min_dC));
    to.put("cell_temperature_max_dC", fresh(values.cell_temperature_max_dC));
    to.put("frames_taken", pack.frames_taken());
    to.put("frames_refused", pack.frames_refused());
    to.put("values_out_of_range", pack.values_out_of_range());
  });
}

/// Null if requests for data are not answered.
void put_requests(JsonText& to, const Core& core) {
  if (core.config().vehicle.request_id == 0) return to.put("requests", nullptr);
  const CellRequests::Counts& counts = core.cell_requests();
  to.object("requests", [&] {
    to.put("answered", counts.answered);
    to.put("unanswered", counts.unanswered);
    to.put("refused", counts.refused);
    to.put("dropped", counts.dropped);
  });
}

}  // namespace

void put_status(JsonText& to, const StatusView& view) {
  const Core& core = view.core;
  put_pack(to, view);
  put_daemon(to, view);
  put_state(to, view);
  put_values(to, view);
  put_charge(to, view);
  to.put("health", pack_health_json(view));
  put_limits(to, core);
  put_power_limits(to, core);
  put_permission(to, view);
  to.put("balancing", balancing_state_json(view));
  put_overload(to, core);
  put_precharge_guard(to, core);
  put_wear(to, core);
  put_lines(to, view);
  put_store(to, view);
  put_recorder(to, view);
  put_history(to, view);
  put_fault_names(to, "faults_present", core, [](const FaultState& state) { return state.is_present(); });
  put_fault_names(to, "warnings", core, [](const FaultState& state) { return state.is_warning; });
  to.put("modules_answering", core.pack().modules_answering);
  to.put("modules_expected", core.pack().modules_expected);
  to.put("complete_cycles", core.modules().complete_cycles());
  to.put("poll", poll_json(view));
  to.put("assignment", assignment_json(view));
  to.array("modules", [&] {
    for (std::size_t index = 0; index < core.modules().modules().size(); ++index) {
      to.object([&] { put_module_summary(to, index, view); });
    }
  });
  to.array("ports", [&] {
    for (const Port port : all_ports) {
      if (view.buses.is_there(port)) to.object([&] { put_port(to, port, view); });
    }
  });
  put_charger(to, view);
  put_inverter(to, view);
  put_sensor(to, view);
  put_insulation(to, view);
  put_second_pack(to, view);
  put_requests(to, core);
  put_receive(to, core);
  put_last_precharge(to, view);
  put_drive(to, view);
  to.put("last_opening", opening_json(view));
}

}  // namespace bmu
