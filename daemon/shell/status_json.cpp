#include "daemon/shell/status_json.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <span>
#include <utility>
#include <vector>

#include "daemon/shell/balance_json.hpp"
#include "daemon/shell/health_json.hpp"
#include "daemon/shell/modules_json.hpp"
#include "daemon/shell/why_json.hpp"
#include "daemon/shell/why_limits.hpp"
#include "devices/device_list.hpp"

namespace bmu {

namespace {

constexpr std::size_t rejected_ids_shown = 5;

template <class T>
Json or_null(bool is_known, T value) {
  return is_known ? Json(value) : Json(nullptr);
}

// --- measurements ---------------------------------------------------------------------------------------------------

template <class T>
std::string_view validity_text(const Measured<T>& measured, TimePoint now, Duration age_max) {
  if (measured.taken_at == TimePoint{}) return "never seen";
  if (!measured.is_fresh(now, age_max)) return "stale";
  return to_text(measured.validity);
}

/// `key` with its value or null, and validity and age under the name without the unit.
void put(Json& to, std::string_view key, Unit unit, const Measured<std::int32_t>& measured, const StatusView& view,
         Duration age_max) {
  to[key_with_unit(key, unit)] = or_null(measured.is_usable(view.now, age_max), measured.value);
  to[std::string(key) + "_validity"] = validity_text(measured, view.now, age_max);
  to[std::string(key) + "_age_ms"] = ago_ms(view, measured.taken_at);
}

Json spread_json(const Spread& spread, Unit unit, const StatusView& view) {
  const bool is_known = spread.is_known();
  return {{key_with_unit("min", unit), or_null(is_known, spread.min)},
          {"min_at", is_known ? element_json(spread.min_at, unit) : Json(nullptr)},
          {"min_age_ms", is_known ? ago_ms(view, spread.min_taken_at) : Json(nullptr)},
          {key_with_unit("max", unit), or_null(is_known, spread.max)},
          {"max_at", is_known ? element_json(spread.max_at, unit) : Json(nullptr)},
          {"max_age_ms", is_known ? ago_ms(view, spread.max_taken_at) : Json(nullptr)},
          {key_with_unit("average", unit), or_null(is_known, spread.average)},
          {"count", spread.count},
          {"expected", spread.expected}};
}

Json pack_values_json(const StatusView& view) {
  const PackState& pack = view.core.pack();
  const SensorTable& sensors = view.core.sensors();
  const AgeConfig& ages = view.core.config().ages;
  const auto sum = [](const Measured<std::int32_t>& value) { return or_null(value.is_valid(), value.value); };
  Json values;
  put(values, "pack_voltage", Unit::mV, sensors.pack_voltage_mV, view, ages.pack_voltage);
  put(values, "link_voltage", Unit::mV, sensors.link_voltage_mV, view, ages.pack_voltage);
  put(values, "current", Unit::mA, sensors.current_mA, view, ages.pack_current);
  values["cell_voltage_sum_mV"] = sum(pack.cell_voltage_sum_mV);
  values["module_voltage_sum_mV"] = sum(pack.module_voltage_sum_mV);
  values["cell_voltage"] = spread_json(pack.cell_voltage_uV, Unit::uV, view);
  values["cell_temperature"] = spread_json(pack.cell_temperature_dC, Unit::dC, view);
  values["board_temperature"] = spread_json(pack.board_temperature_dC, Unit::dC, view);
  return values;
}

std::int64_t in_permille(double share) {
  return std::llround(share * 1e3);
}
std::int64_t in_uAs(double charge_As) {
  return std::llround(charge_As * 1e6);
}

Json in_ms(const std::optional<Duration>& span) {
  return span ? Json(to_ms(*span)) : Json();
}

/// What each method says of the pack's emptiest and fullest cell is in `cells`; here the chosen one's.
Json charge_json(const StatusView& view) {
  const ChargeState& charge = view.core.charge();
  const PackEstimate& estimate = view.core.estimate();
  const bool is_known = estimate.pack().is_known;
  return {{"is_known", is_known},
          {"soc_permille", or_null(is_known, estimate.told_permille())},
          {"soc_sigma_permille", or_null(is_known, in_permille(estimate.pack().sigma))},
          {"estimated_soc_permille", or_null(is_known, in_permille(estimate.pack().soc))},
          {"method", to_text(estimate.method())},
          {"origin", to_text(estimate.origin())},
          {"record_age_ms", in_ms(estimate.record_age())},
          {"anchored_ago_ms", ago_ms(view, estimate.anchored_at())},
          {"emptiest_cell", or_null(is_known, estimate.pack().emptiest + 1)},
          {"fullest_cell", or_null(is_known, estimate.pack().fullest + 1)},
          {"depth_of_discharge_uAs", or_null(is_known, estimate.depth_of_discharge_uAs())},
          {"usable_capacity_uAs", or_null(is_known, in_uAs(estimate.pack().capacity_As()))},
          {"capacity_uAs", view.core.config().cell.capacity_uAs},
          {"empty_in_ms", in_ms(estimate.empty_in())},
          {"full_in_ms", in_ms(estimate.full_in())},
          {"energy_out_mWh", charge.energy_out_mWh},
          {"energy_in_mWh", charge.energy_in_mWh},
          {"uncounted_ms", to_ms(charge.uncounted)}};
}

// --- state ----------------------------------------------------------------------------------------------------------

std::string_view name_of(std::span<const RawName> names, std::int64_t raw) {
  const auto found = std::find_if(names.begin(), names.end(), [raw](const RawName& name) { return name.raw == raw; });
  return found == names.end() ? "?" : found->name;
}

/// The bits of elithion's state that are set, by their names: "K1 on, K3 on".
std::string elithion_state_text(std::uint8_t state) {
  constexpr std::array<std::string_view, 5> names{"fault", "K1 on", "K2 on", "K3 on", "relay fault"};
  std::string text;
  for (std::size_t bit = 0; bit < names.size(); ++bit) {
    if ((state >> bit & 1U) == 0) continue;
    text.append(text.empty() ? "" : ", ").append(names.at(bit));
  }
  return text.empty() ? "no fault, contactors off" : text;
}

/// In the words of the dialect.
std::string vehicle_state_text(VehicleDialect dialect, std::uint8_t state) {
  switch (dialect) {
    case VehicleDialect::iha: break;
    case VehicleDialect::original: return std::string(name_of(vehicle_bus_original::state_names, state));
    case VehicleDialect::elithion: return elithion_state_text(state);
  }
  return std::string(name_of(vehicle_bus::state_names, state));
}

/// Which bits are set, counted from 1.
Json numbers_of(unsigned bits) {
  Json numbers = Json::array();
  for (unsigned number = 1; bits != 0; ++number, bits >>= 1U) {
    if ((bits & 1U) != 0) numbers.push_back(number);
  }
  return numbers;
}

std::string_view mode_text(internal_bus::Mode mode) {
  return name_of(internal_bus::mode_names, static_cast<std::int64_t>(mode));
}

}  // namespace

Json outputs_json(const ContactorOutputs& outputs) {
  return {{"main_positive", outputs.main_positive},
          {"main_negative", outputs.main_negative},
          {"precharge", outputs.precharge},
          {"charge", outputs.charge},
          {"auxiliary", outputs.auxiliary},
          {"fan", outputs.fan},
          {"heater", outputs.heater}};
}

Json feedback_json(const PduState& pdu) {
  return {{"main_positive", pdu.main_positive_closed},
          {"main_negative", pdu.main_negative_closed},
          {"precharge", pdu.precharge_closed},
          {"charge", pdu.charge_closed},
          {"opened_by_timeout", pdu.opened_by_timeout}};
}

Json inputs_json(const PduState& pdu) {
  const SignalValue& resistance = pdu.insulation_resistance_Ohm;
  return {{"vehicle_on", pdu.vehicle_on},
          {"charger_connected", pdu.charger_connected},
          {"estop_1_released", pdu.estop_1_released},
          {"estop_2_released", pdu.estop_2_released},
          {"interlock_closed", pdu.interlock_closed},
          {"insulation_monitor_ok", pdu.insulation_monitor_ok},
          {"resume_button", pdu.resume_button},
          {"supply_ok", pdu.supply_ok},
          {"estops_pressed", numbers_of(pdu.estops_pressed)},
          {"interlocks_open", numbers_of(pdu.interlocks_open)},
          {"throttle_permille", or_null(pdu.throttle_permille.is_valid(), pdu.throttle_permille.value)},
          {"insulation_state", to_text(pdu.insulation_state)},
          {"insulation_resistance_Ohm", or_null(resistance.is_valid(), resistance.value)},
          {"insulation_resistance_validity", to_text(resistance.validity)}};
}

namespace {

/// For the eye alone: contacts and inputs, or what the unit says of them while the lines of this machine cannot be
/// read.
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

/// What a missing line would tell is not known, whatever the unit says of it.
void forget_contacts_of_lines(Json& feedback, const LinesConfig& lines) {
  for (std::size_t i = 0; i < contactor_id_count; ++i) {
    if (((lines.feedback >> i) & 1U) != 0) feedback[std::string(gpio_output_names[i])] = nullptr;
  }
}

void forget_inputs_of_lines(Json& inputs, const LinesConfig& lines) {
  const std::pair<bool, const char*> on_lines[] = {{lines.has_vehicle_on, "vehicle_on"},
                                                   {lines.has_charger_connected, "charger_connected"},
                                                   {lines.has_resume_button, "resume_button"},
                                                   {lines.has_insulation_ok, "insulation_monitor_ok"},
                                                   {lines.has_supply_ok, "supply_ok"},
                                                   {true, "estops_pressed"},
                                                   {true, "interlocks_open"}};
  for (const auto& [is_on_line, key] : on_lines) {
    if (is_on_line) inputs[key] = nullptr;
  }
}

void put_switches(Json& state, const StatusView& view) {
  const SwitchesSeen seen = switches_seen(view);
  state["feedback"] = seen.is_heard ? feedback_json(seen.pdu.value) : Json(nullptr);
  state["inputs"] = seen.is_heard ? inputs_json(seen.pdu.value) : Json(nullptr);
  state["feedback_age_ms"] = ago_ms(view, seen.pdu.taken_at);
  if (!seen.are_lines_missing) return;
  forget_contacts_of_lines(state["feedback"], view.core.config().lines);
  forget_inputs_of_lines(state["inputs"], view.core.config().lines);
}

Json state_json(const StatusView& view) {
  const Core& core = view.core;
  const VehicleDialect dialect = core.config().vehicle.dialect;
  Json json{{"phase", to_text(core.sequence().phase)},
            {"phase_for_ms", to_ms(view.now - std::max(core.sequence().entered_at, core.started_at()))},
            {"vehicle_state", vehicle_state_text(dialect, vehicle_state(dialect, core.mode_inputs(view.now)))},
            {"mode", to_text(core.mode(view.now))},
            {"close_requested", core.is_close_requested()},
            {"wish", {{"by_vehicle", core.wish().by_vehicle}, {"by_charger", core.wish().by_charger}}},
            {"rest", to_text(core.rest().phase())},
            {"rest_for_ms", ago_ms(view, core.rest().since())},
            {"outputs", outputs_json(core.outputs())}};
  put_switches(json, view);
  return json;
}

Json refusal_json(const StatusView& view) {
  const RefusalRecord& refusal = view.core.last_refusal();
  if (!refusal.has_happened) return nullptr;
  return {{"refused_ago_ms", ago_ms(view, refusal.at)}, {"blocker", to_text(refusal.blocker)}};
}

Json permission_json(const StatusView& view) {
  const Permission& permission = view.core.permission();
  const Duration locked_out = std::max(view.core.locked_out_until() - view.now, Duration{});
  Json blockers = Json::array();
  for (const Blocker blocker : permission.blockers) blockers.push_back(to_text(blocker));
  return {{"may_close", permission.may_close},      {"may_stay_closed", permission.may_stay_closed},
          {"may_charge", permission.may_charge},    {"may_discharge", permission.may_discharge},
          {"locked_out_for_ms", to_ms(locked_out)}, {"blockers", std::move(blockers)},
          {"last_refusal", refusal_json(view)}};
}

Json limits_json(const Core& core) {
  const CurrentLimits& limits = core.limits();
  return {{"discharge", limit_json(limits.discharge, core.config())},
          {"charge", limit_json(limits.charge, core.config())},
          {"discharge_continuous", limit_json(limits.discharge_continuous, core.config())},
          {"charge_continuous", limit_json(limits.charge_continuous, core.config())}};
}

Json overload_json(const Core& core) {
  const OverloadCounter& overload = core.watchers().overload;
  return {{"discharge_used_permille", overload.discharge_used_permille()},
          {"charge_used_permille", overload.charge_used_permille()}};
}

// --- contactors, lines, store ---------------------------------------------------------------------------------------

Json precharge_guard_json(const Core& core) {
  const PrechargeGuard& guard = core.precharge_guard();
  const ContactorConfig& config = core.config().contactors;
  const std::int64_t heat_max_mJ = std::int64_t{config.precharge_energy_J} * 1'000;
  return {{"tries_failed", guard.tries_failed()},
          {"tries_max", config.precharge_tries},
          {"is_cool", guard.is_cool()},
          {"heat_mJ", guard.heat_mJ()},
          {"heat_max_mJ", or_null(heat_max_mJ > 0, heat_max_mJ)}};
}

Json wear_json(const Core& core) {
  Json json = Json::object();
  for (std::size_t i = 0; i < contactor_id_count; ++i) {
    const ContactorWear& wear = core.persistent().contactors[i];
    json[std::string(gpio_output_names[i])] = {{"closings", wear.closings},
                                               {"openings", wear.openings},
                                               {"openings_under_load", wear.openings_under_load},
                                               {"current_broken_max_mA", wear.current_broken_max_mA},
                                               {"current_broken_sum_mA", wear.current_broken_sum_mA}};
  }
  return json;
}

/// Bits by the names of the inputs they stand for.
Json bits_json(unsigned bits, const std::vector<std::string_view>& names) {
  Json json = Json::object();
  for (std::size_t i = 0; i < names.size(); ++i) json[std::string(names[i])] = ((bits >> i) & 1U) != 0;
  return json;
}

/// The lines of this machine; null where the pack file has none. Levels are those of the last look, null if it failed.
Json lines_json(const StatusView& view) {
  if (view.lines == nullptr) return nullptr;
  const GpioLines& lines = view.lines->lines();
  const LineImage& image = view.lines->last();
  Json json{{"chip", lines.chip()},
            {"state", to_text(lines.state())},
            {"last_error", lines.state() == GpioState::failed ? Json(lines.last_error()) : Json(nullptr)},
            {"levels", nullptr}};
  if (image.is_failed) return json;
  const LinesConfig& used = view.core.config().lines;
  Json contacts = Json::object();
  for (std::size_t i = 0; i < contactor_id_count; ++i) {
    if (((used.feedback >> i) & 1U) == 0) continue;
    contacts[std::string(gpio_output_names[i])] = ((image.closed_contacts >> i) & 1U) != 0;
  }
  json["levels"] = {{"closed_contacts", std::move(contacts)},
                    {"estops_pressed", bits_json(image.estops_pressed, lines.names_of(GpioInputKind::estop))},
                    {"interlocks_open", bits_json(image.interlocks_open, lines.names_of(GpioInputKind::interlock))},
                    {"vehicle_on", or_null(used.has_vehicle_on, image.vehicle_on)},
                    {"charger_connected", or_null(used.has_charger_connected, image.charger_connected)},
                    {"resume_button", or_null(used.has_resume_button, image.resume_button)},
                    {"insulation_ok", or_null(used.has_insulation_ok, image.insulation_ok)},
                    {"supply_ok", or_null(used.has_supply_ok, image.supply_ok)}};
  return json;
}

/// The file the state is kept in; null where there is none.
Json store_json(const StatusView& view) {
  const StateStore& store = view.store;
  if (store.path().empty()) return nullptr;
  const OwnHealth health = store.health();
  const std::string error = store.last_error();
  return {{"path", store.path()},
          {"found_at_start", to_text(store.found().found)},
          {"unknown_names", store.found().unknown_names},
          {"writes", store.writes()},
          {"write_failed", health.store_write_failed},
          {"last_error", or_null(!error.empty(), error)},
          {"disk_low", health.disk_low}};
}

/// What is recorded, and where it goes; null where nothing is.
Json recorder_json(const StatusView& view) {
  if (view.recorder == nullptr) return nullptr;
  const RecorderStatus status = view.recorder->status();
  return {{"record_path", or_null(!status.record_path.empty(), status.record_path)},
          {"recorded_bytes", status.recorded_bytes},
          {"record_error", or_null(!status.record_error.empty(), status.record_error)},
          {"pieces_lost", view.recorder->pieces_lost()},
          {"seconds_lost", status.frames_lost},
          {"black_boxes", status.black_boxes},
          {"black_boxes_lost", status.black_boxes_lost},
          {"black_box_path", or_null(!status.black_box_path.empty(), status.black_box_path)},
          {"black_box_error", or_null(!status.black_box_error.empty(), status.black_box_error)},
          {"memory_bytes", status.memory_bytes},
          {"memory_ms", to_ms(status.memory_length)}};
}

/// The database of minutes; null where there is none.
Json history_json(const StatusView& view) {
  if (view.history.path().empty()) return nullptr;
  const HistoryHealth health = view.history.health();
  return {{"path", view.history.path()},
          {"state", to_text(health.state)},
          {"rows_written", health.rows_written},
          {"rows_lost", health.rows_lost},
          {"rows_waiting", health.rows_waiting},
          {"events_written", health.events_written},
          {"events_lost", health.events_lost},
          {"size_bytes", health.size_bytes},
          {"last_error", or_null(!health.last_error.empty(), health.last_error)},
          {"put_aside", or_null(!health.put_aside.empty(), health.put_aside)}};
}

// --- faults ---------------------------------------------------------------------------------------------------------

Json fault_names_json(const FaultMemory& faults, bool (*is_wanted)(const FaultState&)) {
  Json names = Json::array();
  for (const FaultRow& row : fault_table()) {
    if (is_wanted(faults.state(row.id))) names.push_back(row.name);
  }
  return names;
}

// --- buses ----------------------------------------------------------------------------------------------------------

/// Null for a bus that is no interface. What its driver does not tell is null, too.
Json controller_json(const std::string& bus_name, const StatusView& view) {
  const auto report = view.links == nullptr ? std::nullopt : view.links->report(bus_name);
  if (!report) return nullptr;
  const LinkDetails& details = report->details;
  const ErrorCounters errors = details.errors.value_or(ErrorCounters{});
  const ControllerHistory history = details.history.value_or(ControllerHistory{});
  const bool has_history = details.history.has_value();
  return {{"state", to_text(details.state)},
          {"send_errors", or_null(details.errors.has_value(), errors.sending)},
          {"receive_errors", or_null(details.errors.has_value(), errors.receiving)},
          {"restart_ms", or_null(details.is_can, details.restart_ms)},
          {"restarts", or_null(has_history, history.restarts)},
          {"times_bus_off", or_null(has_history, history.times_bus_off)},
          {"times_passive", or_null(has_history, history.times_passive)},
          {"bus_errors", or_null(has_history, history.bus_errors)},
          {"set_up", to_text(report->set_up)}};
}

Json port_json(Port port, const StatusView& view) {
  const BusPort& bus = view.buses.serving(port);
  const PortStatus& counts = view.core.port(port);
  const bool is_judged = &bus == &view.buses.internal();  // the pack file says nothing of the other's
  const std::uint32_t rate_bit_per_s = bus.rate_bit_per_s();
  const Port counted = view.buses.served_by[static_cast<std::size_t>(port)];
  return {{"port", to_text(port)},
          {"bus", bus.name()},
          {"state", to_text(bus.state())},
          {"is_shared", view.buses.is_shared(port)},
          {"rate_bit_per_s", or_null(rate_bit_per_s > 0, rate_bit_per_s)},
          {"rate_wanted_bit_per_s", or_null(is_judged && rate_bit_per_s > 0, view.rate.wanted_bit_per_s)},
          {"rate_planned_bit_per_s", or_null(is_judged, view.rate.wanted_bit_per_s)},
          {"rate_verdict", to_text(is_judged ? view.rate.verdict : RateVerdict::unknown)},
          {"bits_seen", view.loop.bits_seen[static_cast<std::size_t>(counted)]},
          {"frames_sent", counts.frames_sent},
          {"frames_echoed", counts.frames_echoed},
          {"sends_failed", counts.sends_failed},
          {"frames_lost", counts.frames_lost},
          {"error_frames", counts.error_frames},
          {"times_down", counts.times_down},
          {"controller", controller_json(bus.name(), view)},
          {"last_error", bus.last_error()}};
}

/// The reports' identifiers are ours, too: where both buses are one, somebody else may send them there.
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

Json most_rejected_json(const Core& core) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> ids;  // count, identifier
  for (std::uint32_t id = 0; id < Catalogue::id_count; ++id) {
    const std::uint32_t count = core.receive_check().rejected_under(id) + core.foreign_check().rejected_under(id);
    if (count > 0) ids.emplace_back(count, id);
  }
  std::sort(ids.begin(), ids.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  if (ids.size() > rejected_ids_shown) ids.resize(rejected_ids_shown);
  Json json = Json::array();
  for (const auto& [count, id] : ids) {
    const MessageMatch match = find_message(id, core);
    json.push_back({{"id", id_text(id)},
                    {"message", match.message != nullptr ? Json(match.message->name) : Json(nullptr)},
                    {"node", match.node},
                    {"count", count}});
  }
  return json;
}

Json receive_json(const Core& core) {
  const ReceiveCounts counts = core.receive_counts();
  const RefusedResult& refused = core.sensors().refused;  // sound frames whose result is none
  Json by_reason = Json::object();
  for (std::size_t reason = 0; reason < reject_reason_count; ++reason) {
    by_reason[std::string(to_text(static_cast<RejectReason>(reason)))] = counts.rejected[reason];
  }
  return {{"accepted", counts.accepted},
          {"rejected", counts.rejected_total()},
          {"rejected_by_reason", std::move(by_reason)},
          {"most_rejected", most_rejected_json(core)},
          {"sensor_results_refused", refused.count},
          {"sensor_result_refused_last", or_null(refused.count > 0, to_text(refused.why))}};
}

Json module_summary_json(std::size_t index, const StatusView& view) {
  const ModuleRecord& module = view.core.modules().modules()[index];
  const AgeConfig& ages = view.core.config().ages;
  const bool has_status = module.status.is_usable(view.now, ages.module_status);
  return {{"node", module.config.node},
          {"is_answering", is_answering(module, ages, view.now)},
          {"mode", has_status ? Json(mode_text(module.status.value.mode)) : Json(nullptr)},
          {"serial_number", or_null(module.identity.is_valid(), module.identity.value.serial_number)},
          {"limits_set", or_null(has_status, !module.status.value.limits_not_set)},
          {"limits_refused", view.core.module_setup().is_refused(index)},
          {"place", are_modules_ours(view.core.config()) ? to_text(view.core.finding(module).place) : "not told"},
          {"answer_latency_ms", to_ms(module.answer_times.last())},
          {"answers_complete", module.answers_complete},
          {"answers_missed", module.answers_missed},
          {"last_answer_age_ms", ago_ms(view, module.last_answer_at)}};
}

// --- the last closing and opening ---

Json precharge_json(const StatusView& view) {
  const PrechargeRecord& record = view.core.last_precharge();
  if (!record.has_run) return nullptr;
  return {{"was_successful", record.was_successful}, {"ended_ago_ms", ago_ms(view, record.ended_at)},
          {"took_ms", to_ms(record.took)},           {"pack_voltage_mV", record.pack_mV},
          {"link_voltage_mV", record.link_mV},       {"current_mA", record.current_mA}};
}

Json drive_json(const StatusView& view) {
  const DriveRecord& drive = view.drive;
  if (!drive.has_run) return nullptr;
  return {{"is_running", drive.is_running},         {"closed_ago_ms", ago_ms(view, drive.closed_at)},
          {"lasted_ms", to_ms(drive.lasted)},       {"charge_used_uAs", drive.charge_used_uAs},
          {"energy_out_mWh", drive.energy_out_mWh}, {"energy_in_mWh", drive.energy_in_mWh}};
}

Json daemon_json(const StatusView& view) {
  return {{"version", BMUD_VERSION},
          {"uptime_ms", ago_ms(view, view.core.started_at())},
          {"reloads", view.reloads},
          {"ticks", view.core.ticks()},
          {"ticks_late", view.loop.ticks_late},
          {"tick_latest_us", std::chrono::duration_cast<std::chrono::microseconds>(view.loop.latest).count()},
          {"gate_refusals", view.core.gate_refusals()},
          {"log_lines_lost", view.log_lines_lost},
          {"notify_sends_failed", view.notify_sends_failed},
          {"clients_dropped", view.clients_dropped}};
}

Json pack_json(const StatusView& view) {
  const CoreConfig& config = view.core.config();
  std::array<char, 20> hash{};
  std::snprintf(hash.data(), hash.size(), "%016llx", static_cast<unsigned long long>(config.hash));
  return {{"name", view.pack_name},
          {"cell_name", view.cell_name},
          {"config_hash", hash.data()},
          {"module_count", config.modules.size()},
          {"cell_count", cell_count(config)}};
}

// --- cells ----------------------------------------------------------------------------------------------------------

/// Lists of equal length, a column each: value or null, validity, age.
template <std::size_t Room>
void put_column(Json& to, std::string_view key, Unit unit, const std::array<Measured<std::int32_t>, Room>& values,
                std::size_t count, const StatusView& view, Duration age_max) {
  Json numbers = Json::array();
  Json validities = Json::array();
  Json ages_ms = Json::array();
  for (std::size_t i = 0; i < count; ++i) {
    numbers.push_back(or_null(values[i].is_usable(view.now, age_max), values[i].value));
    validities.push_back(validity_text(values[i], view.now, age_max));
    ages_ms.push_back(ago_ms(view, values[i].taken_at));
  }
  to[key_with_unit(key, unit)] = std::move(numbers);
  to[std::string(key) + "_validity"] = std::move(validities);
  to[std::string(key) + "_age_ms"] = std::move(ages_ms);
}

/// Columns of what the chosen method says of each cell, how sure it is, and what the others say.
void put_estimates(Json& to, std::size_t first_cell, std::size_t count, const PackEstimate& estimate) {
  Json chosen = Json::array();
  Json sigma = Json::array();
  Json by_method = Json::object();
  for (std::size_t cell = first_cell; cell < first_cell + count; ++cell) {
    const SocEstimate soc = estimate.cell_soc(cell);
    chosen.push_back(or_null(soc.is_known, in_permille(soc.soc)));
    sigma.push_back(or_null(soc.is_known, in_permille(soc.sigma)));
    for (const SocMethod method : {SocMethod::ekf, SocMethod::mixed, SocMethod::coulomb}) {
      const SocEstimate one = estimate.cell(cell).estimate(method);
      by_method[std::string(to_text(method))].push_back(or_null(one.is_known, in_permille(one.soc)));
    }
  }
  to["soc_permille"] = std::move(chosen);
  to["soc_sigma_permille"] = std::move(sigma);
  to["soc_by_method_permille"] = std::move(by_method);
}

Json module_cells_json(const ModuleRecord& module, std::size_t first_pack_number, const StatusView& view) {
  const AgeConfig& ages = view.core.config().ages;
  Json balancing = Json::array();
  for (unsigned cell = 0; cell < module.config.cell_count; ++cell) {
    balancing.push_back(((module.balancing_cells >> cell) & 1U) != 0);
  }
  Json json{{"node", module.config.node},
            {"is_answering", is_answering(module, ages, view.now)},
            {"first_pack_number", first_pack_number}};
  put_column(json, "cell_voltage", Unit::uV, module.cell_voltage_uV, module.config.cell_count, view, ages.cell_voltage);
  put_column(json, "cell_temperature", Unit::dC, module.cell_temperature_dC, module.config.temperature_sensor_count,
             view, ages.temperature);
  put_column(json, "board_temperature", Unit::dC, module.board_temperature_dC, module.board_temperature_dC.size(), view,
             ages.temperature);
  put(json, "module_voltage", Unit::mV, module.module_voltage_mV, view, ages.cell_voltage);
  json["balancing"] = std::move(balancing);
  put_estimates(json, first_pack_number - 1, module.config.cell_count, view.core.estimate());
  json["last_answer_age_ms"] = ago_ms(view, module.last_answer_at);
  return json;
}

Json band_json(const LimitConfig& low, const LimitConfig& high, Unit unit) {
  return {{key_with_unit("low_open", unit), low.open},
          {key_with_unit("low_warn", unit), low.warn},
          {key_with_unit("high_warn", unit), high.warn},
          {key_with_unit("high_open", unit), high.open}};
}

Json charger_unit_json(std::size_t index, const StatusView& view) {
  const ChargerTable& table = view.core.chargers();
  const ChargerUnit& unit = table.unit(index);
  const bool talks = table.is_talking(index, view.now);
  const auto value = [talks](const SignalValue& one) { return or_null(talks && one.is_valid(), one.value); };
  Json troubles = Json::array();
  for (std::size_t number = 0; talks && number < charger_trouble_count; ++number) {
    const auto trouble = static_cast<ChargerTrouble>(number);
    if ((unit.report.troubles & bit_of(trouble)) != 0) troubles.push_back(to_text(trouble));
  }
  return {{"unit", index + 1},
          {"is_talking", talks},
          {"heard_ago_ms", ago_ms(view, unit.values_at)},
          {"voltage_mV", value(unit.report.voltage_mV)},
          {"current_mA", value(unit.report.current_mA)},
          {"mains_voltage_mV", value(unit.report.mains_voltage_mV)},
          {"mains_current_mA", value(unit.report.mains_current_mA)},
          {"temperature_dC", value(view.core.chargers().temperature_dC(index, view.now))},
          {"troubles", std::move(troubles)},
          {"frames_refused", unit.frames_refused},
          {"values_out_of_range", unit.values_out_of_range},
          {"values_unknown", unit.values_unknown}};
}

/// Null where no charger is driven.
Json charger_json(const StatusView& view) {
  const ChargerTable& table = view.core.chargers();
  if (!table.is_there()) return nullptr;
  const ChargeControl& charge = view.core.charge_control();
  Json units = Json::array();
  for (std::size_t index = 0; index < table.unit_count(); ++index) units.push_back(charger_unit_json(index, view));
  return {{"protocol", table.driver().name},
          {"stage", to_text(charge.stage())},
          {"stage_for_ms", ago_ms(view, charge.since())},
          {"is_held", charge.is_held()},
          {"goes_on_when_heard", view.core.is_resume_pending()},
          {"asked_mA", charge.current_mA()},
          {"asked_mV", charge.voltage_mV()},
          {"cell_full_uV", charge.cell_full_uV()},
          {"units", std::move(units)}};
}

/// Null where no inverter is told anything. `told` is what it is told now, and what is left out is null.
Json inverter_json(const StatusView& view) {
  const InverterWatch& watch = view.core.inverter();
  if (!watch.is_there()) return nullptr;
  const BatteryReport told = view.core.inverter_report();
  const InverterReport& said = watch.report();
  const bool talks = watch.is_talking(view.now);
  const auto value = [](const SignalValue& one) { return or_null(one.is_valid(), one.value); };
  const auto heard = [talks](const SignalValue& one) { return or_null(talks && one.is_valid(), one.value); };
  return {{"protocol", watch.config().driver->name},
          {"is_talking", talks},
          {"is_silent", view.core.is_inverter_silent()},
          {"heard_ago_ms", ago_ms(view, watch.heard_at())},
          {"has_failed", talks && said.has_failed},
          {"has_warning", talks && said.has_warning},
          {"error_number", or_null(talks, said.error_number)},
          {"voltage_mV", heard(said.voltage_mV)},
          {"current_mA", heard(said.current_mA)},
          {"temperature_dC", heard(said.temperature_dC)},
          {"told",
           {{"charge_limit_mA", told.charge_limit_mA},
            {"discharge_limit_mA", told.discharge_limit_mA},
            {"charge_voltage_limit_mV", told.charge_voltage_limit_mV},
            {"discharge_voltage_limit_mV", told.discharge_voltage_limit_mV},
            {"asks_for_charge", told.asks_for_charge},
            {"asks_for_full_charge", told.asks_for_full_charge},
            {"soc_permille", value(told.soc_permille)},
            {"soh_permille", value(told.soh_permille)}}},
          {"frames_taken", watch.frames_taken()},
          {"frames_refused", watch.frames_refused()},
          {"values_out_of_range", said.values_out_of_range}};
}

/// Who tells the currents, and how the sensor that is asked for its settings is set up; null where it is not.
Json sensor_json(const StatusView& view) {
  const Core& core = view.core;
  const SensorConfig& config = core.config().sensor;
  const SensorTable& sensors = core.sensors();
  const Duration age_max = core.config().ages.pack_current;
  const auto current = [&](const Measured<std::int32_t>& one, const CurrentSensorDriver* driver) -> Json {
    return {{"protocol", or_null(driver != nullptr, driver != nullptr ? std::string(driver->name) : std::string())},
            {"current_mA", or_null(one.is_usable(view.now, age_max), one.value)},
            {"heard_ago_ms", ago_ms(view, one.taken_at)}};
  };
  Json json{{"first", current(sensors.current_mA, config.first)},
            {"second", config.has_second_current ? current(sensors.current_2_mA, config.second) : Json(nullptr)},
            {"results_refused", sensors.refused.count},
            {"last_refused_because", or_null(sensors.refused.count > 0, to_text(sensors.refused.why))},
            {"set_up", nullptr}};
  const SensorSetup& setup = core.sensor_setup();
  if (!setup.is_there()) return json;
  json["set_up"] = {{"protocol", config.set_up->name},
                    {"wanted", config.is_configured ? "configure" : "verify"},
                    {"stage", to_text(setup.stage())},
                    {"results_count", setup.are_results_good(view.now)},
                    {"problem", or_null(setup.has_failed(), to_text(setup.problem()))},
                    {"restarts", setup.restarts()},
                    {"answers_refused", setup.answers_refused()}};
  return json;
}

/// Null where no monitor is heard itself.
Json insulation_json(const StatusView& view) {
  const InsulationTable& table = view.core.insulation();
  if (!table.is_there()) return nullptr;
  const InsulationWord word = table.word(view.now);
  const MonitorReport& report = table.report();
  const bool has_pulses = view.core.config().insulation.has_pulse_line;
  const ir155::Pwm pulses = table.pulses(view.now);
  const TimePoint pulsed_at = pulses.frequency_mHz > 0 ? view.now - pulses.since_edge : TimePoint{};
  return {{"protocol", table.protocol()},
          {"is_talking", table.is_talking(view.now)},
          {"heard_ago_ms", ago_ms(view, has_pulses ? pulsed_at : table.heard_at())},
          {"frequency_mHz", or_null(has_pulses, pulses.frequency_mHz)},
          {"duty_permille", or_null(has_pulses, pulses.duty_permille)},
          {"state", to_text(word.state)},
          {"resistance_Ohm", or_null(word.resistance_Ohm.is_valid(), word.resistance_Ohm.value)},
          {"is_low", !word.is_ok},
          {"is_warning", report.is_warning},
          {"is_testing", report.is_testing},
          {"is_test_pending", report.is_test_pending},
          {"frames_refused", table.frames_refused()}};
}

/// Null where no second pack is expected; what is too old is null.
Json second_pack_json(const StatusView& view) {
  const SecondPack& pack = view.core.second_pack();
  if (!pack.is_expected()) return nullptr;
  const SecondPack::Values& values = pack.values();
  const auto fresh = [&](const Measured<std::int32_t>& one) {
    return or_null(one.is_usable(view.now, SecondPack::age_max), one.value);
  };
  const bool has_name = values.name[0] != '\0';
  const bool has_state = values.state.is_usable(view.now, SecondPack::age_max);
  const auto state = static_cast<std::uint8_t>(values.state.value);
  return {{"dialect", row_of(pack.dialect()).name},
          {"name", or_null(has_name, std::string(values.name.begin(), values.name.end()))},
          {"is_silent", pack.is_silent(view.now)},
          {"heard_ago_ms", ago_ms(view, pack.heard_at())},
          {"state", or_null(has_state, vehicle_state_text(pack.dialect(), state))},
          {"soc_permille", fresh(values.soc_permille)},
          {"soh_permille", fresh(values.soh_permille)},
          {"pack_voltage_mV", fresh(values.pack_voltage_mV)},
          {"current_mA", fresh(values.current_mA)},
          {"charge_limit_mA", fresh(values.charge_limit_mA)},
          {"discharge_limit_mA", fresh(values.discharge_limit_mA)},
          {"cell_voltage_min_uV", fresh(values.cell_voltage_min_uV)},
          {"cell_voltage_max_uV", fresh(values.cell_voltage_max_uV)},
          {"cell_temperature_min_dC", fresh(values.cell_temperature_min_dC)},
          {"cell_temperature_max_dC", fresh(values.cell_temperature_max_dC)},
          {"frames_taken", pack.frames_taken()},
          {"frames_refused", pack.frames_refused()},
          {"values_out_of_range", pack.values_out_of_range()}};
}

/// Null where no requests for data are answered.
Json requests_json(const Core& core) {
  if (core.config().vehicle.request_id == 0) return nullptr;
  const CellRequests::Counts& counts = core.cell_requests();
  return {{"answered", counts.answered},
          {"unanswered", counts.unanswered},
          {"refused", counts.refused},
          {"dropped", counts.dropped}};
}

}  // namespace

Json status_json(const StatusView& view) {
  const Core& core = view.core;
  Json modules = Json::array();
  for (std::size_t index = 0; index < core.modules().modules().size(); ++index) {
    modules.push_back(module_summary_json(index, view));
  }
  Json ports = Json::array();
  for (const Port port : all_ports) {
    if (view.buses.is_there(port)) ports.push_back(port_json(port, view));
  }
  return {{"pack", pack_json(view)},
          {"daemon", daemon_json(view)},
          {"state", state_json(view)},
          {"values", pack_values_json(view)},
          {"charge", charge_json(view)},
          {"health", pack_health_json(view)},
          {"limits", limits_json(core)},
          {"permission", permission_json(view)},
          {"balancing", balancing_state_json(view)},
          {"overload", overload_json(core)},
          {"precharge_guard", precharge_guard_json(core)},
          {"contactors", wear_json(core)},
          {"lines", lines_json(view)},
          {"store", store_json(view)},
          {"recorder", recorder_json(view)},
          {"history", history_json(view)},
          {"faults_present", fault_names_json(core.faults(), [](const FaultState& s) { return s.is_present(); })},
          {"warnings", fault_names_json(core.faults(), [](const FaultState& s) { return s.is_warning; })},
          {"modules_answering", core.pack().modules_answering},
          {"modules_expected", core.pack().modules_expected},
          {"complete_cycles", core.modules().complete_cycles()},
          {"poll", poll_json(view)},
          {"assignment", assignment_json(view)},
          {"modules", std::move(modules)},
          {"ports", std::move(ports)},
          {"charger", charger_json(view)},
          {"inverter", inverter_json(view)},
          {"sensor", sensor_json(view)},
          {"insulation", insulation_json(view)},
          {"second_pack", second_pack_json(view)},
          {"requests", requests_json(core)},
          {"receive", receive_json(core)},
          {"last_precharge", precharge_json(view)},
          {"drive", drive_json(view)},
          {"last_opening", opening_json(view)}};
}

Json cells_json(const StatusView& view) {
  const LimitsConfig& limits = view.core.config().limits;
  const PackState& pack = view.core.pack();
  Json modules = Json::array();
  std::size_t pack_number = 1;
  for (const ModuleRecord& module : view.core.modules().modules()) {
    modules.push_back(module_cells_json(module, pack_number, view));
    pack_number += module.config.cell_count;
  }
  return {{"cell_voltage_limits", band_json(limits.cell_undervoltage, limits.cell_overvoltage, Unit::uV)},
          {"cell_temperature_limits", band_json(limits.cell_undertemperature, limits.cell_overtemperature, Unit::dC)},
          {"cell_voltage", spread_json(pack.cell_voltage_uV, Unit::uV, view)},
          {"cell_temperature", spread_json(pack.cell_temperature_dC, Unit::dC, view)},
          {"modules", std::move(modules)}};
}

}  // namespace bmu
