#!/usr/bin/env python3
"""Who may include whom (docs/architecture.md), and that nothing lies about unused.

The arrows of the folders are held for every source file; each header of the product is included by somebody; each source of it is compiled;
no folder has more than 25 sources, each of the product's has a README.md of at most 12 lines, and tests/unit has the folders of what it tests.
What the pure parts may include of the standard library is purity.sh's business.
"""
import collections
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]

# What a folder may include besides itself. The longest that fits a file's path counts.
LAYERS = {
    "protocol": [],
    "devices": ["protocol"],
    "mmu": ["devices", "protocol", "daemon/core/types/core_config.hpp", "daemon/core/cell/cell_model.hpp"],
    "daemon/core": ["devices", "protocol"],
    "config": ["daemon/core", "devices", "protocol"],
    "daemon/history": ["daemon/core", "protocol"],
    "daemon/recording": ["config", "daemon/core", "protocol"],
    "daemon/shell": ["config", "daemon/core", "daemon/history", "daemon/recording", "devices", "protocol"],
    "tools/common": ["config", "daemon", "mmu", "protocol"],
    "tools/report": ["config", "daemon", "protocol", "tools/common"],
    "tools/bmucell": ["config", "daemon/core", "daemon/shell/cli", "daemon/shell/system/whole_file.hpp", "protocol", "tools/common"],
    "tools/bmuctl": ["daemon", "protocol", "tools/common", "tools/report"],
    "tools/bmudump": ["daemon/shell/can/bus_port.hpp", "daemon/shell/cli", "devices", "protocol", "tools/common"],
    "tools/bmureplay": ["config", "daemon", "protocol", "tools/common"],
    "tools/mmusim": ["config", "daemon", "mmu", "protocol", "tools/common"],
    # Tests may look at everything; nobody else looks at tests.
    "tests": ["config", "daemon", "devices", "mmu", "protocol", "tools"],
}
# The folders within a part, the lowest first: each may include what stands before its own entry, and what the part may. What
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
INCLUDE = re.compile(r'^#include "([^"]+)"', re.MULTILINE)
# What a device is, is included by the list that CMake makes of the folders.
DEVICE = re.compile(r"devices/(\w+)/\1\.hpp")


def is_below(path, folder):
    return path == folder or path.startswith(folder + "/")


def layer_of(path):
    fitting = [name for name in LAYERS if is_below(path, name)]
    return max(fitting, key=len) if fitting else None


def wrong_includes(path, text):
    layer = layer_of(path)
    if layer is None:
        yield f"{path}: belongs to no layer; name its folder in tests/meta/layers.py"
        return
    own = layer if "." not in layer else str(pathlib.PurePath(layer).parent)
    for included in INCLUDE.findall(text):
        beside = (ROOT / path).parent / included
        if "/" not in included and beside.exists():
            continue
        if not any(is_below(included, allowed) for allowed in [own, *LAYERS[layer]]):
            yield f"{path}: includes {included}, which {layer} may not"


def unused(sources):
    texts = "\n".join(sources.values())
    included = set(INCLUDE.findall(texts))
    lists = "\n".join(path.read_text() for path in ROOT.rglob("CMakeLists.txt") if "build" not in path.parts[len(ROOT.parts)])
    lists += "\n".join(path.read_text() for path in ROOT.rglob("*.cmake") if "build" not in path.parts[len(ROOT.parts)])
    globs = re.findall(r"/([\w/]*)\*(\w*)\.cpp", lists)
    for path in sources:
        name = pathlib.PurePath(path).name
        # What tests are made of is found by other means: some of it is compiled by scripts.
        if path.startswith("tests/"):
            continue
        is_included = path in included or name in included or DEVICE.fullmatch(path)
        if path.endswith(".hpp") and not is_included:
            yield f"{path}: nobody includes it"
        is_globbed = any(re.search(rf"(^|/){folder}[^/]*{end}\.cpp$", path) for folder, end in globs)
        if path.endswith(".cpp") and not is_globbed and not re.search(rf"[\s/]{re.escape(name)}\b", lists):
            yield f"{path}: no CMakeLists.txt compiles it"


def wrong_folders(sources):
    counts = collections.Counter(str(pathlib.PurePath(path).parent) for path in sources if path.endswith(".cpp"))
    for folder, count in sorted(counts.items()):
        if count > SOURCES_MAX:
            yield f"{folder}: found {count} sources, wanted at most {SOURCES_MAX}"
    for folder in sorted({str(pathlib.PurePath(path).parent) for path in sources}):
        tested = folder.removeprefix("tests/unit/")
        if tested != folder and not (ROOT / tested).is_dir() and not (ROOT / "tests" / tested).is_dir():
            yield f"{folder}: found no folder {tested} that this would test"
        if not folder.startswith(WITH_README):
            continue
        page = ROOT / folder / "README.md"
        if not page.exists() or len(page.read_text().splitlines()) > README_LINES_MAX:
            yield f"{folder}: wanted a README.md of at most {README_LINES_MAX} lines: what lives here, what it may include, where to start reading"


def main():
    listed = subprocess.run(["git", "-C", ROOT, "ls-files", "--cached", "--others", "--exclude-standard", "*.cpp", "*.hpp"], check=True, capture_output=True, text=True).stdout
    sources = {path: (ROOT / path).read_text() for path in listed.splitlines() if (ROOT / path).exists()}
    problems = [problem for path, text in sources.items() for problem in wrong_includes(path, text)]
    problems += [*unused(sources), *wrong_folders(sources)]
    for problem in problems:
        print(problem, file=sys.stderr)
    sys.exit(1 if problems else 0)


main()
