"""compare_commands.py BEFORE_ROOT BEFORE_BUILD AFTER_ROOT AFTER_BUILD: the same objects with the same flags, moves aside."""
import collections, json, re, sys, pathlib
HERE = pathlib.Path(__file__).resolve().parent
moves = dict(l.split("\t") for l in (HERE / "moves.tsv").read_text().splitlines())
def commands(root, build, map_):
    found = collections.Counter()
    unity = {}
    for e in json.load(open(f"{build}/compile_commands.json")):
        file = e["file"]
        words = e["command"].split(" -o ")
        target = re.search(r"CMakeFiles/([\w-]+)\.dir", e["command"]).group(1)
        flags = words[0].replace(root, "ROOT").replace(build, "BUILD")
        files = [file]
        if "/Unity/" in file:
            files = re.findall(r'#include "([^"]+)"', open(file).read())
        names = sorted(map_(f.replace(root + "/", "").replace(build + "/", "BUILD/")) for f in files)
        flags = re.sub(r"\S*/cmake_pch\S*", "PCH", flags)
        flags = re.sub(r"(BUILD/)?\S*CMakeFiles/\S*", "OUT", flags)
        found[target, " ".join(names), flags] += 1
    return found
a = commands(sys.argv[1], sys.argv[2], lambda f: moves.get(f, f))
b = commands(sys.argv[3], sys.argv[4], lambda f: f)
print(sum(a.values()), "before", sum(b.values()), "after")
for name, only in (("before", a - b), ("after", b - a)):
    for (t, n, f) in sorted(only):
        print("only", name, t, n[:200], f[-160:])
