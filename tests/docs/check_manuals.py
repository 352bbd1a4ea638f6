#!/usr/bin/env python3
"""What man shows of the manual pages where they are installed, at 80 columns: without a warning, no table wider than that, and with
links and names that lead to what is installed, too.

    check_manuals.py BUILD_DIRECTORY
    check_manuals.py --root DIRECTORY     what is installed there
"""
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

COLUMNS = 80
COMPONENTS = ("bmud", "bmud-tools", "mmusim")
# Pages of docs/ that are manuals under another name.
MANUAL_OF_PAGE = {"configuration": "bmud-pack", "socket-protocol": "bmud-socket"}
MADE_OF_PAGES = {"bmud-pack.5", "bmud-socket.7"}


def shown(manual, columns):
    """Text and warnings."""
    run = subprocess.run(["man", "--warnings", "--local-file", manual], env={**os.environ, "MANWIDTH": str(columns), "LC_ALL": "C.UTF-8"},
                         stdin=subprocess.DEVNULL, capture_output=True, text=True, check=True)
    return re.sub(r".\x08", "", run.stdout), run.stderr


def commands_of(page):
    """Those in the page's table of commands."""
    table = re.search(r"^\| command \|.*\n\|[-|]*\n((?:\|.*\n)*)", page.read_text(), re.MULTILINE)
    return re.findall(r"^\| `(\w+)` \|", table.group(1), re.MULTILINE) if table else []


def targets_of(text):
    return re.findall(r"<([^<>\s]*[/.][^<>\s]*)>", text)


def problems_of_links(text, root, names):
    for target in targets_of(text):
        stem = Path(target).stem
        if re.match(r"https?:", target):
            continue
        if MANUAL_OF_PAGE.get(stem, stem) in {name.rpartition(".")[0] for name in names}:
            yield f"found a link to {target}, expected the manual's name"
        elif not target.startswith("/") or not (root / target[1:]).exists():
            yield f"found a link to {target}, which is not installed"
    for name, section in re.findall(r"\b(bmu[a-z-]*|mmusim)\((\d)\)", text, re.IGNORECASE):
        if f"{name.lower()}.{section}" not in names:
            yield f"found {name}({section}), which is not installed"


def problems_of(manual, root, names):
    own = manual.name.removesuffix(".gz")
    text, warnings = shown(manual, COLUMNS)
    yield from (f"man warns: {line}" for line in warnings.splitlines())
    wide = [line for line in text.splitlines() if len(line) > COLUMNS and re.match(r" *[│┌├└]", line)]
    if wide:
        yield f"found {len(wide)} lines of tables wider than {COLUMNS} columns, the first: {wide[0].strip()}"
    # Nothing is broken over lines there.
    one_line_each, _ = shown(manual, 5000)
    yield from problems_of_links(one_line_each, root, names)
    yield from (f"found {target} broken over two lines" for target in targets_of(one_line_each) if f"<{target}>" not in text)
    see_also = re.search(r"^SEE ALSO\n((?: .*\n)+)", one_line_each, re.MULTILINE)
    named = {f"{name}.{section}" for name, section in re.findall(r"([\w.-]+)\((\d)\)", see_also.group(1))} if see_also else set()
    if len(named - {own}) < 2:
        yield "found no section SEE ALSO that names two others"
    if own == "bmud-socket.7":
        commands = [command for page in root.glob("**/doc/bmud/docs/socket-protocol.md") for command in commands_of(page)]
        if len(commands) < 10:
            yield f"found {len(commands)} commands on the page, expected a table of them"
        for command in commands:
            if not re.search(rf"^ +{command}\n +right: ", text, re.MULTILINE):
                yield f"the command {command} is not in a list, with its right below it"


def install(build, root):
    for component in COMPONENTS:
        subprocess.run(["cmake", "--install", build, "--component", component], env={**os.environ, "DESTDIR": str(root)},
                       stdout=subprocess.DEVNULL, check=True)


def check(root):
    manuals = sorted(root.glob("**/man/man?/*.gz"))
    names = {manual.name.removesuffix(".gz") for manual in manuals}
    if not MADE_OF_PAGES <= names and not shutil.which("lowdown"):
        print("skipped: no lowdown here, which makes manual pages of docs/")
        return 77
    found = [f"{name} is not installed" for name in sorted(MADE_OF_PAGES - names)]
    found += [f"{manual.name}: {problem}" for manual in manuals for problem in problems_of(manual, root, names)]
    print("\n".join(found) or f"{len(manuals)} manuals show well at {COLUMNS} columns and lead to nothing that is not there")
    return 1 if found else 0


def main():
    if not shutil.which("man"):
        print("skipped: no man here")
        return 77
    if sys.argv[1] == "--root":
        return check(Path(sys.argv[2]).resolve())
    with tempfile.TemporaryDirectory() as root:
        install(sys.argv[1], root)
        return check(Path(root).resolve())


if __name__ == "__main__":
    sys.exit(main())
