#!/usr/bin/env python3
"""Lines of tests/mutation/{survivors,coverage_exceptions}.txt whose trailing comment has changed in the source: takes the source's line."""
import re, pathlib
def code(l): return re.sub(r'\s*//.*$', '', l)
for name in ('survivors.txt', 'coverage_exceptions.txt'):
    p = pathlib.Path('tests/mutation')/name
    out = []; file = None; lost = 0; changed = 0
    for l in p.read_text().split('\n'):
        m = re.match(r'file: (\S+)$', l)
        if m: file = m[1]
        m = re.match(r'line: (.*)$', l)
        if m and file:
            lines = [x.strip() for x in pathlib.Path(file).read_text().split('\n')]
            if m[1] not in lines:
                same = {x for x in lines if code(x) == code(m[1])}
                if len(same) == 1: l = 'line: ' + same.pop(); changed += 1
                else: lost += 1; print(f'{name}: {file}: {m[1]!r}: {len(same)} lines like it')
        out.append(l)
    p.write_text('\n'.join(out)); print(name, changed, 'changed', lost, 'lost')
