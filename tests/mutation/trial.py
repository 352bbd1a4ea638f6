"""Builds a copy of the project with all mutants in it, learns which tests reach which, and tries each on those."""

from __future__ import annotations

import hashlib
import html
import math
import os
import re
import subprocess
import time
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

# Not the catalogue: every survivor would run all of it, a minute each.
PROGRAMS = ("test_unit", "test_scenario")
# Test cases run together for about so long: most mutants fail at what takes next to no time. The last batch is all that is left.
BATCHES_S = (0.1, 0.5, 2, 8)
# Those that noticed mutants nearby are a batch before these, of each program.
NEAR_S = 0.5
CPU_MIN_S = 3  # seconds of computing time that a run of some test cases may take, or so many times the usual
CPU_FACTOR = 10
WAIT_MAX_S = 600


class TrialError(Exception):
    """The copy does not build, or its tests fail without a mutant."""


@dataclass
class TestCase:
    program: str
    name: str
    took_s: float
    reaches: set[int]


@dataclass
class Reach:
    """What each test case reaches. What was reached before the first one belongs to all of its program."""

    cases: list[TestCase] = field(default_factory=list)
    before: dict[str, set[int]] = field(default_factory=dict)

    def cases_for(self, mutant: int) -> list[TestCase]:
        """The quick ones first."""
        found = [each for each in self.cases if mutant in each.reaches or mutant in self.before[each.program]]
        return sorted(found, key=lambda each: each.took_s)


def run(command: list[str], what: str) -> None:
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode != 0:
        raise TrialError(f"{what} failed with {done.returncode}:\n{done.stdout[-6000:]}")


def copy_project(root: Path, tree: Path, instead: dict[str, bytes]) -> None:
    """All files of the project, those in `instead` with that content. What is the same already keeps its time, so that
    the next build is a short one."""
    listed = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        cwd=root,
        stdout=subprocess.PIPE,
        check=True,
    )
    wanted = [name for name in listed.stdout.decode().split("\0") if name and (root / name).is_file()]
    for name in wanted:
        content = instead.get(name) or (root / name).read_bytes()
        target = tree / name
        if target.is_file() and target.read_bytes() == content:
            continue
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(content)
        target.chmod((root / name).stat().st_mode)
    for path in tree.rglob("*"):
        if path.is_file() and str(path.relative_to(tree)) not in wanted:
            path.unlink()


def build(tree: Path, folder: Path, jobs: int) -> None:
    # Warnings would be about what the mutants make of the sources. An index out of range must not go unnoticed.
    flags = "-O1 -g0 -w -Wno-narrowing -D_GLIBCXX_ASSERTIONS"
    configure = ["cmake", "-S", str(tree), "-B", str(folder), "-G", "Ninja", "-DCMAKE_BUILD_TYPE=None", "-DBMUD_PRECOMPILE=OFF"]
    run(configure + ["-DCMAKE_CXX_COMPILER=clang++", f"-DCMAKE_CXX_FLAGS={flags}"], "configuring the copy")
    command = ["cmake", "--build", str(folder), "--parallel", str(jobs), "--target", *PROGRAMS]
    run(command, "building the copy with all mutants in it")


# The names are read from standard input, a line each: together they are longer than a word of a command line may be.
CHOOSE = ["--input-file", "/dev/stdin"]


def _chosen(names: list[str]) -> str:
    """What Catch2 takes for "these test cases"."""
    return "".join('"' + re.sub(r'([\\,\["*~])', r"\\\1", name) + '"\n' for name in names)


def _names_of(program: Path) -> list[str]:
    """All test cases but those that take minutes, which reach nothing that the others do not."""
    # Catch2 2 has the first way, Catch2 3 the second; the status of the first is the number of names.
    for listing in (["--list-test-names-only"], ["--list-tests", "--verbosity", "quiet"]):
        done = subprocess.run([str(program), *listing, "~[slow]"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        if names := [line.strip() for line in done.stdout.splitlines() if line.strip()]:
            return names
    raise TrialError(f"{program}: lists no test cases")


def _checksum_of(paths: Iterable[Path]) -> str:
    each = "".join(f"{path} {hashlib.sha256(path.read_bytes()).hexdigest()}\n" for path in paths)
    return hashlib.sha256(each.encode()).hexdigest()


def _learn_of(tree: Path, folder: Path, name: str) -> Path:
    """The record of a run in which each test case was chosen by its name and passed: otherwise a mutant might seem killed by what it did
    not cause, or survive because nothing ran. It counts for as long as program, record and the files of the copy, which test cases read,
    are the same."""
    program, record, state = folder / "bin" / name, folder / f"{name}.reach", folder / f"{name}.learned"

    def checksum() -> str:
        return _checksum_of([program, record, *sorted(path for path in tree.rglob("*") if path.is_file())])

    if record.is_file() and state.is_file() and state.read_text() == checksum():
        return record
    names = _names_of(program)
    record.unlink(missing_ok=True)
    done = subprocess.run(
        [str(program), *CHOOSE],
        env=dict(os.environ, BMU_MUTANT_RECORD=str(record)),
        input=_chosen(names),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    if done.returncode != 0 or not record.is_file():
        raise TrialError(f"{name} fails without any mutant, status {done.returncode}:\n{done.stdout[-6000:]}")
    missing = set(names) - {line.split("\t")[0] for line in record.read_text().splitlines()}
    if missing:
        raise TrialError(f"{name}: chosen by name, these do not run: {sorted(missing)}")
    state.write_text(checksum())
    return record


def learn_reach(tree: Path, folder: Path) -> Reach:
    reach = Reach()
    with ThreadPoolExecutor(max_workers=len(PROGRAMS)) as pool:
        records = list(pool.map(lambda program: _learn_of(tree, folder, program), PROGRAMS))
    for program, record in zip(PROGRAMS, records):
        for line in record.read_text().splitlines():
            name, took_s, ids = line.split("\t")
            reaches = {int(number) for number in ids.split()}
            if name:
                reach.cases.append(TestCase(program, name, float(took_s), reaches))
            else:
                reach.before[program] = reaches
    return reach


def _take(cases: list[TestCase], limit_s: float) -> list[TestCase]:
    """As many of the first as take no longer than that together; they are taken out."""
    taken: list[TestCase] = []
    while cases and sum(each.took_s for each in taken) + cases[0].took_s <= limit_s:
        taken.append(cases.pop(0))
    return taken


def _batches(cases: list[TestCase], first: str | None, near: Sequence[str] = (), only_quick: bool = False) -> list[list[TestCase]]:
    """Each of one program; `first` by itself, those of `near`, then all others, the quick ones first; of these only so many as fit into
    BATCHES_S."""
    batches = [[each] for each in cases if each.name == first]
    of_program = {program: [each for each in cases if each.program == program and each.name != first] for program in PROGRAMS}
    for own in of_program.values():
        batches.append(_take(sorted((each for each in own if each.name in near), key=lambda each: near.index(each.name)), NEAR_S))
    tried = {id(each) for batch in batches for each in batch}
    rest = [[each for each in own if id(each) not in tried] for own in of_program.values()]
    for limit_s in BATCHES_S if only_quick else (*BATCHES_S, math.inf):
        batches += [_take(own, limit_s) for own in rest]
    return [batch for batch in batches if batch]


def _failing(folder: Path, batch: list[TestCase], mutant: int) -> str | None:
    """The name of the test case that fails, also if it crashes, or computes without end: what counts is its own time, however busy the
    machine is. None if all pass."""
    limit_s = max(CPU_MIN_S, math.ceil(CPU_FACTOR * sum(each.took_s for each in batch)))
    program = str(folder / "bin" / batch[0].program)
    try:
        done = subprocess.run(
            ["prlimit", f"--cpu={limit_s}", program, "--abort", "--reporter", "xml", *CHOOSE],
            input=_chosen([each.name for each in batch]).encode(),
            env=dict(os.environ, BMU_MUTANT=str(mutant)),
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            timeout=WAIT_MAX_S,
        )
    except subprocess.TimeoutExpired as waited:
        raise TrialError(f"mutant {mutant}: {program} neither ends nor computes within {WAIT_MAX_S} s") from waited
    return None if done.returncode == 0 else last_case(done.stdout) or batch[0].name


def last_case(report: bytes) -> str | None:
    """The name of the test case that began last: with --abort the one that failed. A program that was ended may not have written all."""
    names = re.findall(rb'<TestCase name="([^"]*)"', report)
    return html.unescape(names[-1].decode(errors="replace")) if names else None


def killer(
    folder: Path, reach: Reach, mutant: int, first: str | None = None, near: Sequence[str] = (), only_quick: bool = False
) -> str | None:
    """The name of a test case that fails with it; None if all pass that reach it, or with `only_quick` the quick ones of these. The case
    named `first` is tried first, then those named in `near`."""
    for batch in _batches(reach.cases_for(mutant), first, near, only_quick):
        name = _failing(folder, batch, mutant)
        if name is not None:
            return name
    return None


class Stopwatch:
    def __init__(self) -> None:
        self._started_at = time.monotonic()

    def passed_s(self) -> float:
        return time.monotonic() - self._started_at

    def __str__(self) -> str:
        return f"{self.passed_s():.0f} s"
