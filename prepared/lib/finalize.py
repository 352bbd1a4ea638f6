import pickle, re, os, sys, collections, subprocess
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import tags, index
ROOT, OUT = 'tree', 'the checkout'
out, gone = pickle.load(open('/tmp/classified.pkl', 'rb'))
idx, strs = pickle.load(open('/tmp/idx.pkl', 'rb'))
T = tags.load(ROOT)
DROP = {'create_hard_link', 'can_link_type', 'in_doubt', 'is_in_doubt_', 'precharge_tries', 'Least', 'most_of', 'most_of_a_processor', 'precharge_min_least', 'told_most_per_s', 'echoed_link', 'is_link', 'LinkDecay', 'link_decay_that_would_do',
        'jump_doubt', 'lost_doubt', 'put_most_rejected', 'tries_alone_', 'wrong_most', 'pack_with_tries', 'link_budget', 'lost_doubt'}
FIX = {'precharge_tries': 'precharge_attempts_max', 'in_doubt': 'is_uncertain', 'is_in_doubt_': 'is_uncertain_', 'precharge_min_least': 'precharge_min_lower_bound', 'told_most_per_s': 'published_change_max_per_s', 'LinkDecay': 'DcLinkDecay',
       'link_decay_that_would_do': 'suggested_dc_link_discharge_time', 'Least': 'Minimum', 'jump_doubt': 'jump_uncertainty', 'lost_doubt': 'lost_uncertainty', 'put_most_rejected': 'put_max_rejected', 'tries_alone_': 'single_attempts_', 'pack_with_tries': 'pack_with_attempts',
       'create_hard_link': '(POSIX link(): stays)', 'can_link_type': 'can_interface_type', 'echoed_link': 'echoed_dc_link', 'link_budget': 'dc_link_budget', 'wrong_most': 'wrong_max', 'most_of_a_processor': 'processor_share_max', 'most_of': 'largest_of', 'is_link': 'is_can_interface'}
SCOPES = {'json_key': 'daemon/shell/,daemon/history/,tools/,tests/,docs/,vcan-fixtures/', 'json_value': 'daemon/,config/,protocol/,tools/,tests/,docs/', 'config_key': 'config/,daemon/,tests/,tools/,docs/,packaging/,vcan-fixtures/,systemd/',
          'option': '*', 'state_key': 'daemon/shell/state,tests/,docs/', 'recording_word': 'daemon/recording/,tools/bmureplay/,tools/report/,tests/,docs/recording.md', 'history_column': 'daemon/history/,tools/,tests/,docs/', 'can_signal': '*'}
GENERIC_KEYS = {'after_ms', 'pause_ms', 'limit_mV', 'limit_dC', 'limit_mA', 'pair_mOhm', 'cell_resistance', 'pack_resistance', 'frames_lost', 'link_voltage_mV', 'memory_bytes', 'not_set_up', 'set_up'}
SAME = {'is_present': 'core_decide.cpp has a local is_confirmed: look for shadowing', 'sense': 'fault_table.hpp has a parameter direction', 'pack_mV': '12 files have pack_voltage_mV already: not in one function', 'is_kept': 'oracle.cpp has a parameter is_valid', 'because': 'pack_checks.cpp has a local reason', 'began_at': 'Core has a function started_at already', 'goes_on': 'what_if.cpp'}
NARROW = {'sense': 'daemon/,tests/unit/fault,tests/unit/permission_test.', 'bounds': 'daemon/core/answer_times.,daemon/shell/modules_json.,tests/unit/answer', 'dead': 'daemon/core/balancing_switches.,daemon/shell/,tests/unit/balancing', 'learn': 'daemon/core/estimators/soc_filter.',
          'fade': 'daemon/core/estimators/soc_filter.', 'pairs': '*,-config/cell_file_writer.,-daemon/core/estimators/capacity_estimate.,-daemon/core/estimators/cell_health.,-tests/catalogue/,-tests/unit/capacity_estimate_test.,-tests/unit/config_docs_test.,-tools/bmudump/,-tools/bmucell/health.',
          'skipped': '*,-daemon/history/,-daemon/shell/,-tools/bmudump/', 'chosen': 'tools/bmuctl/,tests/unit/history_text_test.', 'twice': 'daemon/core/', 'lives': 'daemon/history/,tools/', 'joins': 'tools/bmureplay/,tests/unit/replay', 'judged': '*,-tests/unit/current_ramp', 'lasted': 'daemon/shell/,tests/unit/drive',
          'fallback': 'config/', 'alteration': '*,-tests/fuzz/',
          'is_doubtful': '*,-tools/', 'is_about': '*,-daemon/recording/,-mmu/', 'seen_at': '*,-tools/mmusim/', 'next_turn_': 'daemon/core/', 'parts_max': '*,-mmu/,-tests/unit/mmu', 'note_told': '*,-tests/simulation/', 'has_passed': '*,-tools/bmudump/',
          'is_told': '*,-mmu/,-tests/support/can_bus.', 'doubt_of': 'daemon/core/estimators/capacity_estimate.,tests/unit/capacity_estimate_test.', 'make_room': '*,-daemon/shell/record_queue.,-daemon/shell/record_feed.,-tests/unit/record_feed_test.', 'is_whole': 'daemon/history/,tests/unit/history',
          'look_at_modules': 'daemon/history/', 'is_quiet': 'mmu/,tests/unit/mmu', 'take_due': 'mmu/,tools/mmusim/,tests/support/mmu_bench', 'wake_sleepers': 'mmu/', 'without_row': 'tools/', 'place_text': 'daemon/,tests/unit/', 'is_alone': 'mmu/,tests/unit/mmu', 'go_on': 'tools/report/',
          'goes_on': '*,-tests/unit/charge_resume_test.,-daemon/recording/what_if.'}
HANDS = {'set_node': 'ModuleSetup::set_node', 'stop_balancing': 'ModuleSetup::stop_balancing', 'clear_faults': 'ModuleSetup::clear_faults', 'has_run': 'AuxiliaryConfig, Auxiliary::Runner::has_run', 'is_kept': 'SocRecord::is_kept', 'is_stuck': 'ModuleWireFaults::is_stuck', 'is_wanted': 'PaceInputs::is_wanted', 'is_on_bus': 'CommandLink::is_on_bus', 'begin_part': 'begin_part'}
rows = []; moved = []
seen = set()
for x in out:
    k, o, n, sc = x['kind'], x['old'], x['new'], x['scope']
    derived = 'follows from' in x['why'] or 'CAN interface, not' in x['why']
    if derived and (x['status'] == 'conflict' or o in DROP or o in FIX):
        moved.append((o, FIX.get(o, n), x['line'], x['why'])); continue
    st, why = x['status'], x['why']
    base = o.split('::')[-1]
    if k in ('fault_id', 'event_id'):
        enum = 'FaultId' if k == 'fault_id' else 'EventId'
        others = sorted({(d[2] + '::' if d[2] else '') + o + ' ' + d[0] for d in T.get(o, []) if not d[0].startswith('tests/') and d[2] != enum and d[1] not in ('local', 'parameter')})
        newd = sorted({(d[2] + '::' if d[2] else '') + n + ' ' + d[0] for d in T.get(n, []) if d[1] not in ('local', 'parameter')})
        if others: why = 'only %s::%s and texts; other names: %s' % (enum, o, '; '.join(others[:4]))
        if newd: why += ('; ' if why else '') + 'new name exists: ' + '; '.join(newd[:3])
        sc = '*'
    elif k in SCOPES:
        ctx = sc if sc != '*' and '/' not in sc else ''
        if k == 'option':
            ctx = sc
            sc = {'bmud': 'daemon/,tests/,docs/,packaging/,systemd/,tools/', 'bmuctl': 'tools/bmuctl/,tests/,docs/', 'bmudump': 'tools/bmudump/,tests/,docs/', 'bmureplay': 'tools/bmureplay/,tests/,docs/', 'mmusim': 'tools/mmusim/,tests/,docs/'}.get(ctx.split()[0], 'tools/bmucell/,tools/accuracy/,tests/,docs/' if ctx.startswith('bmucell') else '*')
        else: sc = SCOPES[k]
        if ctx: why = 'in: ' + ctx + ('; ' + why if why else '')
        simple = re.fullmatch(r'[a-z]+', o)
        if k in ('json_key', 'config_key', 'history_column', 'state_key', 'recording_word') and (simple or o in GENERIC_KEYS) or k == 'json_value':
            st = 'conflict'; why = ('everyday word as a string: by context' if simple or k == 'json_value' else 'the same word means something else in other places') + ('; ' + why if why else '')
        if re.search(r'[^\w/-]', o) and k != 'json_value' or o.endswith('_'): st = 'conflict'; why += '; not one word'
        if k == 'config_key' and '/' in o: pass
    if k == 'option' and o == '--file': st = 'conflict'; why = 'other programs of the tests have a --file, too; ' + why
    if k == 'other' and o in ('stranger', 'link', 'talking', 'obeys', 'master'): st = 'conflict'; why = 'word of scenario scripts; ' + why; sc = 'mmu/,tests/,vcan-fixtures/,docs/'
    if k == 'file': sc = x['scope']
    if k == 'identifier' and o == 'is_order': sc = '*,-daemon/core/core.'; why = 'core.cpp has a local is_command already: there is_charger_command'
    if k == 'identifier' and o in NARROW: sc = NARROW[o]; why = 'narrowed: ' + why
    if k == 'type' and o == 'Slot': sc = 'daemon/core/balancing_control.,daemon/core/balancing_switches.'; why = 'ModuleSetup::Slot and RequestCheck::Slot stay'
    if k == 'identifier' and o in HANDS and o != 'begin_part': st = 'conflict'; why = 'only ' + HANDS[o] + '; ' + why
    if k in ('identifier', 'type') and o in SAME and sc == '*': why = (why + '; ' if why else '') + SAME[o]
    if k in SCOPES and sc == '*' and any(y['kind'] == k and y['old'].split(' ')[-1] == o and y is not x and y['scope'] != '*' for y in out): continue
    key = (k, sc, o, n)
    if key in seen: continue
    seen.add(key)
    rows.append((k, sc, o, n, ','.join(str(i) for i in sorted(set(x['lines'])))if 'lines' in x else str(x['line']), x['n'], 'mechanical' if st == 'mechanical' else 'hand', why))
# names that ctags does not see
for sc, o, n, line, st, why in [
    ('daemon/recording/,tools/,tests/unit/', 'ReplayOptions::differs', 'on_difference', '493', 'hand', 'member'),
    ('daemon/recording/,tools/,tests/unit/', 'ReplayOptions/WhatIfOptions::altered', 'on_modification', '491,493', 'hand', 'member; line 491 says modified, line 493 on_modification: they are callbacks, so on_modification'),
    ('daemon/recording/,tools/,tests/unit/', 'WhatIfOptions::moves', 'on_difference', '496', 'hand', 'member'),
    ('*', 'take_named_fields', 'visit_named_fields', '545', 'mechanical', 'in the macro BMU_FIELDS'),
    ('daemon/shell/status_requests.', 'still_present', 'still_confirmed', '225', 'mechanical', 'parameter; the JSON key has a row of its own'),
    ('daemon/shell/modules_json.', 'strangers', 'unknown_modules', '281', 'mechanical', 'local; the JSON key has a row of its own')]:
    w = o.split('::')[-1]
    rows.append(('identifier', sc, o, n, line, sum(sum(v) for f, v in idx.get(w, {}).items() if sc == '*' or f.startswith(tuple(sc.split(',')))), st, why))
GUESS = {'RefusedResult': 'renamed already (refused_values.hpp: rows of its own)', 'CsvWish': 'removed: csv_file.hpp was taken apart into csv_table and csv_text; the spec of a table has another type now',
         'needed': 'went with CsvWish', 'always': 'went with CsvWish'}
gone = [(l, k, o, n, GUESS.get(o, w)) for l, k, o, n, w in gone if o not in ('altered', 'differs', 'moves', 'take_named_fields', 'still_present', 'strangers')] + [(579, 'identifier', 'needed', 'required', GUESS['needed']), (579, 'identifier', 'always', 'never_empty', GUESS['always']), (579, 'type', 'Wrong', 'CsvError', 'went with CsvWish')]
rows = [r for r in rows if not (r[4] == '579' and r[2].split('::')[-1] in ('needed', 'always', 'Wrong'))]
ORDER = 'type identifier file fault_id event_id json_key json_value config_key option state_key recording_word history_column can_signal test_tag other'.split()
# enumerator rows without a fixed owner: keep only the row whose owner is right
rows.sort(key=lambda r: (ORDER.index(r[0]), int(r[4].split(',')[0])))
# two mechanical rows must not give one old name two new ones in the same scope
by = collections.defaultdict(set)
for r in rows:
    if r[6] == 'mechanical' and r[0] in ('type', 'identifier'): by[(r[1], r[2])].add(r[3])
rows = [(r[:6] + ('hand', 'several new names in the glossary: ' + ', '.join(sorted(by[(r[1], r[2])])) + '; ' + r[7])) if r[6] == 'mechanical' and len(by.get((r[1], r[2]), ())) > 1 else r for r in rows]
# two old names that become one in the same class
into = collections.defaultdict(set)
for r in rows:
    if r[0] in ('type',) and r[6] == 'mechanical': into[r[3]].add(r[2])
with open(OUT + '/renames.tsv', 'w') as f:
    f.write('# kind\tscope\told\tnew\tglossary_line\toccurrences\tstatus\tnote\n')
    f.write('# scope: path prefixes, comma-separated; * all; -PREFIX all but this. old as Owner::name: an enumerator, renamed inside its enum and where it is qualified.\n')
    for r in rows: f.write('\t'.join(str(c).replace('\t', ' ') for c in r) + '\n')
with open(OUT + '/gone.tsv', 'w') as f:
    f.write('# kind\told\tnew\tglossary_line\tguess\n')
    for (line, k, o, n, why) in gone: f.write('\t'.join([k, o, n, str(line), why]) + '\n')
pickle.dump(moved, open('/tmp/moved.pkl', 'wb'))
c = collections.Counter((r[0], r[6]) for r in rows)
for k in sorted(c): print(k, c[k])
print(len(rows), sum(1 for r in rows if r[6] == 'mechanical'), 'merges', {k: v for k, v in into.items() if len(v) > 1})
