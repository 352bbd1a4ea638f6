import subprocess, re, collections
def load(root, out='/tmp/tags28'):
    import os
    subprocess.run(['ctags', '--languages=C++', '--kinds-C++=+lpzxU', '--fields=+nKsSzt', '--langmap=C++:+.in', '-f', out, '-R', '--exclude=build*', '--exclude=.git', '.'], cwd=root, check=True, stderr=subprocess.DEVNULL)
    d = collections.defaultdict(list)
    for l in open(out, encoding='utf-8', errors='replace'):
        if l.startswith('!'): continue
        p = l.rstrip('\n').split('\t')
        name, f = p[0], p[1].removeprefix('./')
        kind = scope = ''; line = 0
        for x in p[3:]:
            if x.startswith('kind:'): kind = x[5:]
            elif x.startswith('line:'): line = int(x[5:])
            elif re.match(r'(class|struct|enum|namespace|function|union):', x): scope = x.split(':', 1)[1]
        scope = re.sub(r'__anon[0-9a-f]+', '(anon)', scope).replace('bmu::', '')
        if scope == 'bmu': scope = ''
        d[name].append((f, kind, scope, line))
    return d
if __name__ == '__main__':
    import sys
    d = load('the checkout')
    print(len(d))
    for w in sys.argv[1:]: print(w, d.get(w))
