import sys, re, os, pickle, collections
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import tags
ROOT = 'tree'
T = tags.load(ROOT)
idx, strs = pickle.load(open('/tmp/idx.pkl', 'rb'))
rows = [l.rstrip('\n').split('\t') for l in open('renames.tsv') if not l.startswith('#')]
keys = collections.defaultdict(list)
for r in rows:
    if r[0] not in ('identifier', 'type', 'file', 'option', 'other'): keys[r[2]].append(r)
out = []
P = out.append
P(open('lib/conflicts_head.md').read().rstrip())
# --- 2 hand rows
hand = [r for r in rows if r[6] == 'hand']
P('\n## 2. Homonyms: the old word stays for another meaning (%d rows with status "hand")\n' % len(hand))
P('`Owner::name` says whose member it is: rename the declaration, then what the compiler names; or use the references of clangd (section 9). Counts are of the files in scope.\n')
P('| line | kind | old | new | where | n | why by hand |\n|---|---|---|---|---|---|---|')
for r in hand:
    sc = r[1] if len(r[1]) < 90 else r[1][:87] + '...'
    P('| %s | %s | `%s` | `%s` | %s | %s | %s |' % (r[4], r[0], r[2], r[3], sc.replace('*', 'all'), r[5], r[7].replace('|', '/')[:170]))
# --- 3 new names that exist
P('\n## 3. New names that exist already\n')
P('Of the mechanical rows; "same file" means: both names are in one file, so a second declaration, a shadow (-Wshadow) or two things under one name may come of it.\n')
P('| line | old | new | exists as | in files with the old one |\n|---|---|---|---|---|')
n = 0
for r in rows:
    if r[0] not in ('identifier', 'type') or r[6] != 'mechanical': continue
    w, new = r[2].split('::')[-1], r[3]
    d = [x for x in T.get(new, []) if x[1] not in ('local', 'parameter') and (r[2].count('::') == 0 or x[1] != 'enumerator')]
    both = sorted(set(f for f, v in idx.get(w, {}).items() if v[0]) & set(f for f, v in idx.get(new, {}).items() if v[0]))
    if '::' in r[2]:
        d = [x for x in T.get(new, []) if x[1] == 'enumerator' and x[2] == r[2].rsplit('::', 1)[0]]
        both = []
    if not d and not both: continue
    if not both and '::' not in r[2] and len(d) and r[0] == 'identifier': continue   # another class, another file: no conflict
    n += 1
    P('| %s | `%s` | `%s` | %s | %s |' % (r[4], r[2], new, '; '.join(sorted({(x[2] + '::' if x[2] else '') + new + ' ' + x[0] for x in d})[:3]), (', '.join(both[:3]) + (' +%d' % (len(both) - 3) if len(both) > 3 else ''))))
# --- two old names, one new
P('\n### Two old names that become one\n')
m = collections.defaultdict(set)
for r in rows:
    if r[0] in ('identifier', 'type') and '::' not in r[2]: m[r[3]].add(r[2])
for new, olds in sorted(m.items()):
    if len(olds) > 1: P('- `%s` from %s' % (new, ', '.join('`%s`' % o for o in sorted(olds))))
# --- enumerators and members whose name is a string, too
P('\n## 4. Names that are strings, too\n')
a, b, c = [], [], []
for r in rows:
    if r[0] != 'identifier': continue
    w = r[2].split('::')[-1]
    s = sorted(f for f in strs.get(w, {}) if not f.startswith('tests/'))
    if not s: continue
    k = keys.get(w)
    if not k: a.append((r, s))
    elif any(x[3] != r[3] for x in k): b.append((r, s, k))
    else: c.append(r)
P('### The identifier has a row, its string has none (%d)\n\nThe string is a JSON value, a scenario word, a CSV column, an option or something else of the same spelling. "id" marks enumerators whose enum has an id as text in the same source: there the string changes with the enumerator.\n' % len(a))
for r, s in a:
    own = r[2].rsplit('::', 1)[0] if '::' in r[2] else ''
    ids = [f for f in s if own and re.search(re.escape(own.split('::')[-1]) + r'::' + re.escape(r[2].split('::')[-1]) + r',\s*"' + re.escape(r[2].split('::')[-1]) + '"', open(os.path.join(ROOT, f)).read())] if own and '/' not in own else []
    P('- %s `%s` -> `%s` (line %s): "%s" in %s%s' % ('**id**' if ids else '', r[2], r[3], r[4], r[2].split('::')[-1], ', '.join(s[:3]), ' +%d' % (len(s) - 3) if len(s) > 3 else ''))
P('\n### Identifier and string get different new names (%d): they change apart\n' % len(b))
for r, s, k in b: P('- `%s` -> `%s`, but %s; in %s' % (r[2], r[3], ', '.join(sorted({'%s "%s" -> "%s"' % (x[0], x[2], x[3]) for x in k})), ', '.join(s[:3])))
P('\n### Identifier and string get the same new name (%d): both rows in one commit\n\n%s' % (len(c), ', '.join('`%s`' % r[2] for r in c)))
open('conflicts.md', 'w').write('\n'.join(out) + '\n' + open('lib/conflicts_tail.md').read())
print(len(hand), n, len(a), len(b), len(c))
