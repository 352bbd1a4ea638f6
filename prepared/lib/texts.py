"""texts.tsv: the user-visible texts of sections 3 and 4 of the glossary, and where the old text is found now."""
import sys, re, os, collections
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import lexcxx, glossary
ROOT, OUT = sys.argv[1], sys.argv[2]
L = open(glossary.PATH).read().split('\n')
# ---- corpus: literals of C++ (adjacent ones joined), comments, pages
corpus = []   # (file, kind, text, [(offset, line)])
def norm(s): return re.sub(r'\s+', ' ', s)
def fill():
    for d, ds, fs in os.walk(ROOT):
        ds[:] = [x for x in ds if not (d == ROOT and (x.startswith('build') or x == '.git')) and 'corpora' not in os.path.join(d, x)]
        for f in sorted(fs):
            p = os.path.join(d, f); rel = os.path.relpath(p, ROOT)
            if rel in ('docs/glossary.md',) or os.path.islink(p): continue
            data = open(p, 'rb').read()
            if b'\0' in data or f.endswith(('.zst', '.gz')): continue
            t = data.decode('utf-8', 'replace')
            if f.endswith(lexcxx.CXX):
                parts, pos, last_end, buf, com = [], [], 0, [], []
                n = 0; cn = 0; cpos = []
                for m in lexcxx.TOKEN.finditer(t):
                    k = lexcxx.kind_of(m); s = m.group(0)
                    if k in ('string', 'raw'):
                        body = re.sub(r'^(?:u8|u|U|L)?R?"(?:[^()\\\s"]{0,16}\()?|(?:\)[^"]*)?"$', '', s) if k == 'raw' else s[s.index('"') + 1:-1]
                        if k == 'string': body = body.replace('\\"', '"').replace('\\n', ' ').replace("\\'", "'")
                        sep = '' if not t[last_end:m.start()].strip() and buf else '\x01'
                        buf.append(sep + norm(body)); pos.append((n + len(sep), t.count('\n', 0, m.start()) + 1)); n += len(buf[-1]); last_end = m.end()
                    elif k == 'comment':
                        c = ' ' + norm(re.sub(r'\n\s*///?<?', ' ', s.lstrip('/*< ')))
                        com.append(c); cpos.append((cn, t.count('\n', 0, m.start()) + 1)); cn += len(c)
                corpus.append((rel, 'text', ''.join(buf), pos)); corpus.append((rel, 'comment', norm(''.join(com)), cpos))
            elif f.endswith(('.md', '.json', '.sh', '.py', '.expected', '.scenario', '.scn', '.txt', '.in', '.rows', '.1', '.8')) or '.' not in f:
                x, pos, n = [], [], 0
                for i, line in enumerate(t.split('\n'), 1):
                    y = norm(line.strip().replace('**', '')) + ' '
                    x.append(y); pos.append((n, i)); n += len(y)
                corpus.append((rel, 'page' if f.endswith('.md') else 'data', ''.join(x), pos))
fill()
import bisect
def line_of(pos, at):
    i = bisect.bisect_right([p for p, _ in pos], at) - 1
    return pos[max(i, 0)][1]
PLACE = re.compile(r'\b(?:FAULT|MODULE|MEANING|REASON|ERROR|PATH|USER|HASH|LIST|DEVICE|DIR|PACK|TIME|VALUE|STATE|CONFIG|[NMXYABHGT]\d?)\b|…|\.\.\.|\[[^\]]*\]|"[a-z]"|\b\d[\d.,]*(?:\s?(?:%|ms|s|h|A|V|Ah|J|us|kbit/s|Bd))?(?![\w-])|can0|->')
def fragments(s):
    s = norm(s.replace('**', '').strip())
    fr = [f.strip(' ;,:.()"') if False else f.strip() for f in PLACE.split(s)]
    fr = [f.strip(' ;:,') for f in fr if len(re.sub(r'[^A-Za-z]', '', f)) >= 3]
    return sorted(set(fr), key=len, reverse=True)
def find(old, prefer=(), tail=False):
    fr = fragments(old)
    if not fr: return []
    whole = norm(old.replace('**', '').strip())
    for cand in ([whole] + fr[:2]):
        if len(re.sub(r'[^A-Za-z]', '', cand)) < 3: continue
        short = len(cand) < 9
        hits = []
        for f, k, t, pos in corpus:
            if k == 'comment' and not any('omment' in p for p in prefer): continue
            i = 0
            while True:
                i = t.find(cand, i)
                if i < 0: break
                j = i + len(cand)
                if not (t[i - 1:i].isalnum() and cand[0].isalnum()) and not (t[j:j + 1].isalnum() and cand[-1].isalnum()):
                    if not short or (k != 'text' or t[i - 1:i] in ('', '\x01', ' ', '"') and t[j:j + 1] in ('', '\x01', ':', ' ', ',')):
                        hits.append((f, line_of(pos, i), cand)); break
                i = j
        if hits:
            pr = [h for h in hits if any(h[0].startswith(p.rsplit('.', 1)[0]) for p in prefer)]
            if short and prefer and not pr: continue
            def rank(h): return (0 if h in pr else 1, 0 if not h[0].startswith(('tests/', 'docs/')) else 1 if h[0].startswith('docs/') else 2, h[0])
            return sorted(hits, key=rank)
    if prefer and not tail:
        for piece in sorted({p.strip() for f in fr for p in re.split(r'[:;,.?]|\s-\s', f)}, key=len, reverse=True)[:3]:
            if len(re.sub(r'[^A-Za-z]', '', piece)) < 4 or piece == norm(old): continue
            h = [x for x in find(piece, prefer, True) if any(x[0].startswith(p.rsplit('.', 1)[0]) for p in prefer)]
            if h: return h
    return []
rows = []
def add(line, kind, old, new, prefer=(), key=''):
    old, new = old.strip(), new.strip()
    if not old or old == '' or new in ('keep',) or old == new: 
        if new == 'keep' or old == new: rows.append((line, kind, key, old, '(keep)', '', 0))
        return
    h = find(old, prefer)
    where = ', '.join('%s:%d' % (f, n) for f, n, _ in h[:3]) if h else 'gone'
    exact = '' if not h else ('whole' if norm(old.replace('**', '')) == h[0][2] else 'by "%s"' % h[0][2][:60])
    rows.append((line, kind, key, old, new, where, len(h), exact))
def split_semi(a, b):
    x = [s.strip() for s in re.split(r';(?![^(]*\))', a)]; y = [s.strip() for s in re.split(r';(?![^(]*\))', b)]
    return list(zip(x, y)) if len(x) == len(y) and len(x) > 1 else [(a, b)]
# fault rows: meaning and remedy of now, by id
ft = open(os.path.join(ROOT, 'daemon/core/fault_table.cpp')).read()
FT = {}
for m in re.finditer(r'\.name = "(\w+)",(.*?)(?=\n    \{\.id|\Z)', ft, re.S):
    g = lambda k: (lambda x: ''.join(re.findall(r'"((?:[^"\\]|\\.)*)"', x.group(1))) if x else '')(re.search(r'\.' + k + r' =\s*((?:"(?:[^"\\]|\\.)*"\s*)+)', m.group(2)))
    FT[m.group(1)] = (g('meaning'), g('remedy'))
num = sec = head = sub = ''
files = []
for i, l in enumerate(L, 1):
    m = re.match(r'#+\s*([0-9.]*)\s*(.*)', l)
    if l.startswith('#') and m: num, sec, sub = m.group(1).rstrip('.'), m.group(2), ''; files = re.findall(r'`([\w/.-]+\.(?:cpp|hpp|md))`', sec); continue
    if num.startswith('3') and l.startswith('Fault page'):
        for a, b in re.findall(r'"([^"]+)" → "([^"]+)"', l): add(i, 'fault page', a, b, ['daemon/shell/fault_page.cpp'])
    if not l.startswith('|') or re.match(r'\|[-| ]+\|$', l): continue
    c = glossary.cells(l)
    if num not in ('3.1', '3.2', '3.3', '3.4', '3.5', '3.6', '3.7', '3.8', '4.1', '4.2', '4.3') : continue
    if c[0] in ('id now → id new', 'fault', 'value', 'now', 'enum or source', 'file', 'program', 'page (file)', 'key (new)', 'page', 'pattern now (example)', 'enum (file)'):
        continue
    rowfiles = re.findall(r'`([\w/.-]+\.(?:cpp|hpp|md))`', c[0])
    if rowfiles: sub = rowfiles
    elif c[0]: sub = []
    pf = (rowfiles or sub or []) + files
    if num == '3.1' and len(c) == 3: add(i, 'event' if '`' in c[0] else 'event word', c[1], c[2], pf, c[0].replace('`', ''))
    elif num == '3.2':
        old = re.search(r'`(\w+)`', c[0]).group(1)
        if old in FT:
            add(i, 'fault meaning', FT[old][0], c[1], ['daemon/core/fault_table.cpp'], old); add(i, 'fault remedy', FT[old][1], c[2], ['daemon/core/fault_table.cpp'], old)
        else: rows.append((i, 'fault meaning', old, '?', c[1], 'gone', 0, '')); rows.append((i, 'fault remedy', old, '?', c[2], 'gone', 0, ''))
    elif num == '3.3': add(i, 'typical cause', c[1], c[2], ['daemon/shell/advice.cpp'], c[0].replace('`', ''))
    elif num == '3.4' and len(c) == 5: add(i, 'closing inhibit', c[1], c[2], ['daemon/core/permission.cpp'], c[0].replace('`', '')); rows.append((i, 'inhibit meaning', c[0].replace('`', ''), '(text of daemon/shell/advice.cpp)', c[3], 'daemon/shell/advice.cpp', 1, 'row')); rows.append((i, 'inhibit action', c[0].replace('`', ''), '(text of daemon/shell/advice.cpp)', c[4], 'daemon/shell/advice.cpp', 1, 'row'))
    elif num == '3.4' and len(c) == 2:
        for a, b in split_semi(c[0], c[1]): add(i, 'why detail', a, b, ['daemon/shell/why_', 'tools/bmuctl/'])
    elif num in ('3.5', '3.6', '3.7') and len(c) == 3 and c[1]:
        if c[2] == 'keep': rows.append((i, sec.split(' (')[0], c[0], c[1], '(keep)', '', 0, '')); continue
        for a, b in split_semi(c[1], c[2]): add(i, sec.split(' (')[0], a, b, pf, c[0].replace('`', ''))
    elif num == '3.8': add(i, 'pack file meaning', c[1], c[2], ['config/'], c[0].replace('`', ''))
    elif num == '4.1' and len(c) == 3:
        kind = 'page title' if i < 1480 else 'heading'
        for a, b in (split_semi(c[1], c[2]) if kind == 'heading' else [(c[1], c[2])]): add(i, kind, a, b, pf, c[0].replace('`', ''))
    elif num == '4.2' and len(c) == 3: add(i, 'sentence', c[1], c[2], pf, c[0].replace('`', ''))
    elif num == '4.3' and len(c) == 2:
        for q in re.findall(r'"([^"]+)"', c[0])[:1]: add(i, 'comment pattern', q, c[1], ['omment'] + pf)
rows = [r if len(r) == 8 else r + ('',) for r in rows]
with open(os.path.join(OUT, 'texts.tsv'), 'w') as f:
    f.write('# glossary_line\tkind\tkey\told\tnew\tfound\tfiles\thow (whole: the whole old text stands there; by "...": only this part of it)\n')
    for r in rows: f.write('\t'.join(str(x).replace('\t', ' ') for x in r) + '\n')
c = collections.Counter(('keep' if r[4] == '(keep)' else 'gone' if r[5] == 'gone' else 'found') for r in rows)
print(len(rows), c)
k = collections.Counter((r[1], 'gone' if r[5] == 'gone' else 'ok') for r in rows)
for x in sorted(k): print(x, k[x])
