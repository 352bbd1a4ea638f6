import sys, re, os, pickle, collections
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import tags, index
NOW, OLD = 'tree', '/tmp/old'
out, gone = pickle.load(open('/tmp/classified.pkl', 'rb'))
T = tags.load(NOW, '/tmp/tagsnow'); TO = tags.load(OLD, '/tmp/tagsold') if os.path.isdir(OLD) else {}
idx = pickle.load(open('/tmp/idx.pkl', 'rb'))[0]
BAN = set('told tell tells says say said heard hear hears believed believe doubt doubted doubtful doubts suspect suspected suspicion anew wish wishes life lives former stranger strangers nobody somebody anybody whoever obey obeys obeying disobeys memo book moment teller turn turns picture pictures pictured link links rest rests line lines image memory place places placed step ask asks asked asking word words wants want wanted alone vain patience hopeless legacy looks look looked least most tries try left surprise ledger memos pair pairs trouble late memories listen listens listening aside ours lasted foreign guest guests begun began begin speaks spoken speak mirror hold holds held misfit follow follows sees see seen'.split())
CORE = set('told tell tells says say said heard hear hears believed believe doubt doubted doubtful doubts suspect suspected suspicion anew wish wishes life lives former stranger strangers nobody somebody anybody whoever obey obeys obeying disobeys memo book moment teller turn turns picture pictures pictured link links rest rests line lines image memory place places placed'.split())
def comp(w): return [p.lower() for p in re.sub(r'([a-z0-9])([A-Z])', r'\1_\2', w).split('_') if p]
done = {x['old'].split('::')[-1].split('/')[-1] for x in out if x['status'] == 'mechanical' or 'follows from' not in x['why'] and 'CAN interface, not' not in x['why']}
if __name__ == '__main__':
    c = collections.Counter(); rows = []
    for w, D in T.items():
        if w in done: continue
        b = [p for p in comp(w) if p in BAN]
        if not b: continue
        nl = [d for d in D if d[1] not in ('local', 'parameter')]
        prod = [d for d in nl if not d[0].startswith('tests/')]
        since = 'new' if w not in TO else 'old'
        kind = 'product' if prod else ('test' if nl else ('local' if any(not d[0].startswith('tests/') for d in D) else 'testlocal'))
        c[(kind, since, bool([p for p in b if p in CORE]))] += 1
        rows.append((kind, since, w, b, D))
    for k in sorted(c): print(k, c[k])
    for core in (True,):
        for (kind, since, w, b, D) in sorted(rows, key=lambda r: (r[3][0], r[2])):
            if kind == 'product' and since == 'new' and bool([p for p in b if p in CORE]) == core:
                d = [x for x in D if not x[0].startswith('tests/') and x[1] not in ('local', 'parameter')][0]
                print(w, '|', d[1], d[2], d[0], len(idx.get(w, {})))
