"""Puts the folders' rules into tests/meta/layers.py; run once, behind the splits."""
import pathlib, re
p = pathlib.Path("tests/meta/layers.py")
s = p.read_text()
def rep(a, b):
    global s
    assert s.count(a) == 1, (a, s.count(a))
    s = s.replace(a, b)
rep('''The arrows of the folders are held for every source file; each header of the product is included by somebody; each source of it is compiled.
''', '''The arrows of the folders are held for every source file; each header of the product is included by somebody; each source of it is compiled;
no folder has more than 25 sources, and each of the product's has a README.md of at most 12 lines.
''')
rep('''INCLUDE = re.compile''', '''# The folders within a part, the lowest first: each may include what stands before its own entry, and what the part may. What
# lies in the part's own folder may include all of them.
ORDERS = {
    "daemon/core": ["cell", "types", "measurement", "modules", "estimation/soc", "estimation/health", "estimation", "limits plausibility", "faults", "contactors",
                    "vehicle balancing charging", "records"],
    "daemon/shell": ["system", "cli can gpio json state", "recorder serial", "status"],
    "mmu": ["devices", "plant", "scenario"],
    "config": ["json types", "fields", "cell_file", "checks"],
    "tools/bmucell": ["data", "fit"],
    "tools/bmudump": ["identify"],
}
for part, lines in ORDERS.items():
    lower = []
    for line in lines:
        folders = [f"{part}/{name}" for name in line.split()]
        LAYERS.update({folder: [*LAYERS[part], *lower] for folder in folders})
        lower += folders
SOURCES_MAX = 25
README_LINES_MAX = 12
WITH_README = ("config", "daemon", "mmu", "protocol", "tools")
INCLUDE = re.compile''')
rep('''def main():
''', '''def wrong_folders(sources):
    counts = collections.Counter(str(pathlib.PurePath(path).parent) for path in sources if path.endswith(".cpp"))
    for folder, count in sorted(counts.items()):
        if count > SOURCES_MAX:
            yield f"{folder}: found {count} sources, wanted at most {SOURCES_MAX}"
    for folder in sorted({str(pathlib.PurePath(path).parent) for path in sources}):
        if not folder.startswith(WITH_README):
            continue
        page = ROOT / folder / "README.md"
        if not page.exists() or len(page.read_text().splitlines()) > README_LINES_MAX:
            yield f"{folder}: wanted a README.md of at most {README_LINES_MAX} lines: what lives here, what it may include, where to start reading"


def main():
''')
rep('''    problems += unused(sources)
''', '''    problems += [*unused(sources), *wrong_folders(sources)]
''')
rep("import pathlib\nimport re", "import collections\nimport pathlib\nimport re")
p.write_text(s)
