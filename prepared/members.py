#!/usr/bin/env python3
"""Renames the hand rows of renames.tsv (Owner::member) exactly, by libclang's references instead of words.

  members.py --root CHECKOUT collect EDITS.tsv SOURCE...    parses these sources, appends file, offset, old, new
  members.py --root CHECKOUT apply EDITS.tsv                writes all of them at once; the checkout must be as collected

Collect with all sources that can see the member (tests, too) before anything is applied; several processes may collect into
files of their own. Members that depend on a template parameter are not resolved: the compiler finds those afterwards. Macro
arguments (BMU_FIELDS, CHECK) are: their cursors are at the place where they are written.
"""
import argparse, collections, os, sys
sys.path.insert(0, '/usr/lib/python3/dist-packages')
HERE = os.path.dirname(os.path.abspath(__file__))


def wanted(table):
    names = collections.defaultdict(dict)      # member -> {owner's last name or '': new}
    for l in open(table):
        if l.startswith('#'): continue
        c = l.rstrip('\n').split('\t')
        if c[0] not in ('identifier', 'type') or c[6] != 'hand' or '::' not in c[2]: continue
        owners, member = c[2].rsplit('::', 1)
        for owner in owners.split('/'):
            names[member][owner.split('::')[-1]] = c[3].rsplit('::', 1)[-1]
    return names


def collect(root, out, sources):
    import clang.cindex as ci
    ci.Config.set_library_file('/usr/lib/llvm-14/lib/libclang.so.1')
    names = wanted(os.path.join(HERE, 'renames.tsv'))
    index = ci.Index.create()
    args = ['-std=c++20', '-I' + root, '-I' + os.path.join(root, 'build/generated'), '-DBMUD_VERSION="0"']
    seen = set()
    done = set()
    with open(out, 'a') as f:
        for source in sources:
            tu = index.parse(os.path.join(root, source), args=args)
            errors = [d.spelling for d in tu.diagnostics if d.severity >= 3]
            if errors: print(source, len(errors), 'errors:', errors[0])
            stack = [c for c in tu.cursor.get_children() if c.location.file and os.path.abspath(c.location.file.name).startswith(root + '/')]
            while stack:
                c = stack.pop()
                stack.extend(c.get_children())
                name = c.spelling
                if name not in names: continue
                r = c.referenced if c.referenced is not None else c
                parent = r.semantic_parent
                new = names[name].get(parent.spelling if parent is not None else '')
                if new is None or r.spelling != name: continue
                l = c.location
                if l.file is None: continue
                path = os.path.abspath(l.file.name)
                if not path.startswith(root + '/'): continue
                e = (os.path.relpath(path, root), l.offset, name, new)
                if e in seen: continue
                seen.add(e)
                text = open(path, 'rb').read()
                if text[l.offset:l.offset + len(name)] != name.encode():      # ~Name, operator, in a macro's body
                    print('not at its place: %s:%d %s' % (e[0], l.line, name)); continue
                f.write('\t'.join(map(str, e)) + '\n')
            done.add(source)
    print(len(done), 'sources,', len(seen), 'places')


def apply(root, edits):
    by = collections.defaultdict(dict)
    for l in open(edits):
        path, offset, old, new = l.rstrip('\n').split('\t')
        by[path].setdefault(int(offset), (old, new))
    n = 0
    for path, es in by.items():
        data = open(os.path.join(root, path), 'rb').read()
        for offset in sorted(es, reverse=True):
            old, new = (x.encode() for x in es[offset])
            assert data[offset:offset + len(old)] == old, (path, offset, old)
            data = data[:offset] + new + data[offset + len(old):]; n += 1
        open(os.path.join(root, path), 'wb').write(data)
    print(n, 'places in', len(by), 'files')


p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
p.add_argument('--root', required=True); p.add_argument('what', choices=['collect', 'apply']); p.add_argument('edits'); p.add_argument('sources', nargs='*')
o = p.parse_args()
o.root = os.path.abspath(o.root)
collect(o.root, o.edits, o.sources) if o.what == 'collect' else apply(o.root, o.edits)
