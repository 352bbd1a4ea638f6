"""Reads the tables of glossary.md: every `old` -> `new` with its line, section, kind and what stands around it."""
import re, os
PATH = 'design/glossary.md'
PAIR = re.compile(r'`([^`]+)`((?:\s*\([^()]*\))?)\s*→\s*`([^`]+)`')
CHAIN = re.compile(r'`([^`]+)`(?:,\s*`([^`]+)`)+\s*→\s*`([^`]+)`(?:,\s*`([^`]+)`)+')
SECTION_KIND = {}
def cells(l):
    # split at | outside backticks
    out, cur, tick = [], '', False
    for ch in l.strip().strip('|'):
        if ch == '`': tick = not tick
        if ch == '|' and not tick: out.append(cur.strip()); cur = ''
        else: cur += ch
    out.append(cur.strip()); return out
def read(path=PATH):
    L = open(path).read().split('\n')
    sec = num = sub = group = ''
    rows = []
    for i, l in enumerate(L, 1):
        m = re.match(r'#+\s*([0-9.]*)\s*(.*)', l)
        if m and l.startswith('#'):
            num, sec, sub, group = m.group(1).rstrip('.'), m.group(2), '', ''; continue
        m = re.match(r'\*\*([^*]+)\*\*', l)
        if m: sub = m.group(1)
        if not l.startswith('|') or '→' not in l: continue
        c = cells(l)
        m = re.match(r'\*\*(.+)\*\*', c[0])
        if m: group = m.group(1)
        for ci, cell in enumerate(c):
            if '→' not in cell: continue
            pairs = []
            # `a`, `b` -> `c`, `d`
            done = []
            for m in CHAIN.finditer(cell):
                left = re.findall(r'`([^`]+)`', m.group(0).split('→')[0]); right = re.findall(r'`([^`]+)`', m.group(0).split('→')[1])
                # a chain is a real one only if as many stand on both sides
                if len(left) == len(right) or len(right) == 1:
                    for k, o in enumerate(left): pairs.append((m.start(), m.start(), o, right[k] if len(right) > 1 else right[0]))
                    done.append((m.start(), m.end()))
                elif len(right) > len(left):
                    pass
            for m in PAIR.finditer(cell):
                if any(a <= m.start() < b for a, b in done): continue
                pairs.append((m.start(), m.start(), m.group(1), m.group(3)))
            pairs.sort()
            last = 0
            prefix = ''
            for (s, e, o, n) in pairs:
                pre = re.sub(r'`[^`]*`', '', cell[last:s])
                before = cell[:s]
                word = re.sub(r'^[^;]*;', '', pre).strip(' ;,') if ';' in pre else pre.strip(' ;,→')
                rows.append(dict(line=i, num=num, sec=sec, sub=sub, group=group, first=c[0], now=c[1] if len(c) > 1 else '', flag=(c[-1] == 'I' or num in ('2.14', '3.1', '3.2')),
                                 pre=word, before=before, old=o, new=n, cell=cell, col=ci))
                last = s + len(o)
    return rows
if __name__ == '__main__':
    r = read()
    print(len(r))
    import collections
    print(collections.Counter(x['num'] for x in r))
    print(collections.Counter(x['pre'] for x in r if x['pre']).most_common(80))
