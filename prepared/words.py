#!/usr/bin/env python3
"""Counts the banned words of issue 28, section 3, per 1,000 words: in comments of C++ and in .md pages, per folder and in all.

  words.py [--root CHECKOUT] [--max 1.0] [--list FOLDER] [--tsv]

--max: exit status 1 if comments or pages as a whole have more per 1,000 words (the limit of the issue is 1.0).
--list FOLDER: every place in this folder, FILE:LINE: word.
Comments: // and /* */ outside of literals. A run of // lines is one text. Pages: everything, but for fenced blocks, code in
backticks, HTML comments and links' targets. A word: letters, apostrophes within. docs/glossary.md and CHANGELOG.md are left out.
"""
import argparse, collections, os, re, subprocess, sys
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), 'lib'))
import lexcxx

BANNED = set('told tell tells say says said nobody somebody anybody whoever anew stranger strangers wish wishes former life lives '
             'believed hear hears heard'.split())
WORD = re.compile(r"[A-Za-z]+(?:['’][A-Za-z]+)*")
OMIT = {'docs/glossary.md', 'CHANGELOG.md'}


def words(text):
    for m in WORD.finditer(text):
        w = re.sub(r"['’]s$", '', m.group(0).lower())
        yield m.start(), w


def comments(text):
    for m in lexcxx.TOKEN.finditer(text):
        if m.group('comment') is not None:
            yield m.start(), re.sub(r'[A-Za-z]*\w*(?:_|::)[\w:]*', lambda x: ' ' * len(x.group(0)), m.group(0))   # names are no words


def page(text):
    blank = lambda m: re.sub(r'[^\n]', ' ', m.group(0))
    text = re.sub(r'^(`{3,}|~{3,}).*?^\1\s*$', blank, text, flags=re.S | re.M)
    text = re.sub(r'<!--.*?-->', blank, text, flags=re.S)
    text = re.sub(r'`[^`\n]+`', blank, text)
    text = re.sub(r'\]\([^)\n]*\)', blank, text)
    yield 0, text


def folder(f):
    d = os.path.dirname(f)
    p = d.split('/')
    return '/'.join(p[:2]) if p[0] in ('daemon', 'tools', 'tests', 'docs') else (p[0] or '.')


def main():
    a = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    a.add_argument('--root', default='.'); a.add_argument('--max', type=float); a.add_argument('--list'); a.add_argument('--tsv', action='store_true')
    o = a.parse_args()
    if os.path.isdir(os.path.join(o.root, '.git')) or os.path.isfile(os.path.join(o.root, '.git')):
        names = subprocess.run(['git', '-C', o.root, 'ls-files', '-z'], capture_output=True, check=True).stdout.decode().split('\0')
    else:
        names = [os.path.relpath(os.path.join(d, f), o.root) for d, _, fs in os.walk(o.root) for f in fs]
    count = {'comments': collections.defaultdict(lambda: [0, 0, 0]), 'pages': collections.defaultdict(lambda: [0, 0, 0])}
    which = {'comments': collections.Counter(), 'pages': collections.Counter()}
    for f in sorted(names):
        if not f or f in OMIT or f.startswith('build'): continue
        kind = 'comments' if f.endswith(lexcxx.CXX) else 'pages' if f.endswith('.md') else None
        path = os.path.join(o.root, f)
        if not kind or not os.path.isfile(path): continue
        text = open(path, encoding='utf-8', errors='replace').read()
        c = count[kind][folder(f)]
        c[2] += 1
        for start, t in (comments(text) if kind == 'comments' else page(text)):
            for at, w in words(t):
                c[1] += 1
                if w in BANNED:
                    c[0] += 1; which[kind][w] += 1
                    if o.list and f.startswith(o.list): print('%s:%d: %s' % (f, text.count('\n', 0, start + at) + 1, w))
    worst = 0
    for kind in ('comments', 'pages'):
        rows = sorted(count[kind].items())
        total = [sum(v[i] for _, v in rows) for i in range(3)]
        if not o.tsv: print('%-28s %7s %8s %9s %6s' % (kind, 'banned', 'words', 'per 1000', 'files'))
        for name, (b, n, k) in rows + [('all', total)]:
            rate = 1000.0 * b / n if n else 0
            if o.tsv: print('\t'.join([kind, name, str(b), str(n), '%.2f' % rate, str(k)]))
            else: print('  %-26s %7d %8d %9.2f %6d' % (name, b, n, rate, k))
        worst = max(worst, 1000.0 * total[0] / total[1] if total[1] else 0)
        if not o.tsv: print('  ' + ', '.join('%s %d' % x for x in which[kind].most_common())); print()
    if o.max is not None and worst > o.max: sys.exit(1)


if __name__ == '__main__':
    main()
