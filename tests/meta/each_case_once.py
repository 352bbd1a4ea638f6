#!/usr/bin/python3
"""Every test case of the Catch2 programs in a build folder is run by one test of ctest, and by one only.

A case that no test chooses never runs, and nothing else would say so: a source whose name is not that of its tag, a tag that two
selections leave out. One that two tests choose takes its time twice.

  tests/meta/each_case_once.py BUILD_FOLDER

Exit status: 0 each once; 1 not so, with the names; 2 the folder has no such tests, or a program does not list its cases.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections import Counter, defaultdict
from pathlib import Path

PROGRAM = re.compile(r"test_(unit|scenario|catalogue|property|simulation|integration|golden)")


class NoList(Exception):
    """What should be compared cannot be read."""


def listed(program: str, words: list[str]) -> list[str]:
    """The names of the cases that these words choose. Catch2 ends with their number as exit status."""
    command = [program, *words, "--list-test-names-only"]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False)
    if done.returncode < 0 or done.stderr:
        raise NoList(f"{' '.join(command)}: found status {done.returncode} and '{done.stderr.strip()[:200]}', expected names of cases")
    # A name that begins with # is printed in quotes.
    return [line.strip().strip('"') for line in done.stdout.splitlines() if line.strip()]


def chosen(program: str, words: list[str]) -> list[str]:
    """The same for the words of a test. A name by itself, as discovered tests have, needs no process."""
    is_name = len(words) == 1 and not re.search(r"(?<!\\)[\[,]|\*", words[0])
    return [re.sub(r"\\(.)", r"\1", words[0])] if is_name else listed(program, words)


def has_label(test: dict, label: str) -> bool:
    return any(label in each["value"] for each in test.get("properties", []) if each["name"] == "LABELS")


def commands(folder: Path) -> dict[str, list[list[str]]]:
    """By program: the words of each test that runs it. Those of the emulated machine give a case what it has recorded, and do not count."""
    command = ["ctest", "--test-dir", str(folder), "--show-only=json-v1"]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
    result: dict[str, list[list[str]]] = defaultdict(list)
    for test in json.loads(done.stdout)["tests"]:
        program, *words = test.get("command") or [""]
        if PROGRAM.fullmatch(Path(program).name) and not has_label(test, "rig"):
            result[program].append(words)
    return result


def chosen_by_all(program: str, tests: list[list[str]]) -> Counter[str]:
    """How many tests run each case. Sources are asked for together: a case is in one source only, and a process takes long to start."""
    of_sources = Counter(words[1] for words in tests if len(words) == 2 and words[0] == "--filenames-as-tags")
    counts = Counter(listed(program, ["--filenames-as-tags", ",".join(of_sources)]) if of_sources else [])
    for again in (of_sources - Counter(dict.fromkeys(of_sources, 1))).elements():
        counts.update(listed(program, ["--filenames-as-tags", again]))
    for words in tests:
        if words[:1] != ["--filenames-as-tags"]:
            counts.update(chosen(program, words))
    return counts


def complaints(program: str, tests: list[list[str]]) -> list[str]:
    # Catch2 leaves out by default what has a name or tag that begins with a dot: such cases are run by name, or not at all.
    there = set(listed(program, ["*"]))
    counts = chosen_by_all(program, tests)
    name = Path(program).name
    return (
        [f"{name}: no test runs '{case}'" for case in sorted(there - counts.keys())]
        + [f"{name}: {counts[case]} tests run '{case}'" for case in sorted(there) if counts[case] > 1]
        + [f"{name}: a test runs '{case}', which is not there" for case in sorted(counts.keys() - there)]
    )


def main() -> int:
    if len(sys.argv) != 2 or sys.argv[1].startswith("-"):
        print(__doc__)
        return 0 if sys.argv[1:] in (["-h"], ["--help"]) else 2
    by_program = commands(Path(sys.argv[1]))
    if not by_program:
        raise NoList(f"{sys.argv[1]}: found no test of a Catch2 program, expected some (has it been built?)")
    wrong = [line for program in sorted(by_program) for line in complaints(program, by_program[program])]
    print("\n".join(wrong) or f"each case once: {', '.join(sorted(Path(each).name for each in by_program))}")
    return 1 if wrong else 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except NoList as error:
        print(f"each_case_once.py: {error}", file=sys.stderr)
        sys.exit(2)
