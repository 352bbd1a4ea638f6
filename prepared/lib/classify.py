"""glossary.md + a checkout -> renames.tsv, gone.tsv, conflicts.tsv (machine part of conflicts.md)."""
import sys, re, os, pickle, collections, subprocess
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import glossary, tags, index
ROOT, OUT = sys.argv[1], sys.argv[2]
idx, strs = index.build(ROOT)
T = tags.load(ROOT)
FILES = subprocess.run(['git', '-C', ROOT, 'ls-files'], capture_output=True, text=True).stdout.split('\n')
BASE = collections.defaultdict(list)
for f in FILES: BASE[os.path.basename(f)].append(f)
FOLD = {'2.3': ['daemon/core/'], '2.4': ['daemon/core/'], '2.5': ['daemon/shell/', 'daemon/history/', 'config/'], '2.6': ['daemon/history/', 'daemon/shell/'], '2.7': ['daemon/recording/'],
        '2.8': ['config/'], '2.9': ['mmu/', 'tools/mmusim/', 'protocol/tables/'], '2.10': ['protocol/', 'daemon/core/'], '2.11': ['tools/', 'daemon/'], '2.2': [''], '2.13': [''], '3.1': ['daemon/core/'],
        '3.2': ['daemon/core/'], '3.4': ['daemon/core/'], '3.5': ['daemon/core/', 'daemon/shell/', 'protocol/', 'config/'], '4.1': [''], '2.14': ['']}
R213 = [('daemon/core/estimators', 'daemon/core/'), ('daemon/core', 'daemon/core/'), ('daemon/history', 'daemon/history/'), ('daemon/recording', 'daemon/recording/'), ('daemon/shell', 'daemon/shell/'),
        ('bmuctl', 'tools/'), ('bmudump', 'tools/'), ('mmu', 'mmu/'), ('protocol', 'protocol/'), ('config', 'config/')]
STD = set('begin end at count size data find erase insert first second left right min max get set pass order lock latch take now then word_ alive what call who close open state mode name text line flush read write front back value key move swap'.split())
ENUMS = collections.defaultdict(list)   # enumerator -> [(enum, file)]
for w, ds in T.items():
    for (f, k, s, n) in ds:
        if k == 'enumerator': ENUMS[w].append((s, f))
def camel(w): return bool(re.match(r'[A-Z][a-z0-9]', w))
def simple(w): return '_' not in w.strip('_') and not camel(w)
def occ(w, scope='*'):
    d = idx.get(w, {})
    if scope == '*': return sum(sum(v) for v in d.values())
    ps = [p for p in scope.split(',') if not p.startswith('-')]; no = [p[1:] for p in scope.split(',') if p.startswith('-')]
    if '*' in ps: return sum(sum(v) for f, v in d.items() if not any(f.startswith(p) for p in no))
    return sum(sum(v) for f, v in d.items() if any(f == p or f.startswith(p if p.endswith('/') else p + '/') or (p.endswith('.') and f.startswith(p)) for p in ps))
def code(w): return sum(v[0] for v in idx.get(w, {}).values())
def grep(s, word=False):
    p = subprocess.run(['git', '-C', ROOT, 'grep', '-I', '-F', '-o', '-h'] + (['-w'] if word else []) + ['-e', s, '--', '.', ':!tests/fuzz/corpora'], capture_output=True, text=True)
    return p.stdout.count('\n')
PATTERN = {182, 187, 192, 194, 195, 202, 204, 205, 206, 207, 208, 209, 210, 211}
rows = [r for r in glossary.read() if not (r['num'] == '2.2' and r['line'] in PATTERN and r['old'] not in ('hour_current_A',))]
out, gone, conf = [], [], []
def emit(kind, scope, old, new, line, n, status='mechanical', why=''):
    out.append(dict(kind=kind, scope=scope, old=old, new=new, line=line, n=n, status=status, why=why))
# every new name that a word gets
NEWS = collections.defaultdict(set)
for r in rows: NEWS[r['old']].add(r['new'])
SEC214 = {'Pack file': 'config_key', 'Cell file': 'config_key', 'Command line': 'option', 'Status socket': 'json_key'}
KIND_LAST = {'state file': 'state_key', 'history database': 'history_column', 'recording': 'recording_word', 'CAN signals': 'can_signal', 'scenarios': 'other'}
OWN = [(246,246,['Blocker']),(245,245,['Permission','OpeningRecord','RefusalRecord','PermissionInputs']),(282,282,['AcceptRefusal']),(285,285,['AssignmentRefusal']),(948,972,['Blocker']),
       (1024,1046,['BalancingBlocker']),(1047,1049,['PlanVerdict']),(1050,1057,['FormerBook']),(1058,1079,['LimitCause']),(1080,1090,['AssignmentRefusal']),(309,313,['LimitCause']),(322,324,['BalancingBlocker']),
       (204,204,[]),(206,208,[]),(579,579,['CsvWish','CsvColumn']),(588,588,['Outcome']),(593,593,['RecordingReport']),(576,576,['LineReader']),(284,284,['AssignmentStage','ModuleAssignment']),
       (1091,1100,['ModulePlace']),(494,494,['ModuleAnswers::Node','ModuleAnswers']),(502,502,['ConfigProblem','(anon)'])]
def own_of(line, word):
    for a, b, names in OWN:
        if a <= line <= b: return names
    return None
last_hint = []
for r in rows:
    o, n, num, line = r['old'], r['new'], r['num'], r['line']
    hints = [h for h in re.findall(r'`([^`]+\.[ch]pp)`', r['now'])]
    pre = r['pre']
    before = r['before']
    # the word that stands before, and stays in force for the following pairs
    mode = ''
    seg = re.split(r'`[^`]*`', before)
    for s in seg:
        if 'JSON and CLI' in s: mode = 'json_key'
        elif 'JSON value' in s: mode = 'json_value'
        elif 'JSON' in s: mode = 'json_key'
        elif re.search(r'recording word', s): mode = 'recording_word'
        elif re.search(r'(scenario (property|target)|; words|^words|charger property|target|property)\s*$', s) and num in ('2.9', '2.14'): mode = 'scenario'
        elif num == '2.7' and line == 485: mode = 'recording_word'
        elif re.search(r'section\s*$', s): mode = 'config_key'
        elif re.search(r'table and column|member and column|columns?\s*$|table\s*$', s) and num in ('2.6', '2.14'): mode = 'history_column'
        elif re.search(r'values?\s*$', s): mode = 'json_value'
        elif re.search(r'`$', s): pass
        if num in ('2.14',) and re.search(r';\s*$', s) and mode in ('json_value',): mode = ''
    if o in ('ages_at', 'ages_now', 'to_core'): mode = ''
    # ---- kinds that are not C++ names
    if num == '2.14':
        k = next((v for a, v in SEC214.items() if r['sub'].startswith(a)), None) or KIND_LAST.get(r['first'].split(' (')[0]) or ('json_key' if r['first'].startswith('replay') else 'other')
        if mode == 'json_value' and k == 'json_key': k = 'json_value'
        if k == 'option':
            o2 = re.sub(r'^modules assign |^history ', '', o)
            emit('option', {'bmud': 'bmud', 'bmuctl': 'bmuctl'}.get(r['first'], r['first']), o2, n, line, grep(o2)); continue
        if k == 'config_key':
            o2, n2 = o.lstrip('/'), n.lstrip('/')
            emit(k, ('pack:' if r['sub'].startswith('Pack') else 'cell:') + r['first'], o2, n2, line, strs.get(o2) and sum(strs[o2].values()) or 0 if not re.fullmatch(r'\w+', o2) else occ(o2)); continue
        n_exact = sum(strs.get(o, {}).values())
        emit(k, r['first'], o, n, line, n_exact if k in ('json_value', 'recording_word') or not re.fullmatch(r'\w+', o) else occ(o)); continue
    if num == '3.1':
        if r['col'] == 0: emit('event_id', '*', o, n, line, occ(o)); continue
    if num == '3.2':
        emit('fault_id', '*', o, n, line, occ(o)); continue
    if num == '4.1':
        emit('file', '*', o, n, line, grep(o)); continue
    if re.search(r'\.(hpp|cpp|md)$', o) or o.startswith('docs/') or o.startswith('tests/'):
        b = os.path.basename(o)
        hit = BASE.get(b) or [f for f in FILES if f.startswith(o)]
        if not hit: gone.append((line, 'file', o, n, 'no file of this name'))
        for f in (hit[:1] if o.startswith('docs/pictures') else hit):
            emit('file', os.path.dirname(f), b if not o.startswith('docs/pictures') else o, n, line, grep(b))
        continue
    if o.startswith('--'): emit('option', '*', o, n, line, grep(o)); continue
    if mode == 'json_value' or (mode == 'json_key' and not re.fullmatch(r'\w+', o)):
        emit('json_value', '*', o, n, line, sum(strs.get(o, {}).values())); continue
    if mode in ('json_key', 'config_key', 'recording_word'):
        emit(mode, '*', o, n, line, sum(strs.get(o, {}).values())); continue
    if mode == 'history_column' and num == '2.6' and r['pre'] != 'member and column':
        emit('history_column', 'daemon/history/', o, n, line, occ(o, 'daemon/history/')); continue
    if mode == 'scenario':
        emit('other', 'scenario word', o, n, line, sum(strs.get(o, {}).values())); continue
    if num == '2.10' and not re.fullmatch(r'[\w:]+', o):
        emit('json_value', '*', o, n, line, sum(strs.get(o, {}).values())); continue
    # ---- C++ names
    owner = None
    word = o
    if '::' in o:
        owner, word = o.rsplit('::', 1); new = n.rsplit('::', 1)[-1]
    else: new = n.rsplit('::', 1)[-1]
    folds = FOLD.get(num, [''])
    if num == '2.13':
        for a, b in R213:
            if r['first'].lstrip('`').startswith('`' + a) or ('`' + a + '`') in r['first'] or re.search(r'\b' + re.escape(a) + r'\b', r['first']): folds = [b]; break
        if r['first'].startswith('all:'): folds = ['']
    if num == '2.4': folds = ['daemon/core/estimators/', 'daemon/core/']
    D = T.get(word, [])
    decl = [d for d in D if d[1] not in ('local', 'parameter')]
    prod = [d for d in decl if not d[0].startswith('tests/')]
    inf = [d for d in prod if any(d[0].startswith(f) for f in folds)]
    if not idx.get(word):
        gone.append((line, 'type' if camel(word) else 'identifier', o, n, 'word does not occur any more')); continue
    if not code(word):
        emit('other', '*', o, n, line, occ(word), 'conflict', 'only in strings, comments or pages: decide by hand'); continue
    kind = 'type' if camel(word) else 'identifier'
    stems = [os.path.splitext(os.path.basename(h))[0] for h in hints]
    if owner:
        cand = [d for d in decl if d[2] == owner or d[2].endswith('::' + owner)]
    else:
        cand = [d for d in inf if os.path.splitext(os.path.basename(d[0]))[0] in stems] or inf
    if camel(word) and not owner:
        ty = [d for d in cand if d[1] in ('class', 'struct', 'enum', 'union', 'typedef', 'alias')]
        if ty: cand = ty
    ov = own_of(line, word)
    if not owner and cand:
        pick = [d for d in cand if ov and any(d[2].split('::')[-1] == x.split('::')[-1] for x in ov)]
        if not pick and len({d[2] for d in cand}) > 1:
            txt = r['first'] + ' ' + r['now'] + ' ' + r['cell']
            pick = [d for d in cand if d[2] and re.search(r'\b' + re.escape(d[2].split('::')[-1]) + r'\b', txt)]
        if pick: cand = pick
    if not cand and not simple(word):
        p2 = [d for d in prod]
        if len({d[2] for d in p2}) == 1 or (p2 and len(NEWS[o]) == 1): cand = p2
    if not cand:
        locs = [d for d in D if d[1] in ('local', 'parameter') and any(d[0].startswith(f) for f in folds)]
        if not locs:
            where = sorted({d[0] for d in D})[:4]
            gone.append((line, kind, o, n, ('no declaration in ' + ' or '.join(folds)) + '; the word is left in ' + (', '.join(where) or 'other forms'))); continue
        if simple(word):
            emit(kind, ','.join(sorted({d[0] for d in locs})), word, new, line, code(word), 'conflict', 'local names or parameters only, an everyday word'); continue
        emit(kind, '*', word, new, line, occ(word), 'mechanical', 'locals or parameters'); continue
    owners = {(d[2], os.path.splitext(d[0])[0]) if d[1] != 'enumerator' else (d[2], '') for d in cand}
    own_names = {d[2] for d in cand}
    other = [d for d in prod if d[2] not in own_names and d not in cand]
    TYPES = ('class', 'struct', 'enum', 'union', 'typedef', 'alias', 'enumerator')
    if camel(word): other = [d for d in other if d[1] in ('class', 'struct', 'enum', 'union', 'enumerator')]
    testother = [d for d in decl if d[0].startswith('tests/') and d[2] not in own_names and d[1] != 'variable' and (not camel(word) or d[1] in TYPES)]
    clash_owner = [d for d in T.get(new, []) if d[1] not in ('local', 'parameter') and d[2] in own_names and d[2]]
    clash_global = [d for d in T.get(new, []) if d[1] in ('class', 'struct', 'enum', 'typedef', 'alias') ] if camel(word) else []
    why = []
    status = 'mechanical'
    scope = '*'
    shown = word
    UNSCOPED = {'At', 'Slot', 'PollFlag', 'Part', 'Column'}
    if all(d[1] == 'enumerator' for d in cand) and not all(d[2].split('::')[-1] in UNSCOPED for d in cand):
        names = sorted(own_names)
        if not owner and len(names) > 1:
            # which enum does the row name?
            m = [x for x in names if re.search(r'\b' + re.escape(x.split('::')[-1]) + r'\b', r['cell'] + r['now'] + r['first'])]
            names = m or names
        if len(names) > 1:
            ok = None
            if len(NEWS[o]) == 1: ok = names
            if ok is None: status = 'conflict'; why.append('enumerator of several enums: ' + ', '.join(names))
        for nm in names:
            cl = [d for d in T.get(new, []) if d[1] == 'enumerator' and d[2] == nm]
            emit('identifier', '*', nm + '::' + word, new, line, code(word), 'conflict' if cl else status, '; '.join(why + (['%s::%s exists already' % (nm, new)] if cl else [])))
        continue
    if clash_owner: status = 'conflict'; why.append('new name exists in the same class: ' + ', '.join(sorted({d[2] + '::' + new + ' ' + d[0] for d in clash_owner})))
    if clash_global:
        status = 'conflict'; why.append('type %s exists already: %s' % (new, ', '.join(sorted({(d[2] + '::' if d[2] else '') + new + ' in ' + d[0] for d in clash_global})[:4])))
    if other or testother:
        otherf = sorted({(d[2] or 'free') + ' ' + d[0] for d in other + testother})
        ctor = all(d[1] in ('prototype', 'function') and (d[2] == word or d[2].endswith('::' + word)) or (d[1] in ('function', 'prototype') and d[2] == '') for d in other + testother)
        if camel(word) and ctor and len(NEWS[o]) == 1: pass
        elif len(NEWS[o]) > 1 or len(NEWS[owner + '::' + word if owner else o]) > 1 or simple(word) or (camel(word) and len(re.findall('[A-Z]', word)) == 1):
            # type nested in one source or header: scope by stem
            if camel(word):
                st = sorted({os.path.splitext(d[0])[0] + '.' for d in cand})
                ot = sorted({os.path.splitext(d[0])[0] + '.' for d in other + testother if d[1] != 'prototype' and not (d[1] == 'function' and d[2] == '')})
                heads = {d[0] for d in other + testother if d[0].endswith('.hpp')}
                mine = {d[0] for d in cand}
                for f2, v2 in idx.get(word, {}).items():
                    if not v2[0]: continue
                    t2 = open(os.path.join(ROOT, f2), errors='replace').read()
                    if any('"' + h2 + '"' in t2 for h2 in heads) and not any('"' + h2 + '"' in t2 for h2 in mine) and f2 not in mine: ot.append(f2)
                ot = sorted(set(ot))
                if len(NEWS[o]) > 1:
                    use = []
                    for f2, v2 in idx.get(word, {}).items():
                        if not v2[0] or any(f2.startswith(x) for x in st): continue
                        t2 = open(os.path.join(ROOT, f2), errors='replace').read()
                        if any('"' + h2 + '"' in t2 for h2 in mine) and not any('"' + h2 + '"' in t2 for h2 in heads): use.append(os.path.splitext(f2)[0] + '.')
                    scope = ','.join(st + sorted(set(use)))
                else: scope = ','.join(['*'] + ['-' + x for x in ot if x not in st])
                if not any(x in st for x in ot): why.append('other things of this name are left: ' + '; '.join(otherf[:3]))
                else: status = 'conflict'; why.append('homonym in the same file: ' + '; '.join(otherf[:4]))
            else:
                status = 'conflict'
                shown = '/'.join(sorted(x for x in own_names if x)[:3]) + '::' + word if any(own_names) else word
                scope = ','.join(sorted({os.path.splitext(d[0])[0] + '.' for d in cand}))
                why.append('homonym: also ' + '; '.join(otherf[:4]) + (' and %d more' % (len(otherf) - 4) if len(otherf) > 4 else ''))
        else:
            if word.endswith('_') and not r['first'].startswith('all'):
                scope = ','.join(sorted({os.path.splitext(d[0])[0] + '.' for d in cand})); why.append('private; the same name is left in: ' + '; '.join(otherf[:4]))
            else: why.append('renames these, too: ' + '; '.join(otherf[:4]))
    else:
        if simple(word) and not camel(word):
            loc = sorted({d[0] for d in D if d[1] in ('local', 'parameter')})
            if word.rstrip('_') in STD and not word.endswith('_'):
                status = 'conflict'; why.append('word of the standard library or an everyday word')
                scope = ','.join(sorted({os.path.splitext(d[0])[0] + '.' for d in cand})); shown = '/'.join(sorted(x for x in own_names if x)[:3]) + '::' + word if any(own_names) else word
            elif len(NEWS[o]) > 1:
                status = 'conflict'; why.append('several new names in the glossary: ' + ', '.join(sorted(NEWS[o])))
                scope = ','.join(sorted({os.path.splitext(d[0])[0] + '.' for d in cand})); shown = '/'.join(sorted(x for x in own_names if x)[:3]) + '::' + word if any(own_names) else word
            elif [f for f in loc if not any(f.startswith(os.path.splitext(d[0])[0]) for d in cand)]:
                why.append('locals of the same name in ' + ', '.join(loc[:4]))
        elif len(NEWS[o]) > 1:
            fs = {}
            why.append('several new names in the glossary: ' + ', '.join(sorted(NEWS[o])))
            if not camel(word): status = 'conflict'
            scope = ','.join(sorted({os.path.splitext(d[0])[0] + '.' for d in cand}))
    # an everyday word as a member whose token is also a plain word of code elsewhere (std::, json)
    s = sum(strs.get(word, {}).values())
    if s: why.append('is a string, too (%d)' % s)
    # new name already used by code in the files where the old one is
    fo = {f for f, v in idx.get(word, {}).items() if v[0]}; fn = {f for f, v in idx.get(new, {}).items() if v[0]}
    both = sorted(fo & fn)
    if both and not clash_owner: why.append('new name is used in %d of its files already (%s)' % (len(both), ', '.join(both[:2])))
    if both and len(both) * 3 > len(fo) and status == 'mechanical' and any(d[0] in both for d in T.get(new, []) ): why.append('look for shadowing')
    emit(kind, scope, shown, new, line, occ(word, scope), status, '; '.join(why))
for f, new in [('0002-where-the-protocol-was-silent.md', '0002-gaps-in-the-protocol.md'), ('0003-what-opens-and-what-rides-through.md', '0003-opening-criteria.md'),
               ('0008-the-masters-view-of-its-modules.md', '0008-module-identity-and-polling.md'), ('0011-the-packs-estimate.md', '0011-pack-estimate.md'), ('0016-who-may-do-what.md', '0016-access-rights.md'),
               ('0018-reload-is-a-new-life.md', '0018-reload-starts-a-new-session.md')]:
    emit('file', 'docs/decisions', f, new, 600, grep(f))
emit('file', 'docs/decisions', '0001-embedded-bus.md', '0001-local-bus.md', 601, grep('0001-embedded-bus.md'))
emit('file', 'tests/bench/latency', 'ear.hpp', 'listener.hpp', 603, grep('ear.hpp', True))
emit('file', 'docs', 'hardships.md', 'robustness.md', 602, grep('hardships.md'))

# ---- patterns of 2.2: every identifier with this component that no row names
done = {x['old'].split('::')[-1].split('/')[-1] for x in out if x['kind'] in ('identifier', 'type', 'fault_id', 'event_id')}
OWNERS = collections.defaultdict(set)
def parts(w):
    w2 = re.sub(r'([a-z0-9])([A-Z])', r'\1_\2', w)
    return [p.lower() for p in w2.split('_') if p]
def sub(w, a, b):
    if camel(w): return re.sub(a.title() + r'(?![a-z])', ''.join(p.title() for p in b.split('_')), w)
    return re.sub(r'(?<![A-Za-z])' + a + r'(?![a-z])', b, w)
PAT = [(187, 'doubt', 'uncertainty', False), (187, 'doubts', 'uncertainties', True), (192, 'link', 'dc_link', False), (195, 'kinetic', 'charge_transfer', False), (205, 'tries', 'attempts', False), (205, 'try', 'attempt', True), (202, 'least', 'min', False),
       (202, 'most', 'max', False), (203, 'passed', 'elapsed', True), (182, 'former', 'restored', True), (194, 'pair', 'rc', True), (194, 'pairs', 'rc', True), (207, 'told', 'reported', True), (208, 'look', 'check', True),
       (209, 'aside', 'quarantine', True), (182, 'life', 'session', True), (182, 'lives', 'sessions', True)]
CAN = re.compile(r'^(daemon/shell/(link_|rate_watch|can_|interface|buses|loop|status_json|daemon_life)|tests/(unit|integration)/(link_|rate_watch))')
for ln, a, b, hand in PAT:
    for w in sorted(idx):
        if w in done or a not in parts(w) or not code(w): continue
        D = [d for d in T.get(w, [])]
        if not D: continue
        if re.search(r'at_(least|most)', w) or w in ('least', 'most') and False: continue
        new = sub(w, a, b)
        if new == w: continue
        fs = sorted({d[0] for d in D})
        st, why = ('conflict' if hand else 'mechanical'), 'follows from the rule "%s -> %s" in line %d' % (a, b, ln)
        if a == 'link' and any(CAN.match(f) for f in fs): new = sub(w, a, 'can_interface'); st = 'conflict'; why = 'a CAN interface, not the DC link: by hand'
        if w == a or w.strip('_') == a:
            cans = [f for f in fs if CAN.match(f)]
            if len(fs) > 6 or cans or hand: st = 'conflict'; why += '; everyday word, %d files declare it' % len(fs)
        if any(d[1] not in ('local', 'parameter') for d in T.get(new, [])): st = 'conflict'; why += '; %s exists already in %s' % (new, T[new][0][0])
        elif T.get(new) and {d[0] for d in T[new]} & set(fs): why += '; %s is a local of %s' % (new, ', '.join(sorted({d[0] for d in T[new]} & set(fs))[:2]))
        # a local or member whose every declaration is a test's name of a case is not a name
        emit('type' if camel(w) else 'identifier', '*', w, new, ln, occ(w), st, why); done.add(w)
# rows that stand in several tables
m = {}
for x in out:
    k = (x['kind'], x['scope'], x['old'], x['new'])
    if k in m:
        m[k]['lines'].append(x['line'])
        if x['status'] == 'conflict' and m[k]['status'] != 'conflict': pass
    else: x['lines'] = [x['line']]; m[k] = x
out = list(m.values())
pickle.dump((out, gone), open('/tmp/classified.pkl', 'wb'))
c = collections.Counter((x['kind'], x['status']) for x in out)
for k in sorted(c): print(k, c[k])
print(len(out), 'rows', len(gone), 'gone')
