"""Builds a copy of the project with all mutants in it, learns which tests reach which, and tries each on those."""

from __future__ import annotations

import html
import math
import os
import re
import subprocess
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

# Not the catalogue: every survivor would run all of it, a minute each.
PROGRAMS = ("test_unit", "test_scenario")
# Test cases run together for about so long: most mutants fail at what takes next to no time. The last batch is all that is left.
BATCHES_S = (0.1, 0.5, 2, 8)
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


def _learn_of(folder: Path, program: str) -> Path:
    """A run of everything but what takes minutes; it reaches nothing that the others do not."""
    record = folder / f"{program}.reach"
    done = subprocess.run(
        [str(folder / "bin" / program), "~[slow]"],
        env=dict(os.environ, BMU_MUTANT_RECORD=str(record)),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    if done.returncode != 0:
        raise TrialError(f"{program} fails without any mutant:\n{done.stdout[-6000:]}")
    return record


def learn_reach(folder: Path) -> Reach:
    reach = Reach()
    with ThreadPoolExecutor(max_workers=len(PROGRAMS)) as pool:
        records = list(pool.map(lambda program: _learn_of(folder, program), PROGRAMS))
    for program, record in zip(PROGRAMS, records):
        for line in record.read_text().splitlines():
            name, took_s, ids = line.split("\t")
            reaches = {int(number) for number in ids.split()}
            if name:
                reach.cases.append(TestCase(program, name, float(took_s), reaches))
            else:
                reach.before[program] = reaches
    return reach


def _batches(cases: list[TestCase], first: str | None) -> list[list[TestCase]]:
    """Each of one program; `first` by itself, then all others, the quick ones first."""
    batches = [[each] for each in cases if each.name == first]
    rest = {program: [each for each in cases if each.program == program and each.name != first] for program in PROGRAMS}
    for limit_s in (*BATCHES_S, math.inf):
        for own in rest.values():
            batch: list[TestCase] = []
            while own and sum(each.took_s for each in batch) + own[0].took_s <= limit_s:
                batch.append(own.pop(0))
            batches += [batch] if batch else []
    return batches


# The names are read from standard input, a line each: together they are longer than a word of a command line may be.
CHOOSE = ["--input-file", "/dev/stdin"]


def _chosen(cases: list[TestCase]) -> str:
    """What Catch2 takes for "these test cases"."""
    return "".join('"' + re.sub(r'([\\,\["*~])', r"\\\1", each.name) + '"\n' for each in cases)


def _failing(folder: Path, batch: list[TestCase], mutant: int) -> str | None:
    """The name of the test case that fails, also if it crashes, or computes without end: what counts is its own time, however busy the
    machine is. None if all pass."""
    limit_s = max(CPU_MIN_S, math.ceil(CPU_FACTOR * sum(each.took_s for each in batch)))
    program = str(folder / "bin" / batch[0].program)
    try:
        done = subprocess.run(
            ["prlimit", f"--cpu={limit_s}", program, "--abort", "--reporter", "xml", *CHOOSE],
            input=_chosen(batch).encode(),
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


def killer(folder: Path, reach: Reach, mutant: int, first: str | None = None) -> str | None:
    """The name of a test case that fails with it; None if all pass that reach it. The case named `first` is tried first."""
    for batch in _batches(reach.cases_for(mutant), first):
        name = _failing(folder, batch, mutant)
        if name is not None:
            return name
    return None


def _check_selection_of(folder: Path, reach: Reach, program: str) -> None:
    own = [each for each in reach.cases if each.program == program]
    record = folder / f"{program}.chosen"
    record.unlink(missing_ok=True)
    done = subprocess.run(
        [str(folder / "bin" / program), *CHOOSE],
        env=dict(os.environ, BMU_MUTANT_RECORD=str(record)),
        input=_chosen(own),
        text=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    if done.returncode != 0 or not record.is_file():
        raise TrialError(f"{program} with all its test cases chosen by name: status {done.returncode}")
    ran = {line.split("\t")[0] for line in record.read_text().splitlines()} - {""}
    missing = [each.name for each in own if each.name not in ran]
    if missing:
        raise TrialError(f"{program}: chosen by name, these do not run: {missing}")


def check_selection(folder: Path, reach: Reach) -> None:
    """Every test case can be chosen by its name, and passes by itself: otherwise a mutant might seem killed by what is
    none of its doing, or survive because nothing ran."""
    with ThreadPoolExecutor(max_workers=len(PROGRAMS)) as pool:
        list(pool.map(lambda program: _check_selection_of(folder, reach, program), PROGRAMS))


class Stopwatch:
    def __init__(self) -> None:
        self._started_at = time.monotonic()

    def __str__(self) -> str:
        return f"{time.monotonic() - self._started_at:.0f} s"
