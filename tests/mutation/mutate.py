#!/usr/bin/python3
"""Changes the safety files in every small way that a slip could, and sees whether some test notices.

Exit status: 0 if at least 95 % of the mutants are killed (of 200 or more) and every other is listed in survivors.txt with its reason, 1 if
not, or if a listed one is killed by a quick test, 2 if something is wrong with the run itself. It is 1 also if a listed one is no longer there: any run
sees that for all of files.txt, or for the named files. docs/decisions/0006 says more.

  tests/mutation/mutate.py                                    all of files.txt
  tests/mutation/mutate.py --file daemon/core/permission.cpp  one file, or several
  tests/mutation/mutate.py --since HEAD~1                     lines changed since then, in the working tree
  tests/mutation/mutate.py --part 2/3                         every third mutant, beginning with the second
  tests/mutation/mutate.py --since HEAD~1 --at-most 200 --turn 7   of more than 200 a part, the next one with the next number
  tests/mutation/mutate.py --since HEAD~1 --seconds 600       begins none later than that after the start; the verdict is on the tried ones
  tests/mutation/mutate.py --list                             names the mutants and tries none
  tests/mutation/mutate.py --prepare                          builds them and learns what reaches which, and tries none
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

try:
    import clang.cindex  # noqa: F401
except ModuleNotFoundError:
    sys.exit("mutate.py: needs libclang for Debian's own Python 3: tools/packages.sh mutation")

import blocks
import instrument
import kept_mutants
import killers
import mutants
import safety_files
import survivors
import trial
from mutants import Mutant
from survivors import Survivor

SCORE_MIN_PERMILLE = 950
# Of fewer mutants one listed survivor would be more than a twentieth.
SCORED_MIN = 200
PROGRESS_EVERY = 100
# Of what a run that is cut off has learnt, its next try makes use.
SAVE_EVERY = 20


def part(text: str) -> slice:
    match = re.fullmatch(r"([1-9]\d*)/([1-9]\d*)", text)
    if not match or int(match[1]) > int(match[2]):
        raise argparse.ArgumentTypeError(f"found '{text}', wanted K/N with K from 1 to N, as in 2/3")
    return slice(int(match[1]) - 1, None, int(match[2]))


def turn(count: int, at_most: int, number: int) -> slice:
    """Of so many, as few parts as there can be with no more than `at_most`; the part whose turn it is."""
    parts = max(1, -(-count // at_most))
    return slice(number % parts, None, parts)


def positive(text: str) -> int:
    if not re.fullmatch(r"[1-9]\d*", text):
        raise argparse.ArgumentTypeError(f"found '{text}', wanted a whole number above 0")
    return int(text)


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--file", action="append", default=[], help="only mutants of this file")
    parser.add_argument("--since", metavar="REV", help="only mutants of lines changed since this revision")
    parser.add_argument("--part", type=part, metavar="K/N", help="only every Nth mutant, beginning with the Kth")
    parser.add_argument("--at-most", type=positive, metavar="N", help="of more mutants one part of N or less")
    parser.add_argument("--turn", type=int, default=0, metavar="K", help="with --at-most: which part, counted round from 0")
    parser.add_argument("--seconds", type=positive, help="leave what has not begun so long after the start")
    parser.add_argument("--list", action="store_true", help="print the mutants and stop")
    parser.add_argument("--prepare", action="store_true", help="build, learn what reaches which mutant, and stop")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the results there, too")
    parser.add_argument("--work", type=Path, default=safety_files.ROOT / "build-mutation", help="folder for copy and build")
    parser.add_argument("--jobs", type=int, default=2)
    return parser.parse_args()


def changed_lines(root: Path, revision: str, files: Sequence[str]) -> dict[str, set[int]]:
    """By file, of these: lines of the working tree that the revision has not, or has otherwise. Other files need not be text."""
    command = ["git", "diff", "-U0", "--no-color", "--no-ext-diff", "--relative", revision, "--", *files]
    done = subprocess.run(command, cwd=root, stdout=subprocess.PIPE, text=True, check=True)
    result: dict[str, set[int]] = {}
    lines: set[int] = set()
    for line in done.stdout.splitlines():
        if line.startswith("+++ "):
            lines = result.setdefault(line.removeprefix("+++ ").removeprefix("b/"), set())
        elif match := re.match(r"@@ -\S+ \+(\d+)(?:,(\d+))? @@", line):
            first, count = int(match[1]), int(match[2] or 1)
            lines.update(range(first, first + count))
    return result


def chosen(found: list[Mutant], arguments: argparse.Namespace) -> list[Mutant]:
    if arguments.file:
        unknown = set(arguments.file) - {each.file for each in found}
        if unknown:
            raise safety_files.WrongList(f"--file {', '.join(sorted(unknown))}: not in files.txt, or nothing to mutate in it")
        found = [each for each in found if each.file in arguments.file]
    if arguments.since:
        changed = changed_lines(safety_files.ROOT, arguments.since, sorted({each.file for each in found}))
        found = [each for each in found if each.line in changed.get(each.file, set())]
    if arguments.at_most:
        found = found[turn(len(found), arguments.at_most, arguments.turn)]
    return found[arguments.part] if arguments.part else found


def text_of(mutant: Mutant) -> str:
    return f"{mutant.file}:{mutant.line}:{mutant.column}: {mutant.source}  [{mutant.change}]"


class Results:
    """The numbers of the killed mutants, of those that no test reaches, and of those that were left for lack of time."""

    def __init__(self) -> None:
        self.killed: set[int] = set()
        self.unreached: set[int] = set()
        self.left: set[int] = set()


def try_all(
    work: Path, wanted: list[Mutant], listed: list[Survivor], jobs: int, known: killers.Killers, is_late: Callable[[], bool]
) -> Results:
    """One that is listed meets the quick tests only: all of them take minutes for each, to learn of an entry that no longer holds, which
    hides nothing."""
    reach = trial.learn_reach(work / "tree", work / "build")
    results = Results()
    results.unreached = {each.id for each in wanted if not reach.cases_for(each.id)}

    def attempt(each: Mutant) -> str | None:
        if is_late():
            results.left.add(each.id)
            return None
        is_listed = any(entry.is_about(each) for entry in listed)
        return trial.killer(work / "build", reach, each.id, known.of(each), known.near(each), is_listed)

    with ThreadPoolExecutor(max_workers=jobs) as pool:
        for tried, (each, name) in enumerate(zip(wanted, pool.map(attempt, wanted)), start=1):
            if name is not None:
                results.killed.add(each.id)
                known.note(each, name)
            elif each.id not in results.left:
                print(f"mutate: not killed: {text_of(each)}", file=sys.stderr, flush=True)
            if tried % PROGRESS_EVERY == 0 and not results.left:
                print(f"mutate: {tried} of {len(wanted)} tried, {len(results.killed)} killed", file=sys.stderr, flush=True)
            if tried % SAVE_EVERY == 0:
                known.save()
    known.save()
    return results


def print_summary(wanted: list[Mutant], killed: set[int]) -> None:
    print(f"{'mutants':>8}{'killed':>8}{'survived':>10}{'score':>8}  file")
    files = list(dict.fromkeys(each.file for each in wanted))
    for name in [*files, "all"]:
        own = [each for each in wanted if name in (each.file, "all")]
        count = sum(each.id in killed for each in own)
        print(f"{len(own):8}{count:8}{len(own) - count:10}{100 * count / max(len(own), 1):7.1f}%  {name}")


def gone(listed: list[Survivor], found: list[Mutant], files: Sequence[str]) -> list[str]:
    """Complaints about entries without a mutant among all that were found, of these files; of all if none is named."""
    there = {(each.file, each.source, each.change) for each in found}
    return [
        f"survivors.txt lists a mutant that is not there: {each}"
        for each in listed
        if (not files or each.file in files) and (each.file, each.line, each.change) not in there
    ]


def complaints(wanted: list[Mutant], killed: set[int], unreached: set[int], listed: list[Survivor]) -> list[str]:
    result = []
    for mutant in wanted:
        entries = [each for each in listed if each.is_about(mutant)]
        if mutant.id in killed and entries:
            result.append(f"survivors.txt lists a mutant that is killed: {text_of(mutant)}")
        elif mutant.id not in killed and not entries:
            why = "reached by no test" if mutant.id in unreached else "survived"
            result.append(f"{why}: {text_of(mutant)}")
    if len(wanted) >= SCORED_MIN and len(killed) * 1000 < SCORE_MIN_PERMILLE * len(wanted):
        result.append(f"killed {len(killed)} of {len(wanted)}, wanted at least {SCORE_MIN_PERMILLE / 10:g} %")
    return result


def write_json(path: Path, wanted: list[Mutant], killed: set[int], unreached: set[int]) -> None:
    def outcome(mutant: Mutant) -> str:
        return "killed" if mutant.id in killed else "unreached" if mutant.id in unreached else "survived"

    rows = [dict(vars(each), outcome=outcome(each)) for each in wanted]
    path.write_text(json.dumps({"mutants": len(wanted), "killed": len(killed), "rows": rows}, indent=1) + "\n")


def main() -> int:
    arguments = parse_arguments()
    watch = trial.Stopwatch()
    sources, found = kept_mutants.find(safety_files.ROOT, safety_files.safety_files(), arguments.work)
    wanted = chosen(found, arguments)
    if arguments.list:
        print("\n".join(text_of(each) for each in wanted))
        return 0
    listed = survivors.read(safety_files.HERE / "survivors.txt")
    # Whatever part of the mutants is tried: all of them are known.
    wrong = gone(listed, found, arguments.file)
    if not wanted:
        print("\n".join([*wrong, "mutate: nothing to mutate"]))
        return 1 if wrong else 0
    # Parts of all mutants share one build, and what is learnt with it.
    if arguments.since or arguments.file:
        sources = instrument.narrowed(sources, {each.id for each in wanted})
    constants = [constant for source in sources for constant in source.constants]
    instead = {source.file: instrument.instrumented(source, constants) for source in sources}
    main_file = "tests/support/catch_main.cpp"
    instead[main_file] = (safety_files.ROOT / main_file).read_bytes() + b'#include "tests/mutation/reach_listener.hpp"\n'
    trial.copy_project(safety_files.ROOT, arguments.work / "tree", instead)
    trial.build(arguments.work / "tree", arguments.work / "build", arguments.jobs)
    print(f"mutate: {len(wanted)} mutants, built after {watch}", flush=True)
    if arguments.prepare:
        reach = trial.learn_reach(arguments.work / "tree", arguments.work / "build")
        print("\n".join([*wrong, f"mutate: {len(reach.cases)} test cases, learned after {watch}"]))
        return 1 if wrong else 0

    def is_late() -> bool:
        return arguments.seconds is not None and watch.passed_s() > arguments.seconds

    results = try_all(arguments.work, wanted, listed, arguments.jobs, killers.Killers(killers.default_path()), is_late)
    killed, unreached = results.killed, results.unreached
    if results.left:
        wanted = [each for each in wanted if each.id not in results.left]
        print(f"mutate: {len(results.left)} mutants were left after {arguments.seconds} s, and have no verdict")
        if not wanted:
            print("\n".join([*wrong, "mutate: none was tried"]))
            return 2
    print_summary(wanted, killed)
    if arguments.json:
        write_json(arguments.json, wanted, killed, unreached)
    wrong += complaints(wanted, killed, unreached, listed)
    for line in wrong:
        print(line)
    print(f"mutate: {'FAILED, ' if wrong else ''}{len(killed)} of {len(wanted)} killed, {len(listed)} listed, {watch}")
    return 1 if wrong else 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except (trial.TrialError, mutants.CannotRead, safety_files.WrongList, blocks.WrongBlock) as error:
        print(f"mutate: {error}", file=sys.stderr)
        sys.exit(2)
