#!/usr/bin/env python3
"""Applies renames.tsv to a checkout: word-exact, per scope, longest name first.

  rename.py --root CHECKOUT --dry-run                          counts, nothing is written
  rename.py --root CHECKOUT --kind identifier,type --folder daemon/core,tests
  rename.py --root CHECKOUT --kind fault_id --only link_not_following

What is touched:
  type, identifier   words of C++ code; in comments and pages only names that cannot be English (a_b, AbCd, or name(),
                     Name::), in pages none that is a string literal of the product, too (a key, a word of a script);
                     never in string literals and scripts. Owner::name is an enumerator: renamed inside its
                     enum, behind Owner::, in files with `using enum Owner`.
  fault_id, event_id like an enumerator of FaultId, EventId; in strings, comments, pages, JSON, tables: as a whole word
  *_key, recording_word, history_column, option, can_signal
                     in string literals if the literal, a "quoted" part or a /part/ of a path is the name; in pages,
                     JSON and scripts if it is quoted, in backticks or part of a path. can_signal: everywhere
  file               git mv (within its folder), and the name in #include, CMake, scripts and pages
Rows with status "hand" are left, but for --hand (then name them with --only: they are no rules for all files).
Files with NUL bytes, *.zst, *.gz and, without --corpora, tests/fuzz/corpora are never touched.
"""
import argparse, collections, os, re, subprocess, sys
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), 'lib'))
import lexcxx

HERE = os.path.dirname(os.path.abspath(__file__))
BINARY = ('.zst', '.gz', '.png', '.ico')
KEEP = ('docs/glossary.md', 'CHANGELOG.md')
KEYS = {'json_key', 'config_key', 'state_key', 'recording_word', 'history_column', 'option', 'json_value'}
IDS = {'fault_id': 'FaultId', 'event_id': 'EventId'}


class Rule:
    def __init__(self, line):
        c = line.rstrip('\n').split('\t')
        self.kind, scope, self.old, self.new, self.at = c[:5]
        self.status = c[6] if len(c) > 6 else 'mechanical'
        self.scope = scope
        p = scope.split(',')
        self.no = tuple(x[1:] for x in p if x.startswith('-'))
        self.yes = tuple(x for x in p if x and not x.startswith('-') and x != '*')
        self.owner = None
        self.word = self.old
        if self.kind in IDS: self.owner = IDS[self.kind]
        elif self.kind in ('identifier', 'type') and '::' in self.old:
            self.owner, self.word = self.old.rsplit('::', 1)
            self.owner = self.owner.replace('(anon)::', '')
        self.count = collections.Counter()

    def applies(self, f):
        return not f.startswith(self.no) if self.no and not self.yes else (f.startswith(self.yes) if self.yes else True)

    @property
    def distinct(self):
        w = self.word.strip('_')
        return '_' in w or len(re.findall(r'[A-Z][a-z0-9]+', w)) > 1 or bool(re.search(r'[a-z][A-Z]', w))


def load(path, kinds, only, hand):
    rules = [Rule(l) for l in open(path, encoding='utf-8') if l.strip() and not l.startswith('#')]
    return [r for r in rules if (not kinds or r.kind in kinds) and (not only or r.old in only) and (hand or r.status == 'mechanical')]


def files(root, corpora):
    out = subprocess.run(['git', '-C', root, 'ls-files', '-z'], capture_output=True, check=True).stdout.decode()
    for f in out.split('\0'):
        if not f or f.endswith(BINARY) or f in KEEP: continue
        if f.startswith('tests/fuzz/corpora/') and not corpora: continue
        p = os.path.join(root, f)
        if os.path.islink(p) or not os.path.isfile(p): continue
        yield f


FILE_NAME = r'(?!\.(?:hpp|cpp|md|py|sh|json|scn|log|txt|expected)\b)(?!_test\b)'      # the name of a file: kind file


def alternation(words):
    return re.compile(r'(?<![\w])(?:' + '|'.join(re.escape(w) for w in sorted(words, key=lambda w: (-len(w), w))) + r')(?![\w])' + FILE_NAME) if words else None


class File:
    all_rules = None
    interface = frozenset()

    def __init__(self, rules, f):
        self.f = f
        self.plain, self.enum, self.ids, self.keys, self.signals = {}, collections.defaultdict(list), {}, {}, {}
        for r in rules:
            if not r.applies(f): continue
            if r.kind in IDS: self.ids[r.word] = r; self.enum[r.word].append(r)
            elif r.kind in ('identifier', 'type'):
                if r.owner: self.enum[r.word].append(r)
                else: self.plain[r.word] = r
            elif r.kind in KEYS: self.keys[r.old] = r
            elif r.kind == 'can_signal': self.signals[r.old] = r
        self.id_pattern = alternation(self.ids.keys() | self.signals.keys())
        self.key_pattern = re.compile(r'(?<![\w.-])(?:' + '|'.join(re.escape(w) for w in sorted(self.keys, key=lambda w: (-len(w), w))) + r')(?![\w-])') if self.keys else None
        # in pages and scripts a name that is a string literal of the product, too, is a key or a word of an interface
        distinct = {w for w, r in self.plain.items() if r.distinct and (f.endswith(lexcxx.CXX) or w not in self.interface)}
        self.text_pattern = alternation(distinct)
        code = {w for w, r in self.plain.items() if not r.distinct and (f.endswith(lexcxx.CXX) or w not in self.interface)}
        self.code_pattern = re.compile(r'(?<![\w])(' + '|'.join(re.escape(w) for w in sorted(code, key=lambda w: (-len(w), w))) + r')(?=\(\)|::)|(?<=`)(' + '|'.join(re.escape(w) for w in sorted(code, key=lambda w: (-len(w), w))) + r')(?=`)') if code else None
        qualified = {r.owner.split('::')[-1] + '::' + w: r for w, rs in self.enum.items() for r in rs}
        self.qualified = qualified
        self.qual_pattern = alternation(qualified.keys())

    def hit(self, r, where): r.count[where] += 1; return r.new.rsplit('::', 1)[-1]

    # ---- text that is not code: comments, pages, scripts
    def prose(self, s, where):
        if self.id_pattern: s = self.id_pattern.sub(lambda m: self.hit(self.ids.get(m.group(0)) or self.signals[m.group(0)], where), s)
        if where == 'script': return self.key_text(s, where, False)
        if self.qual_pattern: s = self.qual_pattern.sub(lambda m: m.group(0).rsplit('::', 1)[0] + '::' + self.hit(self.qualified[m.group(0)], where), s)
        if self.text_pattern: s = self.text_pattern.sub(lambda m: self.hit(self.plain[m.group(0)], where), s)
        if self.code_pattern: s = self.code_pattern.sub(lambda m: self.hit(self.plain[m.group(0)], where), s)
        return self.key_text(s, where, False)

    def key_text(self, s, where, whole):
        """Keys that are quoted, in backticks, or part of a path; of a literal: the whole of it."""
        if not self.key_pattern: return s
        def one(m):
            a, b = s[max(0, m.start() - 1):m.start()], s[m.end():m.end() + 1]
            r = self.keys[m.group(0)]
            if r.kind == 'option': ok = True
            elif whole and m.start() == 0 and m.end() == len(s): ok = True
            else:
                ok = (a in ('"', '`', "'", '/') or s[max(0, m.start() - 2):m.start()] == '\\"' ) and (b in ('"', '`', "'", '/', '\\', '') or b in (':', ' ', ',') and a == '/')
                if a == '/' and b not in ('"', '`', "'", '/', '\\') and not whole and b != '': ok = ok and r.kind == 'config_key'
            return self.hit(r, where) if ok else m.group(0)
        return self.key_pattern.sub(one, s)

    def literal(self, s):
        raw = re.match(r'((?:u8|u|U|L)?R"([^()\\\s]{0,16})\()(.*)(\)\2")$', s, re.S)
        if raw: head, body, tail = raw.group(1), raw.group(3), raw.group(4)
        else:
            q = s.index('"'); head, body, tail = s[:q + 1], s[q + 1:-1], '"'
        if self.id_pattern: body = self.id_pattern.sub(lambda m: self.hit(self.ids.get(m.group(0)) or self.signals[m.group(0)], 'string'), body)
        return head + self.key_text(body, 'string', True) + tail

    # ---- C++
    def cxx(self, text):
        toks = [(lexcxx.kind_of(m), m.start(), m.end()) for m in lexcxx.TOKEN.finditer(text)]
        out, last = [], 0
        words = [(text[a:b], a, b) for k, a, b in toks if k == 'word']
        bodies = []          # (owner, start, end) of enum bodies
        for m in re.finditer(r'\benum\s+(?:class\s+|struct\s+)?([A-Za-z_]\w*)\s*(?::[^{;]*)?\{', text):
            depth, e = 1, m.end()
            while e < len(text) and depth:
                depth += {'{': 1, '}': -1}.get(text[e], 0); e += 1
            bodies.append((m.group(1), m.end(), e))
        using = set(re.findall(r'\busing\s+enum\s+(?:[\w:]*::)?(\w+)\s*;', text))
        alias = {a: b for a, b in re.findall(r'\busing\s+(\w+)\s*=\s*(?:[\w]+::)*(\w+)\s*;', text)}
        prev = {}
        for i in range(1, len(words)):
            if re.fullmatch(r'\s*::\s*', text[words[i - 1][2]:words[i][1]]): prev[words[i][1]] = words[i - 1][0]
        for k, a, b in toks:
            s = text[a:b]
            t = s
            if k == 'word':
                q = prev.get(a)
                done = False
                for r in self.enum.get(s, ()):
                    last_name = r.owner.split('::')[-1]
                    if q is not None and (q == last_name or alias.get(q) == last_name): t = self.hit(r, 'code'); done = True; break
                    if q is None and any(o == last_name and x <= a < y for o, x, y in bodies): t = self.hit(r, 'code'); done = True; break
                    if q is None and last_name in using: t = self.hit(r, 'code'); done = True; break
                if not done:
                    r = self.plain.get(s) or self.signals.get(s)
                    if r and q != 'std' and q != 'views' and q != 'ranges':
                        inside = [o for o, x, y in bodies if x <= a < y]
                        # an enumerator of another enum keeps its name if a rule of its own gives another
                        t = self.hit(r, 'code')
            elif k in ('string', 'raw'): t = self.literal(s)
            elif k == 'comment': t = self.prose(s, 'comment')
            if t != s: out.append(text[last:a]); out.append(t); last = b
        out.append(text[last:])
        return ''.join(out)

    def run(self, text):
        if self.f.endswith(lexcxx.CXX): return self.cxx(text)
        if self.f in ('tests/mutation/survivors.txt', 'tests/mutation/coverage_exceptions.txt'):    # lines of C++ by their text
            out, name = [], ''
            for l in text.split('\n'):
                k, _, v = l.partition(': ')
                if k == 'file': name = v
                if k in ('line', 'change', 'missing') and name and self.all_rules is not None: l = k + ': ' + File(self.all_rules, name).cxx(v)
                out.append(l)
            return '\n'.join(out)
        where = 'page' if self.f.endswith('.md') else 'script'
        return self.prose(text, where)


def rename_files(root, rules, folders, dry, corpora):
    rules = [r for r in rules if r.kind == 'file']
    if not rules: return
    moves = {}
    for r in rules:
        src = r.old if '/' in r.old else os.path.join(r.scope, r.old)
        dst = r.new if '/' in r.new else os.path.join(r.scope, r.new)
        if not os.path.exists(os.path.join(root, src)):      # moved to another folder meanwhile
            found = [f for f in files(root, False) if os.path.basename(f) == os.path.basename(r.old)]
            if len(found) == 1: src = found[0]; dst = os.path.join(os.path.dirname(src), os.path.basename(r.new)) if '/' not in r.new or True else dst
        if os.path.exists(os.path.join(root, src)): moves[src] = dst; r.count['moved'] += 1
        else: r.count['missing'] += 1
    names = {}
    for s, d in moves.items():
        a, b = os.path.basename(s), os.path.basename(d)
        names[s if '/' in s and a == b else a] = d if a == b else b
        if s.endswith('.hpp'):     # its source and the test of the unit follow
            sa, sb = a[:-4], b[:-4]
            for f in files(root, False):
                base = os.path.basename(f)
                if base == sa + '.cpp' and os.path.dirname(f) == os.path.dirname(s): moves.setdefault(f, os.path.join(os.path.dirname(f), sb + '.cpp')) if False else None; names.setdefault(base, sb + '.cpp'); moves2[f] = os.path.join(os.path.dirname(f), sb + '.cpp')
                if base == sa + '_test.cpp': names.setdefault(base, sb + '_test.cpp'); moves2[f] = os.path.join(os.path.dirname(f), sb + '_test.cpp')
                    
    moves.update({a: b for a, b in moves2.items() if a not in moves})
    pattern = re.compile(r'(?<![\w.-])(?:' + '|'.join(re.escape(w) for w in sorted(names, key=lambda w: -len(w))) + r')(?![\w-])')
    total = 0
    for f in files(root, corpora):
        if folders and not f.startswith(folders): continue
        data = open(os.path.join(root, f), 'rb').read()
        if b'\0' in data: continue
        text = data.decode('utf-8', 'surrogateescape')
        new, n = pattern.subn(lambda m: names[m.group(0)], text)
        if os.path.basename(f) == 'compiled_together.cmake':      # units of tests without _test.cpp
            stems = {os.path.splitext(os.path.basename(a))[0].removesuffix('_test'): os.path.splitext(os.path.basename(b))[0].removesuffix('_test') for a, b in moves.items() if a.endswith('_test.cpp')}
            def unit(m): return '"' + ' '.join(stems.get(w, w) for w in m.group(1).split(' ')) + '"'
            changed = re.sub(r'"([a-z0-9_ ]+)"', unit, new)
            n += changed != new; new = changed
        total += n
        if n and not dry: open(os.path.join(root, f), 'wb').write(new.encode('utf-8', 'surrogateescape'))
    for s, d in sorted(moves.items()):
        print('mv', s, d)
        if not dry:
            os.makedirs(os.path.join(root, os.path.dirname(d)), exist_ok=True)
            subprocess.run(['git', '-C', root, 'mv', s, d], check=True)
    print(len(moves), 'files,', total, 'mentions of their names')


moves2 = {}


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument('--root', required=True)
    p.add_argument('--table', default=os.path.join(HERE, 'renames.tsv'))
    p.add_argument('--kind', default='', help='comma-separated; default: all')
    p.add_argument('--folder', default='', help='only files whose path starts so, comma-separated')
    p.add_argument('--only', action='append', default=[], help='only this old name (as in the table); may be repeated')
    p.add_argument('--hand', action='store_true', help='rows with status "hand", too')
    p.add_argument('--corpora', action='store_true', help='tests/fuzz/corpora, too (text files)')
    p.add_argument('--dry-run', action='store_true')
    p.add_argument('--quiet', action='store_true', help='totals only')
    o = p.parse_args()
    rules = load(o.table, set(filter(None, o.kind.split(','))), set(o.only), o.hand)
    folders = tuple(filter(None, o.folder.split(',')))
    changed = 0
    text_rules = [r for r in rules if r.kind != 'file']
    cache = {}
    File.all_rules = text_rules
    literals = set()
    for f in files(o.root, False):
        if f.endswith(lexcxx.CXX) and not f.startswith('tests/'):
            literals.update(re.findall(r'"(\w+)"', open(os.path.join(o.root, f), encoding='utf-8', errors='replace').read()))
    File.interface = frozenset(literals)
    if text_rules:
        for f in files(o.root, o.corpora):
            if folders and not f.startswith(folders): continue
            path = os.path.join(o.root, f)
            data = open(path, 'rb').read()
            if b'\0' in data: continue
            key = tuple(i for i, r in enumerate(text_rules) if r.applies(f))
            if key not in cache: cache[key] = File(text_rules, f)
            cache[key].f = f
            text = data.decode('utf-8', 'surrogateescape')
            new = cache[key].run(text)
            if new != text:
                changed += 1
                if not o.dry_run: open(path, 'wb').write(new.encode('utf-8', 'surrogateescape'))
    total = collections.Counter()
    for r in rules:
        total.update(r.count)
        if not o.quiet and r.kind != 'file': print('%-14s %-44s %-44s %s' % (r.kind, r.old, r.new, ' '.join('%s:%d' % kv for kv in sorted(r.count.items())) or '-'))
    rename_files(o.root, rules, folders, o.dry_run, o.corpora)
    print('%d rules, %d without effect, %d files %s; %s' % (len(rules), sum(1 for r in rules if not r.count), changed, 'would change' if o.dry_run else 'changed',
                                                         ', '.join('%s %d' % kv for kv in sorted(total.items()))))


if __name__ == '__main__':
    main()
