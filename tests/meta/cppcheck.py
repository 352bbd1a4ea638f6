#!/usr/bin/env python3
"""cppcheck finds nothing in what is shipped: warnings, what costs time, what another platform takes otherwise.

Each source file by itself, with our headers and without those of others. What need not be mended stands with its reason in
cppcheck.suppressions, a file that cppcheck cannot read in cppcheck.unreadable: it ends with a signal, or says that it does not
understand. That is no "nothing found". Either entry has to go once it is not needed any more.

cppcheck 2.10 does not know that 10ms is a number: it is given a copy of the sources in which such numbers have no unit. Lines and columns
are the same.

A file in which it found nothing is looked at again only after something has changed that this depends on: the file, a header of ours that
it includes, the version of cppcheck, this script. tests/ci/verdicts.py keeps that.

usage: tests/meta/cppcheck.py [--again] [FILE...]     without files: all; --again: whatever is kept
"""

import concurrent.futures
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "tests/ci"))
sys.dont_write_bytecode = True

from verdicts import Verdicts, sum_of_file, version_of  # noqa: E402  of that folder

HERE = pathlib.Path(__file__).resolve().parent
FOLDERS = ["config", "daemon", "devices", "mmu", "protocol", "tools"]
JOBS = 2
COMMAND = [
    "cppcheck", "--quiet", "--language=c++", "--std=c++20", "--inline-suppr", "--enable=warning,performance,portability", "-I.",
    "--template={file}:{line}: {severity}: {message} [{id}]", "--template-location=",
]
INCLUDED = re.compile(r'^[ \t]*#[ \t]*include[ \t]*"([^"\n]+)"', re.MULTILINE)
FINDING = re.compile(r"^(.+?):(\d+): (\w+): (.*) \[(\w+)\]$")
NOT_UNDERSTOOD = {"cppcheckError", "internalAstError", "internalError", "syntaxError", "unknownMacro"}
# Not within a text, where "%8s" is none.
CHRONO = re.compile(r"""("(?:[^"\\\n]|\\.)*")|(?<![\w.'])(\d[\d']*)(ns|us|ms|s|min|h)\b""")
# It must find this, or it finds nothing at all.
PROBE = "int probe() {\n  int two[2] = {0, 0};\n  return two[2];\n}\n"
PROBE_ID = "arrayIndexOutOfBounds"


def sources():
    listed = subprocess.run(["git", "-C", ROOT, "ls-files", "--cached", "--others", "--exclude-standard", *FOLDERS], check=True, capture_output=True, text=True).stdout
    # One that is deleted but not yet committed is not there.
    return [name for name in listed.split() if name.endswith((".cpp", ".hpp")) and (ROOT / name).is_file()]


def copy(names, folder):
    for name in names:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(CHRONO.sub(lambda found: found[1] or found[2] + " " * len(found[3]), (ROOT / name).read_text()))


def look(name, folder):
    """Findings as (file, line, text, id), and why it could not be read, or ""."""
    done = subprocess.run([*COMMAND, name], cwd=folder, capture_output=True, text=True)
    findings = []
    why = f"ended with {done.returncode}" if done.returncode != 0 else ""
    for line in (done.stdout + done.stderr).splitlines():
        found = FINDING.match(line)
        if not found:
            why = why or f"said: {line}"
        elif found[5] in NOT_UNDERSTOOD:
            why = why or line
        else:
            findings.append((found[1], int(found[2]), f"{found[3]}: {found[4]}", found[5]))
    return findings, why


def included(name, found):
    """Adds to `found` that file and what it includes of ours, whatever the conditions, and what is not there."""
    if name in found:
        return
    found.add(name)
    path = ROOT / name
    if not path.is_file():
        return
    for header in INCLUDED.findall(path.read_text()):
        beside = (pathlib.PurePath(name).parent / header).as_posix()
        included(beside if (ROOT / beside).is_file() else header, found)


def depends_on(name, common):
    """A line for each thing that cppcheck's verdict about the file depends on."""
    found = set()
    included(name, found)
    return [*common, name, *(f"{file} {sum_of_file(str(ROOT / file))}" if (ROOT / file).is_file() else f"{file} is not there" for file in sorted(found))]


class KeptLooks:
    """Looks at files, but not at one in which nothing was found before. To be made before the files are copied."""

    def __init__(self, names, again):
        self._verdicts = Verdicts("cppcheck")
        self._common = [*version_of(COMMAND[0]), *COMMAND, sum_of_file(__file__)]
        self._lines = {name: depends_on(name, self._common) for name in names}
        self._again = again
        self.known = 0

    def look(self, name, folder):
        kept = self._verdicts.path(self._lines[name])
        if kept.exists() and not self._again:
            kept.touch()
            self.known += 1
            return [], ""
        findings, why = look(name, folder)
        # Not if a file was edited meanwhile.
        sum_of_file.cache_clear()
        if not findings and not why and depends_on(name, self._common) == self._lines[name]:
            kept.touch()
        return findings, why

    def remove_old(self):
        self._verdicts.remove_old()


def entries(file, count):
    """What stands in a list: the words before the reason, each with its line."""
    path = HERE / file
    result = {}
    for number, line in enumerate(path.read_text().splitlines(), start=1):
        if not line.strip() or line.startswith("#"):
            continue
        parts = line.split(None, count)
        if len(parts) != count + 1:
            sys.exit(f"{file}:{number}: wanted {count} words and the reason")
        result[tuple(parts[:count])] = number
    return result


def main():
    everything = sources()
    arguments = sys.argv[1:]
    again = "--again" in arguments
    chosen = [name for name in arguments if name != "--again"]
    names = chosen or [name for name in everything if name.endswith(".cpp")]
    suppressed = entries("cppcheck.suppressions", 2)
    unreadable = entries("cppcheck.unreadable", 1)
    problems = set()
    used = set()
    kept = KeptLooks(names, again)
    with tempfile.TemporaryDirectory(prefix="bmud-cppcheck.") as place:
        folder = pathlib.Path(place)
        copy(everything, folder)
        (folder / "probe.cpp").write_text(PROBE)
        if [finding[3] for finding in look("probe.cpp", folder)[0]] != [PROBE_ID]:
            sys.exit("cppcheck.py: cppcheck does not find what is wrong with a file made for it; is it there, and is it 2.10 or newer?")
        with concurrent.futures.ThreadPoolExecutor(JOBS) as pool:
            looks = dict(zip(names, pool.map(lambda name: kept.look(name, folder), names)))
    kept.remove_old()
    for name, (findings, why) in looks.items():
        is_listed = (name,) in unreadable
        if why and not is_listed:
            problems.add(f"{name}: cppcheck cannot read it ({why}); put it so that it can, or name it in cppcheck.unreadable")
        if not why and is_listed:
            problems.add(f"cppcheck.unreadable:{unreadable[(name,)]}: {name} can be read; take the line away")
        for file, line, text, identifier in findings:
            if (identifier, file) in suppressed:
                used.add((identifier, file))
            else:
                problems.add(f"{file}:{line}: {text} [{identifier}]")
    if not chosen:
        for identifier, file in suppressed.keys() - used:
            problems.add(f"cppcheck.suppressions:{suppressed[(identifier, file)]}: no {identifier} in {file}; take the line away")
        for (name,), number in unreadable.items():
            if name not in looks:
                problems.add(f"cppcheck.unreadable:{number}: there is no {name}")
    print("\n".join(sorted(problems)) or f"{len(names)} files, {kept.known} of them known: nothing found")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
