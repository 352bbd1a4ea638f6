#!/usr/bin/env python3
"""Gives the user-visible texts of bmud the wording of the glossary (texts.tsv, section 3 of the glossary).

  apply_texts.py [--root CHECKOUT] [--dry-run] [--only PART] [--no-format]

Reads texts/*.txt beside this script, in the order of their names. Each is a list of edits; nothing else decides what is changed. A line
that begins with # is a comment. Sections:

  @@ FILE                the edits below are for this file (a path of the checkout; several, separated by spaces)
    - OLD                a string literal of C++, or the adjacent ones that the compiler joins, whose whole value is OLD
    + NEW                becomes NEW
    ~ OLD / + NEW        the same for a part of a literal's value (or of a raw string)
    = OLD / + NEW        plain text of a file that is no C++: every occurrence, as it is
    r OLD / + NEW        a regular expression (Python) and its replacement, on the whole file
    <<<< / ==== / >>>>   code: the lines between are replaced as they are; once
  @@+ FILE               the same, after the rules of all groups
  @@@ GROUP              rules for all that follows the texts: string literals of tests (not the names of test cases), expected
                         outputs, scripts of tests, fenced blocks and code spans of pages, the schema
    - OLD / + NEW        a literal part
    r OLD / + NEW        a regular expression (Python) and its replacement
    c OLD / + NEW        the same, but not for scripts
  @faults                ID | MEANING | REMEDY: row of daemon/core/faults/fault_table.cpp, empty: as it is
  @causes                ID | TYPICAL CAUSE: row of daemon/shell/status/advice.cpp
  @inhibits              ENUMERATOR | TEXT | MEANING | ACTION: daemon/core/contactors/permission.cpp and advice.cpp

Values: \\n and \\" as in C++ are not needed for ", but \\n is a line feed; a | at the beginning or at the end is left out, so that spaces there can be
seen. `-` edits whose OLD has at least three words and 16 letters are rules for everything that follows, too (unless the section line ends
with the word `here`). An edit that is already done is counted as done; one that is neither done nor possible is listed, and the exit status is 1.
clang-format -i runs over every C++ file that was changed.
"""
import argparse, collections, os, re, subprocess, sys

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, 'lib'))
import lexcxx

PRODUCT = ('config/', 'daemon/', 'devices/', 'mmu/', 'protocol/', 'tools/')
SKIP = ('docs/glossary.md', 'CHANGELOG.md')
BINARY = ('.zst', '.gz', '.png', '.ico', '.nul-bytes')


# ---------------------------------------------------------------- C++ literals

class Group:
    """Adjacent literals: pieces are (start, end) of each body (between the quotes) in the file's text."""
    def __init__(self): self.pieces, self.raw, self.start, self.end = [], False, 0, 0


def groups(text):
    cur = None
    for kind, s, e in lexcxx.pieces(text):
        if kind not in ('string', 'raw'): continue
        tok = text[s:e]
        if kind == 'raw':
            if cur: yield cur; cur = None
            g = Group(); g.raw = True
            open_at = tok.index('(') + 1
            close_at = tok.rindex(')')
            g.pieces = [(s + open_at, s + close_at)]; g.start, g.end = s, e
            yield g
            continue
        between = text[cur.end:s] if cur else None
        joins = cur is not None and re.sub(r'//[^\n]*|/\*.*?\*/', '', between, flags=re.S).strip() == '' and '#' not in between
        if not joins:
            if cur: yield cur
            cur = Group(); cur.start = s
        cur.pieces.append((s + tok.index('"') + 1, e - 1)); cur.end = e
    if cur: yield cur


def escaped(value):
    return value.replace('\\', '\\\\').replace('"', '\\"').replace('\n', '\\n').replace('\t', '\\t')


def body(text, g):
    return ''.join(text[s:e] for s, e in g.pieces)


def literal(value_escaped):
    """One literal for each line of the value."""
    parts = re.split(r'(?<=\\n)(?=.)', value_escaped)
    return '\n'.join('"%s"' % p for p in parts)


def replace_part(text, g, at, length, new):
    """(start, end, new) edits of the file for a replacement in the joined body of the group."""
    edits, pos = [], 0
    first = True
    for s, e in g.pieces:
        n = e - s
        a, b = max(at, pos), min(at + length, pos + n)
        if a < b or (length == 0 and pos <= at <= pos + n and first):
            edits.append((s + a - pos, s + b - pos, new if first else ''))
            first = False
        pos += n
    return edits


def apply_edits(text, edits):
    for s, e, new in sorted(edits, key=lambda x: (-x[0], -x[1])):
        text = text[:s] + new + text[e:]
    # literals that lost their whole value
    return re.sub(r'(?<=")[ \t]*\n[ \t]*""(?=[ \t]*[\n,;)}])', '', text)


def edit_part(text, old, new, everywhere):
    """Replaces a part of a literal's value; returns (text, count)."""
    old_e, new_e = escaped(old), escaped(new)
    count, edits = 0, []
    for g in groups(text):
        o, n = (old, new) if g.raw else (old_e, new_e)
        b = body(text, g)
        at = b.find(o)
        while at >= 0:
            edits += replace_part(text, g, at, len(o), n)
            count += 1
            at = b.find(o, at + len(o))
    return (apply_edits(text, edits), count) if edits else (text, 0)


def edit_whole(text, old, new):
    old_e, new_e = escaped(old), escaped(new)
    edits = []
    for g in groups(text):
        if g.raw or body(text, g) != old_e: continue
        edits.append((g.start, g.end, literal(new_e)))
    return (apply_edits(text, edits), len(edits)) if edits else (text, 0)


def has_whole(text, value):
    v = escaped(value)
    return any(not g.raw and body(text, g) == v for g in groups(text))


def has_part(text, value):
    v = escaped(value)
    return any((value if g.raw else v) in body(text, g) for g in groups(text))


# ---------------------------------------------------------------- edits

class Edit:
    def __init__(self, kind, files, old, new, where, post):
        self.kind, self.files, self.old, self.new, self.where, self.post = kind, files, old, new, where, post


def value_of(line):
    v = line
    if v.startswith('|'): v = v[1:]
    if v.endswith('|'): v = v[:-1]
    return v.replace('\\n', '\n')


def parse(path):
    edits, rules, tables = [], [], collections.defaultdict(list)
    section, files, here, pending, post = None, [], False, None, False
    lines = open(path, encoding='utf-8').read().split('\n')
    i = 0
    while i < len(lines):
        line = lines[i]; i += 1
        where = '%s:%d' % (os.path.basename(path), i)
        if not line.strip() or line.startswith('#'): continue
        if line.startswith('@@@'): section, here = 'rules', False; continue
        if line.startswith(('@@ ', '@@+ ')):
            section = 'files'; files = line[3:].split(); post = line.startswith('@@+'); here = files[-1] == 'here'
            if here: files.pop()
            continue
        if line.startswith('@'): section = line[1:].strip(); continue
        if section in ('faults', 'causes', 'inhibits'):
            tables[section].append(([c.strip() for c in line.split(' | ')], where)); continue
        if line.startswith('<<<<'):
            old, new, to = [], [], 'old'
            while not lines[i].startswith('>>>>'):
                if lines[i].startswith('===='): to = 'new'
                else: (old if to == 'old' else new).append(lines[i])
                i += 1
            i += 1
            edits.append(Edit('code', files, '\n'.join(old), '\n'.join(new), where, post)); continue
        mark, rest = line[0], line[2:]
        if mark in '-~=rc': pending = (mark, rest, where)
        elif mark == '+':
            mark, old, where = pending
            old, new = (old, rest) if mark in 'rc' else (value_of(old), value_of(rest))
            if section == 'rules': rules.append((mark, old, new, where))
            else:
                edits.append(Edit({'-': 'whole', '~': 'part', '=': 'plain', 'r': 'regex'}[mark], files, old, new, where, post))
                if mark == '-' and not here and not post and is_distinct(old): rules.append(('-', old, new, where))
        else: sys.exit('%s: %r is not understood' % (where, line))
    return edits, rules, tables


def is_distinct(text):
    return len(text.split()) >= 3 and len(text.strip()) >= 16


# ---------------------------------------------------------------- rows of the three tables

FAULTS, ADVICE, PERMISSION = 'daemon/core/faults/fault_table.cpp', 'daemon/shell/status/advice.cpp', 'daemon/core/contactors/permission.cpp'


def literal_behind(text, at):
    return next(g for g in groups_from(text, at))


def groups_from(text, at):
    for g in groups(text):
        if g.start >= at: yield g


def unescape(b):
    return b.replace('\\n', '\n').replace('\\"', '"').replace('\\\\', '\\')


def set_literal(text, at, new, rules, where):
    g = literal_behind(text, at)
    old = unescape(body(text, g))
    if old == new: return text
    rules.append(('-', old, new, where))
    cap = lambda s: s[0].upper() + s[1:]
    if cap(old) != old: rules.append(('-', cap(old), cap(new), where))       # the headings and sentences of the pages
    return text[:g.start] + literal(escaped(new)) + text[g.end:]


def apply_tables(tables, read, write, rules, missing, keep):
    t = read(FAULTS)
    for (cells, where) in tables['faults']:
        ident, meaning, remedy = (cells + ['', ''])[:3]
        at = t.find('{.id = FaultId::%s,' % ident)
        if at < 0: missing.append('%s: no row of %s' % (where, ident)); continue
        for key, new in (('meaning', meaning), ('remedy', remedy)):
            if not new: continue
            k = t.index('.%s =' % key, at)
            g = literal_behind(t, k)
            keep.append((key, ident, unescape(body(t, g)), new))
            t = set_literal(t, k, new, rules, where)
    write(FAULTS, t)
    t = read(ADVICE)
    for (cells, where) in tables['causes']:
        ident, cause = cells
        at = t.find('{FaultId::%s,' % ident)
        if at < 0: missing.append('%s: no cause of %s' % (where, ident)); continue
        keep.append(('cause', ident, unescape(body(t, literal_behind(t, at))), cause))
        t = set_literal(t, at, cause, rules, where)
    p = read(PERMISSION)
    for (cells, where) in tables['inhibits']:
        ident, name, meaning, action = (cells + ['', '', ''])[:4]
        if name:
            at = p.find('case Blocker::%s:' % ident)
            if at < 0: missing.append('%s: no blocker %s' % (where, ident)); continue
            keep.append(('inhibit', ident, unescape(body(p, literal_behind(p, at))), name))
            p = set_literal(p, at, name, rules, where)
        at = t.find('{Blocker::%s,' % ident)
        g = literal_behind(t, at)
        if meaning:
            keep.append(('inhibit meaning', ident, unescape(body(t, g)), meaning))
            t = set_literal(t, at, meaning, rules, where)
        if action:
            g = literal_behind(t, at)
            keep.append(('inhibit action', ident, unescape(body(t, literal_behind(t, g.end))), action))
            t = set_literal(t, g.end, action, rules, where)
    write(ADVICE, t); write(PERMISSION, p)


# ---------------------------------------------------------------- what follows the texts

# their texts are descriptions of their own
NO_FOLLOWERS = ('tests/fuzz/corpora/', 'tests/catalogue/', 'tests/meta/', 'tests/ci/', 'tests/mutation/', 'tests/nightly', 'docs/reaction-times.md',
                'tests/rig/service_disk.sh', 'docs/requirements', 'docs/decisions/')
TEST_NAME = re.compile(r'\b(?:TEST_CASE|SCENARIO|SECTION|DYNAMIC_SECTION|BENCHMARK)\s*\(\s*')
GENERATED_PAGES = {'docs/faults.md'}
GENERATED_PART = re.compile(r'<!-- begin of .*?<!-- end of ', re.S)


def follows(f):
    if f in SKIP or f.endswith(BINARY) or f.startswith(NO_FOLLOWERS): return None
    if f.startswith(PRODUCT) and f.endswith(lexcxx.CXX): return None
    if f.startswith(PRODUCT) and not f.startswith('config/') and not f.endswith('.md'): return None
    if f.endswith(lexcxx.CXX): return 'cxx' if f.startswith('tests/') else None
    if f.endswith('.md'): return 'page'
    if f.startswith(('tests/', 'vcan-fixtures/', 'packaging/', 'systemd/', 'docs/', 'config/')):
        return 'text'
    return None


class Rules:
    def __init__(self, rules):
        literal_rules, seen = {}, {}
        self.conflicts = []
        self.regex = []
        for mark, old, new, where in rules:
            if mark in 'rc': self.regex.append((re.compile(old), new, where, mark)); continue
            if old == new: continue
            if old in literal_rules and literal_rules[old] != new:
                self.conflicts.append((old, literal_rules[old], new, where)); continue
            literal_rules[old] = new; seen[old] = where
        self.literal = literal_rules
        self.pattern = None
        if literal_rules:
            alternatives = '|'.join(self.word(o) for o in sorted(literal_rules, key=lambda o: (-len(o), o)))
            self.pattern = re.compile(alternatives)
        self.count = collections.Counter()

    @staticmethod
    def word(old):
        """No letter may go on before or behind it."""
        before = r'(?<![A-Za-z0-9_])' if re.match(r'\w', old) else ''
        behind = r'(?![A-Za-z0-9_])' if re.search(r'\w$', old) else ''
        return before + re.escape(old) + behind

    def sub(self, text, is_script=False):
        """The text with all rules applied."""
        if self.pattern:
            text = self.pattern.sub(self.take, text)
        for pattern, new, where, mark in self.regex:
            if is_script and mark == 'c': continue
            text, n = pattern.subn(new, text)
            if n: self.count[where] += n
        return text

    def take(self, m):
        old = m.group(0)
        self.count[old] += 1
        return self.literal[old]


def common_edit(old, new):
    """(at, length, replacement): the smallest part that differs."""
    a = 0
    while a < min(len(old), len(new)) and old[a] == new[a]: a += 1
    b = 0
    while b < min(len(old), len(new)) - a and old[-1 - b] == new[-1 - b]: b += 1
    return a, len(old) - a - b, new[a:len(new) - b]


def follow_cxx(text, rules):
    edits = []
    names = [m.end() for m in TEST_NAME.finditer(text)]
    name_starts = set(names)
    for g in groups(text):
        if g.start in name_starts: continue
        b = body(text, g)
        if g.raw:
            n = rules.sub(b)
            if n != b: edits.append(raw_edit(text, g, n))
            continue
        new = escape_keep(rules, b)
        if new == b: continue
        edits += renewed(text, g, piecewise(g, b, new))
    return apply_edits(text, edits) if edits else text


def raw_edit(text, g, new):
    """A raw string ends at the first )DELIMITER": another delimiter if the new text has it."""
    prefix = text[g.start:g.pieces[0][0]]                       # R"delim(
    delim = prefix[prefix.index('"') + 1:-1]
    if ')' + delim + '"' not in new: return g.pieces[0][0], g.pieces[0][1], new
    return g.start, g.end, prefix[:prefix.index('"') + 1] + 'json(' + new + ')json"'


def renewed(text, g, edits):
    """The edits of one group; the group as a whole if its pieces are no lines any more, or a line of several lines is too long."""
    pieces = []
    for s, e in g.pieces:
        piece = text[s:e]
        for a, b, n in sorted((x for x in edits if s <= x[0] and x[1] <= e and not (x[0] == e and x[1] == e and (s, e) != g.pieces[-1])), reverse=True):
            piece = piece[:a - s] + n + piece[b - s:]
        pieces.append(piece)
    has_comment = any('//' in text[a[1] + 1:b[0] - 1] or '/*' in text[a[1] + 1:b[0] - 1] for a, b in zip(g.pieces, g.pieces[1:]))
    if has_comment or any(re.search(r'\\x|\\[0-7]', p) for p in pieces): return edits
    are_lines = all(p.endswith('\\n') for p in pieces[:-1])
    column = lambda s: s - text.rfind('\n', 0, s)
    is_long = any(column(s) + len(p) > 118 and '\\n' in p[:-2] for (s, _), p in zip(g.pieces, pieces))
    if are_lines and not is_long: return edits
    return [(g.start, g.end, literal(''.join(pieces)))]


def escape_keep(rules, b):
    """Applies the rules to an escaped body."""
    plain = b.replace('\\"', '\x01').replace('\\n', '\n').replace('\\\\', '\x02')
    back = lambda t: t.replace('\\', '\\\\') if False else t
    plain = plain.replace('\x01', '"').replace('\x02', '\\') if '\\' not in plain else None
    if plain is None:                      # other escapes: only rules that have no need of them
        p = b.replace('\\"', '"').replace('\\n', '\n')
        n = rules.sub(p)
        return n.replace('\n', '\\n').replace('"', '\\"') if n != p else b
    n = rules.sub(plain)
    return escaped(n) if n != plain else b


def piecewise(g, old, new):
    import difflib
    edits = []
    sm = difflib.SequenceMatcher(None, tokens(old), tokens(new), autojunk=False)
    a, b = tokens(old), tokens(new)
    pos = [0]
    for t in a: pos.append(pos[-1] + len(t))
    for op, i1, i2, j1, j2 in sm.get_opcodes():
        if op == 'equal': continue
        edits += part_edits(g, pos[i1], pos[i2] - pos[i1], ''.join(b[j1:j2]))
    return edits


def tokens(s):
    return re.findall(r'\\.|\w+|\s|.', s)


def part_edits(g, at, length, new):
    edits, pos, first = [], 0, True
    for s, e in g.pieces:
        n = e - s
        a, b = max(at, pos), min(at + length, pos + n)
        if a < b or (length == 0 and first and pos <= at < pos + n) or (length == 0 and first and (s, e) == g.pieces[-1]):
            edits.append((s + a - pos if length else s + at - pos, s + b - pos if length else s + at - pos, new if first else ''))
            first = False
        pos += n
    return edits


FENCE = re.compile(r'^([ \t]*)(`{3,}|~{3,})[^\n]*\n.*?^[ \t]*\2[ \t]*$', re.S | re.M)
SPAN = re.compile(r'(`+)(?!`)(.+?)(?<!`)\1(?!`)', re.S)
QUOTED = re.compile(r'"[^"\n]{8,}"')


def follow_page(f, text, rules):
    if f in GENERATED_PAGES: return rules.sub(text)
    out, pos = [], 0
    def prose(t):
        t = SPAN.sub(lambda m: m.group(1) + rules.sub(m.group(2)) + m.group(1), t)
        return QUOTED.sub(lambda m: rules.sub(m.group(0)), t)
    whole = sorted([m.span() for m in FENCE.finditer(text)] + [m.span() for m in GENERATED_PART.finditer(text)])
    for s, e in whole:
        if s < pos: continue
        out.append(prose(text[pos:s])); out.append(rules.sub(text[s:e])); pos = e
    out.append(prose(text[pos:]))
    return ''.join(out)


def follow_text(f, text, rules):
    if not f.endswith('.expected') and not f.endswith('.json') and not f.endswith(('.1', '.5', '.7', '.8')):
        return '\n'.join(l if l.lstrip().startswith('#') else rules.sub(l, True) for l in text.split('\n'))
    if f.endswith('.json'):
        return re.sub(r'"(?:[^"\\\n]|\\.)*"', lambda m: escape_json(rules, m.group(0)), text)
    return rules.sub(text)


def escape_json(rules, token):
    p = token[1:-1].replace('\\"', '"')
    n = rules.sub(p)
    return token if n == p else '"' + n.replace('"', '\\"') + '"'


# ---------------------------------------------------------------- main

def main():
    a = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    a.add_argument('--root', default='.'); a.add_argument('--dry-run', action='store_true'); a.add_argument('--only')
    a.add_argument('--no-format', action='store_true'); a.add_argument('--verbose', action='store_true')
    o = a.parse_args()
    root = os.path.abspath(o.root)
    cache, changed = {}, set()

    def read(f):
        if f not in cache: cache[f] = open(os.path.join(root, f), encoding='utf-8', newline='').read()
        return cache[f]

    def write(f, t):
        if cache.get(f) != t: cache[f] = t; changed.add(f)

    edits, rules, tables, missing = [], [], collections.defaultdict(list), []
    for name in sorted(os.listdir(os.path.join(HERE, 'texts'))):
        if not name.endswith('.txt') or (o.only and o.only not in name): continue
        e, r, t = parse(os.path.join(HERE, 'texts', name))
        edits += e; rules += r
        for k, v in t.items(): tables[k] += v

    done = applied = 0
    keep = []
    apply_tables(tables, read, write, rules, missing, keep)
    def perform(those):
        nonlocal done, applied
        for e in those:
            for f in e.files:
                if not os.path.isfile(os.path.join(root, f)): missing.append('%s: no file %s' % (e.where, f)); continue
                t = read(f)
                if e.kind == 'whole':
                    new, n = edit_whole(t, e.old, e.new); is_done = has_whole(t, e.new)
                elif e.kind == 'part':
                    new, n = edit_part(t, e.old, e.new, True); is_done = has_part(t, e.new)
                elif e.kind == 'regex':
                    new, n = re.subn(e.old, e.new, t); is_done = False
                else:
                    n = t.count(e.old); new = t.replace(e.old, e.new); is_done = e.new in t
                    if e.kind == 'code' and n > 1: missing.append('%s: %d times in %s: %s' % (e.where, n, f, e.old[:60])); continue
                    if e.kind == 'code' and is_done and e.old in e.new: n = 0; new = t
                if n: write(f, new); applied += 1
                elif is_done: done += 1
                else: missing.append('%s: not in %s: %s' % (e.where, f, e.old[:100]))

    perform(e for e in edits if not e.post)
    all_rules = Rules(rules)
    for c in all_rules.conflicts: print('conflict %s: %r\n    one: %r\n    two: %r' % (c[3], c[0], c[1], c[2]))
    names = subprocess.run(['git', '-C', root, 'ls-files', '-z'], capture_output=True, check=True).stdout.decode().split('\0')
    followed = 0
    for f in names:
        kind = follows(f) if f else None
        p = os.path.join(root, f)
        if not kind or os.path.islink(p) or not os.path.isfile(p): continue
        try: t = read(f)
        except UnicodeDecodeError: continue
        new = follow_cxx(t, all_rules) if kind == 'cxx' else follow_page(f, t, all_rules) if kind == 'page' else follow_text(f, t, all_rules)
        if new != t: write(f, new); followed += 1

    perform(e for e in edits if e.post)
    print('%d edits applied, %d already done, %d files changed (%d followed), %d missing' % (applied, done, len(changed), followed, len(missing)))
    for m in missing: print('  ' + m)
    if o.verbose:
        for k, n in sorted(all_rules.count.items()): print('%5d  %s' % (n, k))
    if o.dry_run: return 1 if missing else 0
    for f in changed: open(os.path.join(root, f), 'w', encoding='utf-8', newline='').write(cache[f])
    cxx = sorted(f for f in changed if f.endswith(lexcxx.CXX))
    if cxx and not o.no_format:
        for k in range(0, len(cxx), 40): subprocess.run(['clang-format', '-i'] + cxx[k:k + 40], cwd=root, check=True)
    return 1 if missing else 0


if __name__ == '__main__':
    sys.exit(main())
