#!/usr/bin/env python3
"""Writes moves.tsv from the lists of units below; to be run in a checkout before the moves."""
import pathlib, subprocess, sys
HERE = pathlib.Path(__file__).resolve().parent
files = subprocess.run(["git", "ls-files"], check=True, capture_output=True, text=True).stdout.split("\n")
F = set(files)
moves = {}

def units(source, target, names, rename=lambda n: n):
    for name in names.split():
        found = [s for s in (".cpp", ".hpp") if f"{source}/{name}{s}" in F]
        if not found:
            sys.exit(f"no {source}/{name}")
        for s in found:
            old = f"{source}/{name}{s}"
            if old in moves:
                sys.exit(f"twice: {old}")
            moves[old] = f"{target}/{rename(name)}{s}"

C = "daemon/core"
CE = C + "/estimators"
units(C, C + "/types", "core_config observation measured line_image contactor_id fault_reading memo")
units(C, C + "/cell", "cell_model cell_dynamics derating")
units(C, C + "/measurement", """module_table sensor_table pack_state answer_times jump_watch current_window insulation_table refused_values
  second_pack sensor_setup charger_table inverter_watch""")
units(C, C + "/modules", """module_roster module_setup module_assignment module_broadcasts module_rounds poll_schedule poll_pace command_turns""")
units(C, C + "/plausibility", """stuck_watch temperature_trend bus_watch overload_counter balancing_switches watchers charger_watch link_decay link_rise""")
units(C, C + "/faults", """fault_table fault_readers fault_readers_pack fault_readers_system fault_reader_parts fault_evaluate fault_memory likely_cause""")
units(C, C + "/limits", "limits limit_ramp power_limits current_prediction pack_forecast pack_forecaster")
units(C, C + "/contactors", """contactor_sequence contactor_watch contactor_ledger precharge_guard permission reclosing close_request command_link
  auxiliary rest_mode output_gate master_claim""")
units(C, C + "/balancing", "balancing_plan balancing_control balancing_conditions")
units(C, C + "/charging", "charge_control charge_pause charge_resume")
units(C, C + "/vehicle", """report_vehicle vehicle_state swapped_buses cell_reporter cell_requests cell_question cell_answers system_answers inverter_reporter""")
units(C, C + "/records", "event event_queue freeze_frame fault_history persistent_state")
units(CE, C + "/estimation/soc", """coulomb_counter current_spans charge_ends model_memo model_pointer cells_of_model soc_estimate soc_coulomb soc_filter
  soc_mixed cell_estimate pack_soc published_soc rest_anchor""")
units(CE, C + "/estimation/health", """capacity_estimate cell_health cell_health_record charge_plateau expected_resistance resistance_tracker pack_resistance
  state_of_health step_average step_response current_ramp_monitor""")
units(C, C + "/estimation/health", "pack_totals")
units(CE, C + "/estimation", """pack_estimate pack_health energy_left soc_record cell_charge cell_charge_record hysteresis_range""")
units(CE, C + "/cell", "ocv_shift")
units(CE, C + "/balancing", "polarisation")

S = "daemon/shell"
units(S, S + "/can", """bus_port buses can_socket embedded_bus embedded_ring link_details link_keeper link_system link_watch rate_watch port_rules""")
units(S, S + "/gpio", "gpio_lines line_feeder driven_lines")
units(S, S + "/status", """status_socket status_requests peer access account_file user_names status_json status_view drive_record why_json why_limits why_words
  modules_json foreign_modules_json cells_json measured_json faults_json health_json balance_json advice fault_page span_text""")
units(S, S + "/json", "json_text core_view switches_json freeze_json")
units(S, S + "/state", "state_store state_file state_text state_soc state_charges state_modules state_parts file_calls")
units(S, S + "/recorder", """recorder recorder_teller record_feed record_files record_queue record_frame black_box black_box_head kept_files append_file
  zstd_frame memory""")
units(S, S + "/serial", "serial_console serial_commands serial_lines serial_port cell_count_setting history_log log_source service_values")
units(S, S + "/system", "journal sparing_log service_notify real_time resource_watch os_error owned_fd sole_use intake_air")
units("tools/common", S + "/cli", "command_line completion described_option manual_page exit_codes joined")
units("tools/common", S + "/system", "whole_file")

M = "mmu"
units(M, M + "/devices", """alarm balancing bleeding_progress can_charger can_insulation can_inverter can_module can_requester can_second_pack charger
  current_sensor foreign_sensor frame_queue front_end imbalance insulation_unit mmu mode module_wire pdu pec15 protection request_words round_bound
  sampling sensor_unit supply thermistor periodic random contactor""")
units(M, M + "/plant", "plant load_profile")
units(M, M + "/scenario", """scenario scenario_check scenario_condition scenario_event scenario_plan scenario_player scenario_state scenario_table
  scenario_text scenario_words simulator world world_script""")

K = "config"
units(K, K + "/fields", """fields list_fields pack_fields control_fields limit_fields port_fields sensor_fields id_fields word_fields
  gpio_section part_reader reaction_reader""")
units(K, K + "/cell_file", "cell_config cell_dynamics_reader cell_file_writer charge_plateau_reader derating_reader")
units(K, K + "/checks", """bus_budget bus_checks bus_guests bus_rate charger_checks device_rates foreign_module_checks identifier_checks inverter_checks
  limit_bounds pack_checks pack_defaults sensor_checks""")

units(K, K + "/json", "json_reader read_file")
units(K, K + "/types", "gpio_config history_config intake_air_config interface_config serial_config")

R = "tools/report"
names = sorted({pathlib.PurePath(f).stem for f in files if f.startswith(R + "/report_")})
units(R, R, " ".join(names), lambda n: n.removeprefix("report_"))

D = "tools/bmudump"
units(D, D + "/identify", "device_fit device_hint dialect dump_catalogue evidence letters")
B = "tools/bmucell"
units(B, B + "/data", "ageing_data csv_file csv_table csv_text median plausible_recording pulse_table score_terms series steady_current")
units(B, B + "/fit", "fit fit_check fit_data fit_plan fit_unknowns fit_wishes fitted_file model_error normal_equations slow_curve voltage_terms")

# tests/unit mirrors the product: the folder of a test is that of what it is about.
def moved(path):
    return moves.get(path, path)
subjects = {}  # test -> a header of the product
special = {line.split()[0]: line.split()[1] for line in """
can_bus tests/support/can_bus.hpp
needs tests/support/needs.hpp
protocol_codec protocol/signal.hpp
protocol_crc protocol/bits.hpp
cell_evaluate tools/bmucell/evaluate.hpp
cell_fit tools/bmucell/fit.hpp
cell_series tools/bmucell/series.hpp
charger_drivers devices/charger.hpp
inverter_drivers devices/inverter.hpp
inverter_told daemon/core/inverter_reporter.hpp
device_contract devices/device_list.hpp
alarm_output mmu/alarm.hpp
history_file daemon/history/history_file.hpp
protocol_fields protocol/fields.hpp
answers daemon/shell/status_requests.hpp
charge_end daemon/core/pack_forecast.hpp
charge_plateau_config config/charge_plateau_reader.hpp
charger_page tools/bmuctl/text_pages.hpp
config config/pack_config.hpp
config_contradictions config/pack_checks.hpp
config_docs config/pack_fields.hpp
config_lines config/pack_config.hpp
config_rates config/bus_checks.hpp
contactor_supervision daemon/core/contactor_watch.hpp
core_allocation daemon/core/core.hpp
core_bus daemon/core/core.hpp
core_lock daemon/core/core.hpp
core_sensors daemon/core/core.hpp
core_stages daemon/core/core.hpp
derating_config config/derating_reader.hpp
dump_clock tools/bmudump/clock_jumps.hpp
dump_device_fit tools/bmudump/device_fit.hpp
dump_dialect tools/bmudump/dialect.hpp
dump_filter tools/bmudump/filter.hpp
dump_follow tools/bmudump/follow.hpp
dump_log_times tools/bmudump/log_times.hpp
dump_statistics tools/bmudump/statistics.hpp
fault_contract daemon/core/fault_table.hpp
fault_rows daemon/core/fault_table.hpp
fault_rows_chargers daemon/core/fault_table.hpp
fault_rows_inputs daemon/core/fault_table.hpp
fault_rows_modules daemon/core/fault_table.hpp
foreign_answers daemon/core/core.hpp
foreign_modules_config config/foreign_module_checks.hpp
foreign_sensors daemon/core/sensor_table.hpp
health_score tools/bmucell/health.hpp
hostile_image daemon/core/core_image.hpp
insulation_pulses daemon/core/insulation_table.hpp
inverter_config config/inverter_checks.hpp
inverter_page tools/bmuctl/text_pages.hpp
limit_causes daemon/core/limits.hpp
mmu_supply mmu/supply.hpp
mmu_unseen mmu/mmu.hpp
module_commands mmu/mmu.hpp
module_contract mmu/mmu.hpp
module_conflict daemon/core/module_table.hpp
module_driver devices/module_driver.hpp
modules_words daemon/shell/modules_json.hpp
reaction_config config/reaction_reader.hpp
receive_ids daemon/shell/buses.hpp
replay_joins tools/bmureplay/joins.hpp
replay_part tools/bmureplay/part.hpp
replay_run tools/bmureplay/run.hpp
report_history tools/report/report_from_history.hpp
report_recording tools/report/report_from_recording.hpp
scenario_parse mmu/scenario.hpp
sensor_config config/sensor_checks.hpp
sequence_exploration daemon/core/contactor_sequence.hpp
shipped_packs config/pack_config.hpp
socket_page daemon/shell/status_requests.hpp
vehicle_dialects daemon/core/report_vehicle.hpp
what_if_truth daemon/recording/what_if.hpp
why_replay daemon/shell/why_json.hpp
""".splitlines() if line.split()}
stems = {}
for f in files:
    if f.endswith(".hpp") and not f.startswith("tests/"):
        stems.setdefault(pathlib.PurePath(f).stem, []).append(f)
problems = []
for f in files:
    if not (f.startswith("tests/unit/") and f.count("/") == 2):
        continue
    stem = pathlib.PurePath(f).stem.removesuffix("_test")
    if stem in special:
        subject = special.pop(stem)
    else:
        found = stems.get(stem) or stems.get(stem.removeprefix("protocol_")) or []
        if len(found) > 1 and f"#include" in pathlib.Path(f).read_text():
            text = pathlib.Path(f).read_text()
            found = [h for h in found if f'"{h}"' in text] or found
        if len(found) != 1:
            problems.append((stem, found))
            continue
        subject = found[0]
    if subject not in F:
        problems.append((stem, subject, "not there"))
        continue
    folder = str(pathlib.PurePath(moved(subject)).parent).removeprefix("tests/")
    moves[f] = f"tests/unit/{folder}/{pathlib.PurePath(f).name}"
if special or problems:
    sys.exit("\n".join(map(str, [special, *problems])))
T = "tests/integration"
def tests(source, target, names):
    units(source, target, " ".join(name + "_test" for name in names.split()))
tests(T, T + "/tools", "bmucell_recordings bmucell_resistance bmucell bmuctl_report bmuctl_watch bmudump bmureplay client command_line mmusim_events mmusim")
moves[T + "/bmudump_worked_frames.txt"] = T + "/tools/bmudump_worked_frames.txt"
tests(T, T + "/shell", """can_socket driven_lines embedded_bus gpio_lines intake_air link_details loop real_time recorder sole_use
  state_power state_store status_socket""")
tests(T, T + "/daemon", """access_daemon alarm_loop charger_bus daemon_state daemon failing_calls foreign_modules history inverter processor_time reload
  second_daemon second_pack serial_console sleep swapped_buses""")
tests("tests/scenario", "tests/scenario/charging", "charge_end charge charger_bus charger_trouble")
tests("tests/scenario", "tests/scenario/foreign", "foreign_full_charge foreign_modules foreign_packs foreign_sensors inverter second_pack")
targets = list(moves.values())
assert len(set(targets)) == len(targets), [t for t in targets if targets.count(t) > 1]
clash = [t for o, t in moves.items() if t in F and t not in moves]
assert not clash, clash
with open(HERE / "moves.tsv", "w") as out:
    for old, new in sorted(moves.items()):
        if old != new:
            out.write(f"{old}\t{new}\n")
old_folders = {str(pathlib.PurePath(o).parent) for o in moves}
left = sorted(f for f in files if f.endswith((".cpp", ".hpp")) and f not in moves and str(pathlib.PurePath(f).parent) in old_folders)
(HERE / "stays.txt").write_text("".join(f"{f}\n" for f in left))
print(len(moves), "moves; in their folder stay", len(left))
