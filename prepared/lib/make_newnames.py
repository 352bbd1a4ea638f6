import sys, re, os, pickle, collections
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import newnames as N
moved = pickle.load(open('/tmp/moved.pkl', 'rb'))
idx = N.idx
H = {}
def h(text):
    for l in text.strip().split('\n'):
        p = [x.strip() for x in l.split('|')]
        H[p[0]] = (p[1], p[2] if len(p) > 2 else '')
h('''
asks_nobody | is_without_poll_targets | rule 3, 4
ask_foreign | poll_other_modules
ask_sensor | query_sensor
asked_mA | requested_mA
asked_mV | requested_mV
asked_of | request_text
bytes_asked | requested_bytes
has_charger_asked_last_ | is_last_request_from_charger_
asking_text | requester_text
asks_each | polls_each_module
asks_for_charge | requests_charge
asks_for_charge_ | requests_charge_
asks_for_full_charge | requests_full_charge
asks_for_full_charge_ | requests_full_charge_
vehicle_asks | vehicle_requests
vehicle_asks_about | vehicle_requests_cell
has_doubtful_seal | is_checksum_implausible
follow_life | follow_session
is_of_life | is_of_session
life_clock_ | session_clock_
life_from_us_ | session_from_us_
life_last_core_us_ | session_last_core_us_
battery_life | battery_data_timeout | "life" is session or timeout (2.1)
command_life | command_timeout
control_life | control_timeout
foreign_memory | conflict_timeout | memory is RAM (2.1)
misplaced_memory | misplaced_frame_timeout
hear_items | handle_items
hear_limits | handle_limits
hear_limits_only | handle_limits_only
heard_as | received_as
heard_since_ | received_since_
first_heard_at_ | first_received_at_
heard_text | received_text
is_heard_itself | is_received_directly
ScreenLine | CandumpScreenLine | a line of text: may stay
are_lines_missing | are_inputs_missing | GPIO
is_on_line | is_on_gpio
has_pulse_line | has_pulse_input
pulse_lines_ | pulse_inputs_
lines_driven_before | gpio_outputs_driven_before
lines_text | gpio_text
driven_lines_text | gpio_outputs_text
parse_driven_lines | parse_gpio_outputs
read_driven_lines | read_gpio_outputs
write_driven_lines | write_gpio_outputs
wrong_driven_lines | gpio_outputs_error
has_line_twice | has_duplicate_gpio
write_down_lines | write_gpio_outputs_file
put_lines | put_gpio
Link | CanLinkInfo | CanInterface exists already
link_in | can_interface_in
remember_link | remember_can_interface
inverter_obeys | inverter_follows
PackPicture | PackSampleSet
is_picture_due | is_watch_update_due
SensorPlace | SensorMounting
rest_for | rest_time | rest of the cells after a charge: check
second_pack_rest_mV | second_pack_ocv_mV
said_ | last_sent_
say_fuller_than | fuller_than_text
say_nothing_recorded | print_nothing_recorded
say_of_no_time | print_without_time
tell_bus_too_many | report_too_many_buses
tell_clash | report_conflict
tell_doubts | report_implausible
tell_hints | print_hints
tell_inverter | report_to_inverter
tell_torn | report_truncated
tell_unheard | report_not_received
tells_dialect | indicates_dialect
tells_errors | reports_errors
tells_stack_voltage | reports_stack_voltage
count_told | count_reported
first_told | first_commanded
is_adding_told_ | is_addition_reported_
is_missing_told_ | is_missing_reported_
is_told_by_length_ | is_detected_by_length_
is_told_by_length_of | is_detected_by_length_of
is_told_mains_current | takes_mains_current_limit
is_told_to_bleed_ | is_bleeding_commanded_
was_told_to_bleed_ | was_bleeding_commanded_
sensor_channels_told | sensor_channels_commanded
told_answer_min_uV | pulse_response_min_uV
told_mA_ | reported_mA_
told_over_ | over_report_
told_over_at_ | over_report_at_
told_over_min | over_report_min
with_sign_as_told | with_reported_sign
turn_round | invert
torn_line | truncated_line
torn_line_text | truncated_line_text
began_after | started_after
span_began_at_ | span_started_at_
assumed_begin_soc | assumed_initial_soc
begin_claim | start_claim
Begin | Start | check: beginning of a file
begun_ | started_
follow_asked | update_requested
follow_calm | update_calm
follow_claim | update_claim
follow_current | update_current
follow_mains | update_mains
follow_plug | update_plug
follow_requests | update_requests
follow_sides | update_sides
add_foreign | add_other_maker_modules
add_foreign_frames | add_unknown_frames
ForeignModulesConfig | OtherModulesConfig | "foreign" is second, unknown or other (2.1); the key foreign_modules with it
ForeignSensor | OtherSensor | sensor with a protocol of another maker
foreign_modules | other_modules | AssignmentRefusal; key of the pack file
foreign_module_fields | other_module_fields
foreign_module_table | other_module_table
foreign_modules_json | other_modules_json
foreign_bled_low_uV | other_module_bled_low_uV
foreign_cells_max | other_module_cells_max
foreign_cells_per_frame_max | other_module_cells_per_frame_max
foreign_temperatures_max | other_module_temperatures_max
foreign_margin_uV | other_module_margin_uV
foreign_overvoltage_margin_uV | other_module_overvoltage_margin_uV
foreign_check | unknown_frame_check
foreign_check_ | unknown_frame_check_
is_foreign_modules | has_other_modules
is_foreign_sensor_command | is_sensor_command_of_other_node
measure_foreign | measure_other_modules
take_foreign_current | handle_other_sensor_current
take_foreign_frame | handle_other_module_frame
take_foreign_rejected | handle_other_module_rejected
take_foreign_sensor_command | handle_sensor_command_of_other_node
tick_foreign_sensors | tick_other_sensors
foreign_ | other_modules_
foreign_at | conflict_at
foreign_at_ | conflict_at_
foreign_battery | inverter_message_conflict
has_foreign_battery | has_inverter_message_conflict
foreign_charger_command | second_charger_command
foreign_charger_commands | second_charger_commands
foreign_charger_master | second_charger_master
foreign_command_at | second_command_at
foreign_command_at_ | second_command_at_
GuestMessage | SharedBusMessage | devices that share a bus
guest_bits_per_s | shared_bus_bits_per_s
guest_load_permille | shared_bus_load_permille
Guests | SharedBusDevices
guests_on | devices_on
observe_guest | observe_device
held_max | hold_time_max
EnergyLeft | RemainingEnergy
EnergyLeftInput | RemainingEnergyInput
energy_left | remaining_energy
energy_left_input | remaining_energy_input
add_energy_left | add_remaining_energy
put_energy_left | put_remaining_energy
energy_left_Wh | remaining_energy_Wh
energy_left_mWh | remaining_energy_mWh
energy_left_sigma_mWh | remaining_energy_sigma_mWh
RowsLeftOut | OmittedRows
left_by_voltage_uV | remaining_by_voltage_uV
left_out_us | omitted_us
left_out_us_ | omitted_us_
left_unknown | remaining_unknown
pauses_left_ | pauses_remaining_
share_left | remaining_share
listen_from | start_listening_at | listening on a bus is CAN's term (listen-only); rule 4 says receive
is_listening | is_waiting_for_claim
while_listening | while_waiting_for_claim
listening_since_ | waiting_since_
look_ahead | read_ahead
look_for_contradiction | check_plausibility
look_for_excess | check_excess
look_for_mirror | check_mirror
look_for_silence | check_timeout
service_look | service_poll_interval
looked_ | checked_
Misfit | DutyCycleError | ir155
misfit_count | duty_cycle_error_count
are_modules_ours | are_modules_own_protocol
target_patience | target_timeout
IntakeAirSeen | IntakeAirUpdate | like GpioUpdate
PulsesSeen | PulseUpdate
PartSeen | PartEvidence
SeenBeside | CauseEvidence
SwitchesSeen | SwitchStates
switches_seen | switch_states
closed_only_when_seen_joined | closed_only_with_dc_link_at_pack_voltage
sees_second_pack_ | receives_second_pack_
speaks_for | supports
StepAnswer | CurrentStepResponse
ChargerTrouble | ChargerFault
SensorSetupTrouble | SensorSetupError
TroubleBit | FaultBit
TroubleMask | FaultMask
charger_trouble | charger_fault
charger_trouble_count | charger_fault_count
charger_trouble_words | charger_fault_words
has_trouble | has_fault
inverter_trouble | inverter_fault
trouble_bits | fault_bits
trouble_masks | fault_masks
trouble_rows | fault_rows
is_in_vain_ | is_without_effect_
crc_wanted | crc_expected
on_wanted_buses | on_configured_buses
set_wanted | set_expected
value_wanted_instead | expected_value_text
wanted_bus | expected_bus
wanted_of_charger | expected_of_charger
wanted_of_modules | expected_of_modules
wanted_of_property | expected_of_property
wanted_of_target | expected_of_target
wanted_setting | expected_setting
wants_devices | shows_devices
wants_sensor_of_the_car | requires_vehicle_sensor
wants_voltages | requests_voltages
BatteryWord | BatterySignal | quantity in the frames to an inverter; "word" is a keyword (2.1)
ChargerWord | ChargerSignal
CurrentWord | CurrentSignal
InverterWord | InverterSignal
MonitorWord | MonitorSignal
SetUpWord | SetupSignal
DeviceWord | DeviceSelector
InsulationWord | InsulationReport
device_word_of | device_selector_of
first_word_max | first_message_max
status_word | status_register
word_of_pulses | report_of_pulses
word_of_reports | report_of_frames
words_on | selectors_on
working_words | usable_selectors
charger_keeps_on | charger_not_stopping
LinkRise | DcLinkRise
SlowRise | SlowRise
Session | Session
''')
IDS = [
 ('fault_id', 'sensor_not_set_up', 'sensor_not_configured', 'like module_not_configured'),
 ('fault_id', 'charger_silent', 'charger_lost', 'receive timeout is _lost (rule 9)'),
 ('fault_id', 'charger_keeps_on', 'charger_output_stuck', 'condition of the list: _stuck'),
 ('fault_id', 'charger_trouble', 'charger_reports_fault', 'like module_reports_fault'),
 ('fault_id', 'charger_contradicts', 'charger_measurement_implausible', 'condition _implausible'),
 ('fault_id', 'charger_runaway', 'charger_runaway', 'established in scenarios (glossary line 537: keep)'),
 ('fault_id', 'foreign_charger_master', 'charger_second_master', 'like second_master'),
 ('fault_id', 'foreign_charger_commands', 'charger_command_conflict', 'condition _conflict'),
 ('fault_id', 'inverter_silent', 'inverter_message_missing', 'differs from inverter_lost: check both'),
 ('fault_id', 'inverter_trouble', 'inverter_reports_fault', ''),
 ('fault_id', 'foreign_battery', 'inverter_message_conflict', 'like vehicle_message_conflict'),
 ('fault_id', 'second_pack_silent', 'second_pack_lost', ''),
 ('fault_id', 'insulation_monitor_untested', 'insulation_monitor_test_missing', 'condition _missing'),
 ('fault_id', 'front_end_faults_missing', 'front_end_status_missing', ''),
 ('fault_id', 'inverter_lost, front_end_supply_low, front_end_overtemperature, module_supply_lost, alarm_loop_open', '(keep)', 'follow rule 9'),
 ('event_id', 'sensor_set_up', 'sensor_configured', ''),
 ('event_id', 'sensor_set_up_failed', 'sensor_configuration_failed', ''),
 ('event_id', 'charge_stage_changed, sensor_restarted', '(keep)', ''),
 ('type', 'RefusedResults, RefusedPulses', 'RejectedResults, RejectedPulses', 'as RefusedResult in line 305'),
 ('identifier', 'Blocker::no_claim', 'CloseInhibit::pack_not_claimed', 'text: other master of this pack not excluded'),
 ('identifier', 'LimitCause::not_sensed', 'LimitCause::sensor_data_missing', ''),
 ('identifier', 'LimitCause::power', 'LimitCause::power_limit', ''),
 ('identifier', 'AssignmentRefusal::foreign_modules', 'AssignmentRefusal::other_modules', ''),
 ('config_key', '/foreign_modules', '/other_modules', 'foreign -> other (2.1)'),
 ('config_key', '/foreign_modules/idle_as_others', '/other_modules/idle_mode_normal', 'check the meaning'),
 ('config_key', '/foreign_modules/swaps_cell_frames', '/other_modules/has_swapped_cell_frames', 'booleans: has_'),
 ('config_key', '/charger/end_for_ms', '/charger/end_confirm_ms', ''),
 ('config_key', '/charger/opens_when_full', '/charger/opens_when_full', 'keep'),
 ('config_key', '/inverter/first_word_max_ms', '/inverter/first_message_max_ms', 'word -> message'),
 ('config_key', '/inverter/silence_max_ms', '/inverter/timeout_ms', 'silence -> timeout'),
 ('config_key', '/inverter/when_silent', '/inverter/on_timeout', ''),
 ('config_key', '/inverter/maker', '/inverter/manufacturer', ''),
 ('config_key', '/sensor/set_up', '/sensor/configure', 'like interfaces: set_up -> configure'),
 ('config_key', '/sensor/store', '/sensor/store_permanently', 'check'),
 ('config_key', '/intake_air/age_max_ms', '/intake_air/max_age_ms', 'like max_ages'),
 ('config_key', '/interfaces/charger_kbit_per_s', '/interfaces/charger_bitrate_kbit_per_s', 'like internal_bitrate_kbit_per_s'),
 ('config_key', '/interfaces/inverter_kbit_per_s', '/interfaces/inverter_bitrate_kbit_per_s', ''),
 ('config_key', '/interfaces/second_pack_kbit_per_s', '/interfaces/second_pack_bitrate_kbit_per_s', ''),
 ('config_key', '/vehicle/may_clear_faults', '/vehicle/allow_clear_faults', 'permissions start with allow_'),
 ('config_key', '/serial/modules_max', '/serial/modules_max', 'keep'),
 ('config_key', '/contactors/break_current_max_mA', '/contactors/breaking_current_max_mA', 'breaking_current_max_mA'),
 ('config_key', '/faults/*', 'the new fault ids', 'keys are named after the fault id'),
 ('json_key', 'asked_mA, asked_mV', 'requested_mA, requested_mV', 'status, charger'),
 ('json_key', 'asks_for_charge, asks_for_full_charge', 'requests_charge, requests_full_charge', 'status, inverter'),
 ('json_key', 'energy_left_mWh, energy_left_sigma_mWh, energy_left_load_mA', 'remaining_energy_mWh, remaining_energy_sigma_mWh, remaining_energy_load_mA', 'columns of the history, too'),
 ('json_key', 'goes_on_when_heard', 'resumes_on_receive', ''),
 ('json_key', 'heard_ago_ms', 'received_ago_ms', ''),
 ('json_key', 'is_held', 'is_current_held', 'check'),
 ('json_key', 'link_time_constant_ms', 'dc_link_time_constant_ms', 'state file, too'),
 ('other', 'asks_about', 'requests_cell', 'scenario property'),
 ('recording_word', 'air', 'intake-air', 'observation of the recording'),
 ('recording_word', 'pulses, claim', '(keep)', ''),
]
FILES = [('daemon/core/cell_question', 'cell_query'), ('daemon/core/charger_watch', 'charger_monitor'), ('daemon/core/inverter_watch', 'inverter_monitor'), ('daemon/core/likely_cause', 'configuration_cause'), ('daemon/core/link_decay', 'dc_link_decay'),
         ('daemon/core/link_rise', 'dc_link_rise'), ('daemon/core/system_answers', 'system_replies'), ('daemon/core/cell_answers', 'cell_replies'), ('daemon/shell/driven_lines', 'gpio_outputs'), ('config/bus_guests', 'shared_bus_devices'),
         ('config/foreign_module_checks', 'other_module_checks'), ('daemon/shell/foreign_modules_json', 'other_modules_json'), ('mmu/foreign_sensor', 'other_sensor'), ('tests/support/told_core', 'reported_core'), ('tests/support/line_values', 'gpio_values'),
         ('tests/support/soc_watch', 'soc_monitor'), ('docs/foreign-modules.md', 'other-modules.md'), ('docs/decisions/0020-what-other-makers-say.md', '0020-other-manufacturers.md'), ('docs/decisions/0027-who-commands-the-pack.md', '0027-master-claim.md'),
         ('docs/decisions/0028-what-front-ends-and-alarm-outputs-report.md', '0028-front-end-and-alarm-reports.md'), ('tests/rig/service_lines.sh', 'service_gpio.sh'), ('tests/docs/check_device_places.py', 'check_device_positions.py'), ('tests/fuzz/guests.cpp', 'shared_bus_devices.cpp'), ('tests/fuzz/driven_lines.cpp', 'gpio_outputs.cpp')]
COMP = dict(told='reported', tell='report', tells='reports', says='reports', say='report', said='sent', heard='received', hear='receive', hears='receives', believed='confirmed', believe='confirm', doubt='uncertainty', doubted='pending', doubtful='implausible',
            suspect='implausible', suspected='pending', suspicion='pending', anew='again', wish='request', wishes='requests', life='session', lives='sessions', former='restored', stranger='unknown_module', strangers='unknown_modules', nobody='none', somebody='other', whoever='other',
            obey='follow', obeys='follows', obeying='following', disobeys='mismatch', memo='cache', memos='caches', book='tracker', moment='instant', teller='log', turn='cycle', turns='cycles', picture='sample_set', pictures='sample_sets', pictured='sampled', link='dc_link', links='dc_links',
            rest='remainder', rests='remainders', image='snapshot', memory='persistent', place='position', placed='positioned', places='positions', line='gpio', lines='gpio', ask='poll', asks='polls', asked='requested', asking='requesting', wants='requests', want='request', wanted='expected', alone='single', vain='expired',
            patience='timeout', hopeless='ineffective', look='check', looks='checks', looked='checked', least='min', most='max', tries='attempts', surprise='innovation', ledger='counter', legacy='carry_over', late='polarisation', aside='quarantine', misfit='mismatch', begun='started', began='started', begin='start',
            spoken='detected', speak='answer', speaks='answers', listen='receive', listens='receives', listening='receiving', lasted='duration', hold='hold', held='held', trouble='fault', left='remaining', foreign='other', guest='shared_bus_device', guests='shared_bus_devices', seen='observed', sees='observes', see='observe', follow='update',
            follows='updates', word='keyword', words='keywords', step='step', pair='rc', pairs='rc', memories='persistent')
CANF = re.compile(r'(link_details|link_keeper|link_watch|link_system|rate_watch)')
mv = {o: n for o, n, l, w in moved}
out = []
def auto(w, D):
    if w in H: return H[w]
    if w in mv and 'told' not in N.comp(w) and 'passed' not in N.comp(w) and 'try' not in N.comp(w) and 'pair' not in N.comp(w) and 'pairs' not in N.comp(w): return (mv[w], 'by the rule of 2.2')
    fs = ' '.join(d[0] for d in D)
    def one(p):
        c = p.lower()
        if c in ('link', 'links') and CANF.search(fs): r = 'can_interface'
        elif c == 'rest' and re.search(r'rest_mode|sleep', fs): r = 'sleep'
        elif c in ('rest', 'step', 'word', 'words', 'held', 'hold', 'line', 'lines', 'memory') and not re.search(r'gpio|line_feeder|driven', fs): return None
        elif c == 'told' and re.search(r'balanc|bleed|module_setup|sensor_setup|charger', fs): r = 'commanded'
        elif c == 'told' and re.search(r'soc|estimat', fs): r = 'published'
        elif c == 'told' and re.search(r'tools/bmucell', fs): r = 'estimated'
        elif c == 'late' and not re.search(r'estimat|cell_model|cell_dynamics|plant', fs): return None
        elif c in COMP: r = COMP[c]
        else: return p
        return r
    parts = re.findall(r'[A-Z][a-z0-9]*|[a-z0-9]+|[A-Z]+|_', w)
    res, note = [], ''
    for p in parts:
        if p == '_': res.append(p); continue
        if p.lower() in N.BAN:
            r = one(p)
            if r is None: res.append(p); note = 'homonym "%s": decide by reading' % p.lower(); continue
            res.append(''.join(x.title() for x in r.split('_')) if p[0].isupper() else r)
        else: res.append(p)
    return (''.join(res), note or 'by word')
n = collections.Counter()
ORDER = {'product': 0, 'local': 2, 'test': 1, 'testlocal': 3}
rows = []
for w, D in N.T.items():
    if w in N.done: continue
    b = [p for p in N.comp(w) if p in N.BAN]
    if not b: continue
    if all(d[2] == '' and d[1] == 'prototype' and re.search(r'TEST', w) for d in D): continue
    nl = [d for d in D if d[1] not in ('local', 'parameter')]
    prod = [d for d in nl if not d[0].startswith('tests/')]
    kind = 'product' if prod else ('test' if nl else ('local' if any(not d[0].startswith('tests/') for d in D) else 'testlocal'))
    since = 'new' if w not in N.TO else 'unlisted'
    core = bool([p for p in b if p in N.CORE])
    new, note = auto(w, D)
    if new == w and not core: continue
    if kind in ('testlocal',) and not core: continue
    if new == w and 'homonym' in note: note += ' (may stay)'
    d = (prod or nl or D)[0]
    k = 'type' if re.match('[A-Z][a-z]', w) else 'identifier'
    rows.append((since, ORDER[kind], kind, k, w, new, ','.join(b), (d[2] + ' ' if d[2] else '') + d[0], sum(sum(v) for v in idx.get(w, {}).values()), note))
    n[(since, kind)] += 1
rows.sort(key=lambda r: (r[0] != 'new', r[1], r[7], r[4]))
with open('new_names.tsv', 'w') as f:
    f.write('# since: new = after the glossary (96c85a8); unlisted = older, but in no table of the glossary\n# since\twhere\tkind\tname\tproposal\tbanned\tdeclared in\toccurrences\tnote\n')
    for k, a, b, note in IDS:
        f.write('\t'.join(['new', 'product', k, a, b, '', '', str(sum(sum(sum(v) for v in idx.get(x.strip().split('/')[-1], {}).values()) for x in a.split(','))), note]) + '\n')
    for a, b in FILES: f.write('\t'.join(['new', 'product', 'file', a, b, '', '', '', '']) + '\n')
    for r in rows: f.write('\t'.join(str(x) for x in (r[0], r[2], r[3], r[4], r[5], r[6], r[7], r[8], r[9])) + '\n')
print(len(rows) + len(IDS) + len(FILES), dict(n))
# ---- texts
import lexcxx
B = re.compile(r"\b(told|tells?|says?|said|nobody|somebody|anybody|whoever|anew|strangers?|wish(?:es)?|former|life|lives|believed|hears?|heard|wanted|asked|asks)\b")
def lits(root):
    res = {}
    for d, ds, fs in os.walk(root):
        rel = os.path.relpath(d, root)
        if rel.startswith(('tests', '.git', 'build')): continue
        for f in fs:
            if not f.endswith(lexcxx.CXX): continue
            t = open(os.path.join(d, f), errors='replace').read(); cur = None; last = 0
            for m in lexcxx.TOKEN.finditer(t):
                if lexcxx.kind_of(m) != 'string': continue
                b = m.group(0); b = b[b.index('"') + 1:-1]
                if cur and not t[last:m.start()].strip(): cur[0] += b
                else:
                    if cur: res.setdefault(cur[0], cur[1])
                    cur = [b, os.path.join(rel, f) + ':%d' % (t.count('\n', 0, m.start()) + 1)]
                last = m.end()
            if cur: res.setdefault(cur[0], cur[1])
    return res
if os.path.isdir(OLD := '/tmp/old'):
    a, b = lits(OLD), lits('tree')
    prop = dict(l.rstrip('\n').split(' | ', 1) for l in open('lib/new_texts.txt') if ' | ' in l)
    gl = open('texts.tsv').read()
    with open('new_names.tsv', 'a') as f:
        k = [0, 0, 0]
        for s in sorted(b, key=lambda s: b[s]):
            if not B.search(s) or ' ' not in s: continue
            since = 'unlisted' if s in a else 'new'
            if since == 'unlisted' and s.strip()[:40] in gl: continue
            p = prop.get(b[s], '') if since == 'new' else ''
            k[0 if since == 'new' else 1] += 1; k[2] += bool(p)
            f.write('\t'.join([since, 'product', 'text', s.replace('\t', ' '), p, ','.join(sorted(set(B.findall(s)))), b[s], '1', '' if p else 'to be rewritten by rules 3 to 9']) + '\n')
        print('texts: new %d, older and not in the glossary %d, with a proposal %d' % tuple(k))
