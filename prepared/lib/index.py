"""Index of all words of a checkout: word -> file -> [code, string, comment, other]."""
import subprocess, sys, pickle, os, collections
sys.path.insert(0, os.path.dirname(__file__))
import lexcxx
BINARY = ('.zst', '.gz', '.png', '.svg.gz')
def files(root):
    out = subprocess.run(['git', '-C', root, 'ls-files', '-z'], capture_output=True, check=True).stdout.decode()
    return [f for f in out.split('\0') if f and not f.endswith(BINARY) and not f.startswith('tests/fuzz/corpora/')]
def build(root):
    idx = collections.defaultdict(dict)
    strings = collections.defaultdict(dict)
    for f in files(root):
        p = os.path.join(root, f)
        if os.path.islink(p) or not os.path.isfile(p): continue
        data = open(p, 'rb').read()
        if b'\0' in data: continue
        text = data.decode('utf-8', 'replace')
        def add(w, k):
            d = idx[w].setdefault(f, [0, 0, 0, 0]); d[k] += 1
        if f.endswith(lexcxx.CXX):
            for m in lexcxx.TOKEN.finditer(text):
                k = lexcxx.kind_of(m)
                s = m.group(0)
                if k == 'word': add(s, 0)
                elif k in ('string', 'raw', 'include'):
                    for w in lexcxx.WORD.findall(s): add(w, 1)
                    if k != 'include':
                        strings[s.strip('"')][f] = strings[s.strip('"')].get(f, 0) + 1
                elif k == 'comment':
                    for w in lexcxx.WORD.findall(s): add(w, 2)
        else:
            for w in lexcxx.WORD.findall(text): add(w, 3)
    return dict(idx), dict(strings)
if __name__ == '__main__':
    import time; t = time.time()
    r = build(sys.argv[1])
    pickle.dump(r, open(sys.argv[2], 'wb'))
    print(len(r[0]), 'words', len(r[1]), 'strings', time.time() - t)
