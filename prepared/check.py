#!/usr/bin/env python3
"""The includes between folders after moves.tsv (run in a checkout, before or after the moves).

    check.py [--root DIR]            figures, cycles, wrong arrows, sizes
    check.py --split FILE            the same as if the header splits of FILE were done
    check.py --why FOLDER FOLDER     the include lines from one folder to the other
"""
import argparse, collections, pathlib, re, subprocess, sys

HERE = pathlib.Path(__file__).resolve().parent
INCLUDE = re.compile(r'^#include "([^"]+)"', re.MULTILINE)
C, S, M, K = "daemon/core", "daemon/shell", "mmu", "config"


def below(order):
    """(folder, what it may include) of an order of ranks, the lowest first; those of one rank do not see each other."""
    rules, lower = {}, []
    for rank in order:
        for folder in rank:
            rules[folder] = list(lower)
        lower += rank
    return rules


CORE = below([[C + "/cell"], [C + "/types"], [C + "/measurement"], [C + "/modules"], [C + "/estimation/soc"], [C + "/estimation/health"],
              [C + "/estimation"], [C + "/limits", C + "/plausibility"], [C + "/faults"], [C + "/contactors"],
              [C + "/vehicle", C + "/balancing", C + "/charging"], [C + "/records"], [C]])
SHELL = below([[S + "/system"], [S + "/cli", S + "/can", S + "/gpio", S + "/json", S + "/state"], [S + "/recorder", S + "/serial"], [S + "/status"], [S]])
MMU = below([[M + "/devices"], [M + "/plant"], [M + "/scenario"]])
CONFIG = below([[K + "/json", K + "/types"], [K + "/fields"], [K + "/cell_file"], [K + "/checks"], [K]])
RULES = {**CORE, **SHELL, **MMU, **CONFIG}


def sources(root, moves):
    listed = subprocess.run(["git", "-C", root, "ls-files"], check=True, capture_output=True, text=True).stdout.splitlines()
    files = [f for f in listed if f.endswith((".cpp", ".hpp")) and (root / f).exists()]
    known = set(files)
    result = {}
    for f in files:
        found = []
        for i in INCLUDE.findall((root / f).read_text()):
            beside = str(pathlib.PurePath(f).parent / i)
            target = i if i in known else beside if beside in known else None
            if target:
                found.append(moves.get(target, target))
        result[moves.get(f, f)] = found
    return result


def folder(path):
    return str(pathlib.PurePath(path).parent)


def unit(path):
    return path.rsplit(".", 1)[0]


def node(path, top):
    """A unit right in `top`, or the folder in it that the file is below."""
    rest = path[len(top) + 1:]
    return top + "/" + rest.split("/")[0] if "/" in rest else unit(path)


def graph(includes, top):
    nodes, arrows = set(), set()
    for f, found in includes.items():
        if not f.startswith(top + "/"):
            continue
        nodes.add(node(f, top))
        for i in found:
            if i.startswith(top + "/") and node(i, top) != node(f, top):
                arrows.add((node(f, top), node(i, top)))
    return nodes, arrows


def components(nodes, arrows):
    """Strongly connected ones (Tarjan)."""
    out = collections.defaultdict(list)
    for a, b in arrows:
        out[a].append(b)
    index, low, stack, on, result = {}, {}, [], set(), []
    def visit(n):
        index[n] = low[n] = len(index)
        stack.append(n); on.add(n)
        for m in out[n]:
            if m not in index:
                visit(m); low[n] = min(low[n], low[m])
            elif m in on:
                low[n] = min(low[n], index[m])
        if low[n] == index[n]:
            part = []
            while True:
                m = stack.pop(); on.discard(m); part.append(m)
                if m == n:
                    break
            result.append(part)
    sys.setrecursionlimit(10000)
    for n in sorted(nodes):
        if n not in index:
            visit(n)
    return result


def levels(nodes, arrows):
    of = {n: number for number, part in enumerate(components(nodes, arrows)) for n in part}
    out = collections.defaultdict(set)
    for a, b in arrows:
        if of[a] != of[b]:
            out[of[a]].add(of[b])
    depth = {}
    def deep(n):
        if n not in depth:
            depth[n] = 1 + max((deep(m) for m in out[n]), default=0)
        return depth[n]
    return max((deep(n) for n in set(of.values())), default=0)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--root", type=pathlib.Path, default=pathlib.Path.cwd())
    parser.add_argument("--flat", action="store_true", help="without the moves")
    parser.add_argument("--why", nargs=2)
    options = parser.parse_args()
    moves = {} if options.flat else dict(line.split("\t") for line in (HERE / "moves.tsv").read_text().splitlines())
    includes = sources(options.root, moves)
    lines = collections.defaultdict(set)
    for f, found in includes.items():
        for i in found:
            lines[folder(f), folder(i)].add((f, i))
    if options.why:
        for f, i in sorted(lines[tuple(options.why)]):
            print(f"{f} -> {i}")
        return 0
    print("graph of units and folders: units, levels, arrows, in cycles")
    for top in [C, C + "/estimation" if not options.flat else C + "/estimators", S, M, K, "tools/report", "tools/bmudump", "tools/bmucell"]:
        nodes, arrows = graph(includes, top)
        cyclic = [p for p in components(nodes, arrows) if len(p) > 1]
        print(f"  {top:26} {len(nodes):3} {levels(nodes, arrows):3} {len(arrows):4}   {'; '.join(' '.join(sorted(n[len(top) + 1:] for n in p)) for p in cyclic)}")
    print("pairs of folders that include each other")
    pairs = sorted((a, b) for a, b in lines if a < b and (b, a) in lines and not (a.startswith("tests") or b.startswith("tests")))
    for a, b in pairs:
        print(f"  {a} ({len(lines[a, b])}) <-> {b} ({len(lines[b, a])})")
    wrong = 0
    print("arrows against the direction")
    for (a, b), found in sorted(lines.items()):
        if a == b or a not in RULES:
            continue
        same_part = any(a.startswith(t) and b.startswith(t) for t in (C, S, M, K))
        if same_part and b not in RULES[a]:
            wrong += 1
            for f, i in sorted(found):
                print(f"  {f} -> {i}")
    print(f"  {wrong} wrong arrows, {len(pairs)} pairs")
    print("folders: .cpp, .hpp")
    count = collections.defaultdict(lambda: [0, 0])
    for f in includes:
        count[folder(f)][f.endswith(".hpp")] += 1
    for f, (cpp, hpp) in sorted(count.items()):
        print(f"  {f:44} {cpp:3} {hpp:3}{'   MORE THAN 25' if cpp > 25 else ''}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
