#!/usr/bin/python3
"""The mutation and coverage tools are tried on toy sources: every mutant is there that should be, the checks kill exactly
those that they can tell, and wrong lists are refused. Status 77 (skipped) where libclang for Python is not installed."""

from __future__ import annotations

import argparse
import contextlib
import io
import os
import resource
import subprocess
import sys
import tempfile
import unittest
import unittest.mock
from pathlib import Path

try:
    import clang.cindex  # noqa: F401
except ModuleNotFoundError:
    print("self_test.py: skipped, there is no libclang for Debian's own Python 3: tools/packages.sh mutation")
    sys.exit(77)

import blocks
import coverage_report
import instrument
import kept_mutants
import killers
import mutants
import mutate
import other_coverage
import safety_files
import survivors
import trial
from mutants import Mutant

# Line of toy.cpp: every change there, in order.
EXPECTED = {
    "int limit = 0;": ["0 -> 1"],
    "bool counts = true;": ["true -> false"],
    "Duration wait = 10ms;": ["10ms -> 20ms", "10ms -> 5ms"],
    "constexpr std::array<Row, 2> rows{{{.limit = 5}, {.limit = 7, .counts = false, .wait = 20ms}}};": [
        "5 -> 6",
        "5 -> 4",
        "7 -> 8",
        "7 -> 6",
        "false -> true",
        "20ms -> 40ms",
        "20ms -> 10ms",
    ],
    "constexpr int half_step = 2;": ["2 -> 3", "2 -> 1"],
    "constexpr int limit_min = 1;": ["1 -> 2", "1 -> 0"],
    "return value >= limit && limit >= limit_min;": [
        ">= -> >",
        ">= -> <",
        "&& -> ||",
        "limit >= limit_min dropped",
        "value >= limit dropped",
        ">= -> > (number 2)",
        ">= -> < (number 2)",
    ],
    "int count = 0;": ["0 -> 1"],
    "if (!row.counts) continue;": ["if (...) -> if (false)", "! dropped"],
    "if (is_beyond(value, row.limit)) ++count;": [
        "is_beyond(value, row.limit) -> !(is_beyond(value, row.limit))",
        "++ -> --",
    ],
    "const Duration waited = now - since;": ["- -> +"],
    "return waited > rows[row].wait || since == TimePoint{};": [
        "> -> >=",
        "> -> <=",
        "|| -> &&",
        "since == TimePoint{} dropped",
        "waited > rows[row].wait dropped",
        "== -> !=",
    ],
    "int at = 0;": ["0 -> 1"],
    "for (int done = 0; done < steps; done += 1) at += back ? -step_length : step_length;": [
        "0 -> 1",
        "< -> <=",
        "< -> >=",
        "+= -> -=",
        "1 -> 2",
        "1 -> 0",
        "+= -> -= (number 2)",
        "back -> !(back)",
        "- dropped",
    ],
}
# What the checks cannot tell from the original.
SURVIVORS = {
    ("int limit = 0;", "0 -> 1"),  # every row has a limit of its own
    # A row that does not count has no limit that matters.
    ("constexpr std::array<Row, 2> rows{{{.limit = 5}, {.limit = 7, .counts = false, .wait = 20ms}}};", "7 -> 8"),
    ("constexpr std::array<Row, 2> rows{{{.limit = 5}, {.limit = 7, .counts = false, .wait = 20ms}}};", "7 -> 6"),
    ("constexpr std::array<Row, 2> rows{{{.limit = 5}, {.limit = 7, .counts = false, .wait = 20ms}}};", "20ms -> 40ms"),
}


def find_in_toy() -> tuple[list[mutants.Source], list[Mutant]]:
    return mutants.find(safety_files.HERE, ["toy.cpp"])


class Mutation(unittest.TestCase):
    def test_finds_what_there_is_and_nothing_else(self) -> None:
        found: dict[str, list[str]] = {}
        for mutant in find_in_toy()[1]:
            found.setdefault(mutant.source, []).append(mutant.change)
        self.assertEqual(found, EXPECTED)

    def test_reads_the_mutants_again_only_after_a_change(self) -> None:
        calls = 0

        def finder(root: Path, files: list[str]) -> kept_mutants.Found:
            nonlocal calls
            calls += 1
            return mutants.find(root, files)

        with tempfile.TemporaryDirectory() as folder:
            root, work = Path(folder) / "root", Path(folder) / "work"
            (root / "daemon").mkdir(parents=True)
            (root / "toy.cpp").write_bytes((safety_files.HERE / "toy.cpp").read_bytes())
            first = kept_mutants.find(root, ["toy.cpp"], work, finder)
            self.assertEqual(kept_mutants.find(root, ["toy.cpp"], work, finder)[1], first[1])
            self.assertEqual(calls, 1)
            with self.subTest("a source"):
                (root / "toy.cpp").write_bytes(b"// One line more.\n" + (root / "toy.cpp").read_bytes())
                moved = kept_mutants.find(root, ["toy.cpp"], work, finder)[1]
                self.assertEqual([each.line for each in moved], [each.line + 1 for each in first[1]])
                self.assertEqual(calls, 2)
            with self.subTest("a header of the project"):
                (root / "daemon" / "part.hpp").write_text("#pragma once\n")
                kept_mutants.find(root, ["toy.cpp"], work, finder)
                self.assertEqual(calls, 3)
            with self.subTest("a damaged record"):
                (work / "mutants.pickle").write_bytes(b"damaged")
                self.assertEqual(kept_mutants.find(root, ["toy.cpp"], work, finder)[1], moved)
                self.assertEqual(calls, 4)

    def test_kills_what_the_checks_can_tell(self) -> None:
        sources, found = find_in_toy()
        with tempfile.TemporaryDirectory() as folder:
            program = self._build(Path(folder), instrument.instrumented(sources[0], sources[0].constants))
            self.assertEqual(self._status(program, 0), 0)
            survived = {(each.source, each.change) for each in found if self._status(program, each.id) == 0}
        self.assertEqual(survived, SURVIVORS)

    def test_of_chosen_mutants_alone_kills_these_and_knows_no_other(self) -> None:
        sources, found = find_in_toy()
        ids = {each.id for each in found if each.source == "if (!row.counts) continue;"}
        narrow = instrument.narrowed(sources, ids)
        self.assertEqual({place.first_id for place in narrow[0].places} - ids, set())
        with tempfile.TemporaryDirectory() as folder:
            program = self._build(Path(folder), instrument.instrumented(narrow[0], []))
            noticed = {each.id for each in found if self._status(program, each.id) != 0}
        self.assertEqual(noticed, ids)

    def test_of_chosen_mutants_in_a_constant_needs_all(self) -> None:
        sources, found = find_in_toy()
        ids = {each.id for each in found if each.source.startswith("constexpr std::array<Row, 2> rows")}
        self.assertEqual(instrument.narrowed(sources, ids), sources)

    def test_of_no_mutant_changes_no_source(self) -> None:
        self.assertEqual(instrument.narrowed(find_in_toy()[0], set()), [])

    def _build(self, folder: Path, toy: bytes) -> Path:
        (folder / "toy.cpp").write_bytes(toy)
        (folder / "toy_checks.cpp").write_bytes((safety_files.HERE / "toy_checks.cpp").read_bytes())
        program = folder / "toy"
        flags = ["-std=c++20", "-O1", "-w", "-Wno-narrowing", f"-I{safety_files.ROOT}"]
        subprocess.run(["clang++", *flags, str(folder / "toy_checks.cpp"), "-o", str(program)], check=True)
        return program

    def _status(self, program: Path, mutant: int) -> int | None:
        # A mutant that never ends takes its processor time. One that only waits for a processor is not killed.
        def limit_processor_time() -> None:
            resource.setrlimit(resource.RLIMIT_CPU, (2, 3))
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))

        environment = dict(os.environ, BMU_MUTANT=str(mutant))
        try:
            return subprocess.run([str(program)], env=environment, preexec_fn=limit_processor_time, timeout=60).returncode
        except subprocess.TimeoutExpired:
            return None

    def test_literals_have_neighbours_and_durations_something_different(self) -> None:
        cases = {
            "0": ["1"],
            "1": ["2", "0"],
            "28": ["29", "27"],
            "0xFF": ["256", "254"],
            "1U": ["2U", "0U"],
            "1'000": ["1001", "999"],
            "1'000'000": ["2000000", "500000"],
            "50ms": ["100ms", "25ms"],
            "15s": ["30s", "7500ms"],
            "0ns": ["1ms"],
            "1.5": [],
        }
        for text, others in cases.items():
            self.assertEqual(mutants.other_literals(text, is_subscript=False), others, text)
        self.assertEqual(mutants.other_literals("7", is_subscript=True), ["6"])
        self.assertEqual(mutants.other_literals("0", is_subscript=True), ["1"])


class Learning(unittest.TestCase):
    # In the place of a test program: lists the names in `names`, and records what it is asked to run, as "name, seconds, mutants", but
    # for those in `lost`.
    RECORDS_ITS_CASES = """#!/bin/sh
cd "$(dirname "$0")"
[ "$1 $2" = "--list-test-names-only ~[slow]" ] && { cat names; exit 1; }
[ "$1 $2" = "--input-file /dev/stdin" ] || exit 99
echo run >>runs
{ printf '\\t0\\t1 2 \\n'; sed 's/^"//; s/"$/\\t0.5\\t7 /'; } | grep -vxFf lost >"$BMU_MUTANT_RECORD"
exit "$(cat status)"
"""

    def setUp(self) -> None:
        work = Path(self.enterContext(tempfile.TemporaryDirectory()))
        self._tree, self._folder = work / "tree", work / "build"
        self._bin = self._folder / "bin"
        self._bin.mkdir(parents=True)
        for name in trial.PROGRAMS:
            (self._bin / name).write_text(self.RECORDS_ITS_CASES)
            (self._bin / name).chmod(0o755)
        self._put("a case\nanother\n")

    def _put(self, names: str, lost: str = "none", status: int = 0) -> None:
        (self._bin / "names").write_text(names)
        (self._bin / "lost").write_text(lost + "\n")
        (self._bin / "status").write_text(f"{status}\n")

    def _learn(self) -> trial.Reach:
        return trial.learn_reach(self._tree, self._folder)

    def _runs(self) -> int:
        return len((self._bin / "runs").read_text().splitlines())

    def test_has_no_limit_of_length(self) -> None:
        self._put("".join(f"{number} {'of a great many test cases' * 5}\n" for number in range(3000)))
        self.assertEqual(len(self._learn().cases), 2 * 3000)

    def test_counts_until_something_changes(self) -> None:
        first = self._learn()
        self.assertEqual(first.before["test_unit"], {1, 2})
        self.assertEqual([(each.name, each.reaches) for each in first.cases[:2]], [("a case", {7}), ("another", {7})])
        self.assertEqual(self._learn(), first)
        self.assertEqual(self._runs(), 2)
        with (self._bin / "test_unit").open("a") as program:
            program.write("# another build\n")
        self._learn()
        self.assertEqual(self._runs(), 3)
        (self._folder / "test_scenario.reach").write_text("\t0\t\n")
        self.assertEqual(self._learn(), first)
        self.assertEqual(self._runs(), 4)
        self._tree.mkdir()
        (self._tree / "a.scn").write_text("0 vehicle on\n")
        self._learn()
        self.assertEqual(self._runs(), 6)

    def test_of_a_program_that_fails_or_leaves_a_case_out_is_refused_and_not_kept(self) -> None:
        for lost, status, message in (("none", 3, "fails without any mutant, status 3"), ("another\t0.5\t7 ", 0, "do not run: \\['another'\\]")):
            self._put("a case\nanother\n", lost, status)
            for _ in range(2):
                with self.assertRaisesRegex(trial.TrialError, message):
                    self._learn()
        self._put("")
        with self.assertRaisesRegex(trial.TrialError, "lists no test cases"):
            self._learn()


class Order(unittest.TestCase):
    def test_is_first_what_noticed_it_before_then_the_quick_ones_and_all_of_them_once(self) -> None:
        times_s = {"test_unit": [0.01, 0.05, 0.3, 30], "test_scenario": [0.09, 1, 5, 20, 40]}
        cases = [trial.TestCase(program, f"{program} {took_s}", took_s, set()) for program in times_s for took_s in times_s[program]]
        for first in (None, "test_scenario 20", "test_unit 0.3", "a test that is gone"):
            batches = trial._batches(cases, first)
            names = [case.name for batch in batches for case in batch]
            self.assertEqual(sorted(names), sorted(case.name for case in cases), first)
            for batch in batches:
                self.assertEqual(len({case.program for case in batch}), 1, first)
            if first in names:
                self.assertEqual([case.name for case in batches[0]], [first])
        batches = [[case.took_s for case in batch] for batch in trial._batches(cases, None)]
        self.assertEqual(batches, [[0.01, 0.05], [0.09], [0.3], [1], [5], [30], [20, 40]])

    def test_then_come_those_that_noticed_mutants_nearby_but_for_slow_ones(self) -> None:
        times_s = {"test_unit": [0.01, 0.3, 0.4, 30], "test_scenario": [0.09, 1]}
        cases = [trial.TestCase(program, f"{program} {took_s}", took_s, {1}) for program in times_s for took_s in times_s[program]]
        near = ["test_unit 0.4", "test_scenario 0.09", "test_unit 0.3", "a test that is gone"]
        batches = [[case.took_s for case in batch] for batch in trial._batches(cases, "test_unit 30", near)]
        self.assertEqual(batches, [[30], [0.4], [0.09], [0.01], [0.3], [1]])
        batches = [[case.took_s for case in batch] for batch in trial._batches(cases, "test_unit 0.4", near)]
        self.assertEqual(batches, [[0.4], [0.3], [0.09], [0.01], [1], [30]])

    def test_the_case_that_failed_is_the_last_that_began(self) -> None:
        report = b'<TestCase name="one"> </TestCase><TestCase name="a &lt; b &amp; &quot;c&quot;" filename="'
        self.assertEqual(trial.last_case(report), 'a < b & "c"')
        self.assertIsNone(trial.last_case(b""))

    def test_the_name_of_the_case_that_failed_comes_from_the_program(self) -> None:
        program = """#!/bin/sh
case " $* " in *" --abort --reporter xml "*) ;; *) exit 0 ;; esac
echo '<TestCase name="good"/>'
[ "$BMU_MUTANT" = 7 ] && { echo '<TestCase name="bad">'; exit 42; }
exit 0
"""
        cases = [trial.TestCase("test_unit", name, 0.0, {7, 8}) for name in ("good", "bad")]
        with tempfile.TemporaryDirectory() as name:
            path = Path(name) / "bin" / "test_unit"
            path.parent.mkdir()
            path.write_text(program)
            path.chmod(0o755)
            reach = trial.Reach(cases, {"test_unit": set(), "test_scenario": set()})
            self.assertEqual(trial.killer(Path(name), reach, 7), "bad")
            self.assertIsNone(trial.killer(Path(name), reach, 8))

    def test_what_is_remembered_outlives_a_line_that_moves_and_damage_costs_only_time(self) -> None:
        mutant = mutants.Mutant(1, "a.cpp", 10, 4, "a < b", "<=")
        moved = mutants.Mutant(9, "a.cpp", 90, 4, "a < b", "<=")
        other = mutants.Mutant(2, "a.cpp", 10, 4, "a < b", ">=")
        with tempfile.TemporaryDirectory() as name:
            path = Path(name) / "below" / "killers.json"
            one, two = killers.Killers(path), killers.Killers(path)
            one.note(mutant, "a case")
            one.save()
            two.note(other, "another")
            two.save()
            both = killers.Killers(path)
            self.assertEqual((both.of(moved), both.of(other)), ("a case", "another"))
            for damage in ("", "[]", "{", '{"x": 1}'):
                path.write_text(damage)
                self.assertIsNone(killers.Killers(path).of(mutant))


    def test_near_is_what_noticed_other_mutants_of_the_file_in_this_run(self) -> None:
        def mutant(file: str, line: int) -> Mutant:
            return Mutant(line, file, line, 4, "a < b", "<=")

        with tempfile.TemporaryDirectory() as name:
            known = killers.Killers(Path(name) / "killers.json")
            self.assertEqual(known.near(mutant("a.cpp", 5)), [])
            for line in range(10, 60, 2):
                known.note(mutant("a.cpp", line), f"case {line // 4}")
            known.note(mutant("b.cpp", 30), "of another file")
            self.assertEqual(known.near(mutant("a.cpp", 30))[:4], ["case 7", "case 6", "case 8", "case 5"])
            self.assertEqual(len(known.near(mutant("a.cpp", 30))), killers.NEAR_MAX)
            self.assertEqual(known.near(mutant("b.cpp", 1)), ["of another file"])
            known.save()
            self.assertEqual(killers.Killers(Path(name) / "killers.json").near(mutant("a.cpp", 30)), [])


class Coverage(unittest.TestCase):
    def test_counts_lines_by_what_begins_in_them_or_reaches_over_them(self) -> None:
        # line, column, count, has count, begins a region, is a gap
        segments = [
            [1, 10, 4, True, True, False],
            [2, 7, 0, True, True, False],
            [2, 20, 4, True, False, False],
            [5, 1, 0, False, False, False],
        ]
        self.assertEqual(coverage_report.counts_of_lines(segments), {1: 4, 2: 4, 3: 4, 4: 4, 5: 4})
        never = [[1, 1, 3, True, True, False], [2, 1, 0, True, True, False], [4, 1, 3, True, False, False]]
        self.assertEqual(coverage_report.counts_of_lines(never)[3], 0)

    def test_says_which_side_of_which_branch_never_was(self) -> None:
        covered = coverage_report.Covered(lines={37: 2}, branches={(37, 10, 37, 24): (2, 0), (37, 28, 37, 46): (1, 1)})
        file = "tests/mutation/toy.cpp"
        gaps = coverage_report.gaps_of(file, covered)
        line = safety_files.ROOT.joinpath(file).read_text().splitlines()[36].strip()
        self.assertEqual(gaps, [coverage_report.Gap(file, 37, line, "never false: value >= limit")])

    def test_programs_add_up(self) -> None:
        covered = coverage_report.Covered()
        for is_true, is_false in ((3, 0), (0, 2)):
            covered.add({"segments": [], "branches": [[1, 2, 1, 9, is_true, is_false, 0, 0, 4]]})
        self.assertEqual(covered.branches, {(1, 2, 1, 9): (3, 2)})


class Lists(unittest.TestCase):
    def test_a_part_of_which_too_little_runs_fails_whatever_the_others_do(self) -> None:
        files = {"tools/a.cpp": other_coverage.Lines(100, 89), "protocol/b.cpp": other_coverage.Lines(1000, 1000)}
        with contextlib.redirect_stdout(io.StringIO()) as printed:
            self.assertEqual(other_coverage.report(files), 1)
            files["tools/c.hpp"] = other_coverage.Lines(10, 10)
            self.assertEqual(other_coverage.report(files), 0)
        self.assertIn("FAILED in tools: 99.0 % of 1100 lines", printed.getvalue())

    def test_what_is_not_of_the_project_is_not_counted(self) -> None:
        summary = {"lines": {"count": 7, "covered": 5}}
        exported = {"data": [{"files": [{"filename": f"{folder}/tools/a.cpp", "summary": summary} for folder in ("/top/build/..", "/elsewhere")]}]}
        found = other_coverage.lines_of_files(exported, Path("/top"))
        self.assertEqual(found, {"tools/a.cpp": other_coverage.Lines(7, 5)})
        self.assertIsNone(other_coverage.part_of("tests/tools/a.cpp"))

    def test_every_file_of_the_core_is_on_one_list(self) -> None:
        safety, others = set(safety_files.safety_files()), set(safety_files.other_files())
        there = {str(path.relative_to(safety_files.ROOT)) for path in safety_files.ROOT.glob("daemon/core/**/*") if path.is_file()}
        self.assertEqual(there - safety - others, set(), "name these in files.txt, or in other_files.txt with a reason")
        self.assertEqual(safety & others, set(), "these are on both lists")

    def test_the_lists_of_exceptions_can_be_read(self) -> None:
        blocks.read(safety_files.HERE / "survivors.txt", ("file", "line", "change", "reason"))
        blocks.read(safety_files.HERE / "coverage_exceptions.txt", ("file", "line", "missing", "reason"))

    def test_a_mutant_that_is_listed_has_its_line_in_its_file(self) -> None:
        # Whether it has the change, too, is seen where mutants are looked for, which takes a minute.
        safety = safety_files.safety_files()

        def is_there(entry: survivors.Survivor) -> bool:
            return entry.file in safety and entry.line in map(str.strip, (safety_files.ROOT / entry.file).read_text().splitlines())

        listed = survivors.read(safety_files.HERE / "survivors.txt")
        self.assertEqual([str(entry) for entry in listed if not is_there(entry)], [], "no such line; correct these or take them away")

    def test_a_wrong_block_is_refused_with_its_line(self) -> None:
        cases = {
            "file: a\nreason: b\n": "list.txt:3: the block above has no line",
            "file: a\nfile: b\n": "list.txt:2: found 'file: b'",
            "file: a\nline:\n": "list.txt:2: found 'line:'",
            "color: red\n": "list.txt:1: found 'color: red'",
        }
        for text, message in cases.items():
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / "list.txt"
                path.write_text(text)
                with self.assertRaises(blocks.WrongBlock) as raised:
                    blocks.read(path, ("file", "line", "reason"))
                self.assertIn(message, str(raised.exception))


class Parts(unittest.TestCase):
    def test_the_parts_are_all_there_is_and_no_two_share_one(self) -> None:
        everything = list(range(11))
        parts = [everything[mutate.part(f"{number}/3")] for number in (1, 2, 3)]
        self.assertEqual(sorted(sum(parts, [])), everything)

    def test_turns_are_all_there_is_and_none_is_larger_than_it_may_be(self) -> None:
        for count in (0, 1, 200, 201, 1000):
            everything = list(range(count))
            size = max(1, -(-count // 200))
            parts = [everything[mutate.turn(count, 200, number)] for number in range(7, 7 + size)]
            self.assertEqual(sorted(sum(parts, [])), everything)
            self.assertLessEqual(max(map(len, parts)), 200)

    def test_a_part_that_is_none_is_refused(self) -> None:
        for text in ("0/3", "4/3", "1/0", "1", "a/b", "-1/3", "1/3/2"):
            with self.assertRaises(argparse.ArgumentTypeError, msg=text):
                mutate.part(text)


class Listed(unittest.TestCase):
    """Of four mutants in two files nothing is built; the tests kill all but the one that is listed."""

    FOUND = [Mutant(number, "a.cpp" if number < 4 else "b.cpp", number, 1, f"line {number}", "0 -> 1") for number in (1, 2, 3, 4)]
    SURVIVOR = survivors.Survivor("a.cpp", "line 1", "0 -> 1", "it is so")

    def _run(self, words: list[str], *listed: survivors.Survivor) -> tuple[int, str]:
        def all_but_the_first(_work: Path, wanted: list[Mutant], *_: object) -> mutate.Results:
            results = mutate.Results()
            results.killed = {each.id for each in wanted} - {1}
            return results

        instead = [
            unittest.mock.patch.object(sys, "argv", ["mutate.py", *words]),
            unittest.mock.patch.object(kept_mutants, "find", return_value=([], self.FOUND)),
            unittest.mock.patch.object(survivors, "read", return_value=[self.SURVIVOR, *listed]),
            unittest.mock.patch.object(mutate, "changed_lines", return_value={"b.cpp": {4}} if "HEAD" in words else {}),
            unittest.mock.patch.object(mutate, "try_all", side_effect=all_but_the_first),
            unittest.mock.patch.object(trial, "copy_project"),
            unittest.mock.patch.object(trial, "build"),
            unittest.mock.patch.object(trial, "learn_reach", return_value=trial.Reach()),
        ]
        with contextlib.ExitStack() as stack, contextlib.redirect_stdout(io.StringIO()) as printed:
            for each in instead:
                stack.enter_context(each)
            return mutate.main(), printed.getvalue()

    def test_that_is_not_there_is_noticed_whatever_is_tried(self) -> None:
        stale = survivors.Survivor("b.cpp", "line 4", "0 -> 2", "it was so")
        for words in ([], ["--part", "1/2"], ["--part", "2/2"], ["--since", "HEAD"], ["--since", "none"], ["--file", "b.cpp"], ["--prepare"]):
            with self.subTest(words):
                self.assertEqual(self._run(words)[0], 0)
                status, printed = self._run(words, stale)
                self.assertEqual(status, 1)
                self.assertIn("survivors.txt lists a mutant that is not there: b.cpp: line 4  [0 -> 2]", printed)
        self.assertEqual(self._run(["--file", "a.cpp"], stale)[0], 0)

    def test_that_is_killed_is_noticed_with_its_part(self) -> None:
        killed = survivors.Survivor("a.cpp", "line 2", "0 -> 1", "it was so")
        self.assertEqual(self._run(["--part", "1/2"], killed)[0], 0)
        status, printed = self._run(["--part", "2/2"], killed)
        self.assertEqual(status, 1)
        self.assertIn("survivors.txt lists a mutant that is killed: a.cpp:2:1: line 2  [0 -> 1]", printed)


class Quick(unittest.TestCase):
    def test_cases_are_all_that_a_listed_mutant_meets(self) -> None:
        wanted = [Mutant(number, "a.cpp", number, 1, f"line {number}", "0 -> 1") for number in (1, 2)]
        listed = [survivors.Survivor("a.cpp", "line 2", "0 -> 1", "it is so")]
        with (
            tempfile.TemporaryDirectory() as folder,
            unittest.mock.patch.object(trial, "learn_reach", return_value=trial.Reach()),
            unittest.mock.patch.object(trial, "killer", return_value="a case") as killer,
        ):
            known = mutate.killers.Killers(Path(folder) / "killers.json")
            mutate.try_all(Path(folder), wanted, listed, 1, known, lambda: False)
        self.assertEqual([call.args[2] for call in killer.call_args_list], [1, 2])
        self.assertEqual([call.args[5] for call in killer.call_args_list], [False, True])

    def test_cases_are_those_that_fit_into_the_first_batches(self) -> None:
        cases = [trial.TestCase("test_unit", str(took_s), took_s, set()) for took_s in (0.01, 0.3, 1.0, 7.0, 9.0)]
        whole = [case.name for batch in trial._batches(cases, None) for case in batch]
        quick = [case.name for batch in trial._batches(cases, None, only_quick=True) for case in batch]
        self.assertEqual(whole, ["0.01", "0.3", "1.0", "7.0", "9.0"])
        self.assertEqual(quick, ["0.01", "0.3", "1.0", "7.0"])


class InTime(unittest.TestCase):
    """What does not begin in time has no verdict, and is not called a survivor."""

    def _run(self, first_s: float, begin_s: float, *more: str) -> tuple[int, str]:
        found = [Mutant(number, "a.cpp", number, 1, f"line {number}", "0 -> 1") for number in (1, 2, 3)]
        times_s = iter([0.0, first_s])
        instead = [
            unittest.mock.patch.object(sys, "argv", ["mutate.py", "--seconds", "10", "--jobs", "1", *more]),
            unittest.mock.patch.object(kept_mutants, "find", return_value=([], found)),
            unittest.mock.patch.object(survivors, "read", return_value=[]),
            unittest.mock.patch.object(trial, "copy_project"),
            unittest.mock.patch.object(trial, "build"),
            unittest.mock.patch.object(trial, "learn_reach", return_value=trial.Reach()),
            unittest.mock.patch.object(trial, "killer", return_value="a case"),
            unittest.mock.patch.object(trial.Stopwatch, "passed_s", side_effect=lambda: next(times_s, begin_s)),
            unittest.mock.patch.object(mutate.killers, "Killers"),
        ]
        with contextlib.ExitStack() as stack, contextlib.redirect_stdout(io.StringIO()) as printed:
            for each in instead:
                stack.enter_context(each)
            return mutate.main(), printed.getvalue()

    def test_all_are_tried(self) -> None:
        status, printed = self._run(10.0, 10.0)
        self.assertEqual(status, 0, printed)
        self.assertIn("3 of 3 killed", printed)
        self.assertNotIn("left", printed)

    def test_the_rest_is_left(self) -> None:
        status, printed = self._run(10.0, 10.1)
        self.assertEqual(status, 0, printed)
        self.assertIn("mutate: 2 mutants were left after 10 s, and have no verdict", printed)
        self.assertNotIn("survived:", printed)
        self.assertIn("1 of 1 killed", printed)

    def test_what_all_parts_share_is_prepared_without_trying_any(self) -> None:
        with unittest.mock.patch.object(mutate, "try_all", side_effect=AssertionError("a mutant is tried")):
            status, printed = self._run(0.0, 0.0, "--prepare")
        self.assertEqual(status, 0, printed)
        self.assertIn("3 mutants, built", printed)
        self.assertIn("0 test cases, learned", printed)

    def test_a_run_that_tries_none_has_no_verdict(self) -> None:
        status, printed = self._run(10.1, 10.1)
        self.assertEqual(status, 2, printed)
        self.assertIn("mutate: none was tried", printed)
        self.assertNotIn("killed", printed)


class ChangedLines(unittest.TestCase):
    def test_are_those_of_the_named_files_whatever_bytes_others_hold(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            root = Path(folder)

            def git(*arguments: str) -> None:
                subprocess.run(["git", "-c", "user.name=test", "-c", "user.email=test@localhost", *arguments], cwd=root, check=True)

            git("init", "--quiet")
            (root / "a.cpp").write_text("one\ntwo\nthree\nfour\n")
            (root / "seed").write_bytes(b"\xd7 is no UTF-8\n")
            git("add", ".")
            git("commit", "--quiet", "--message=first")
            (root / "a.cpp").write_text("one\nTWO\nthree\nfour\nfive\nsix\n")
            (root / "seed").write_bytes(b"\xd7\xd8 is none either\n")
            self.assertEqual(mutate.changed_lines(root, "HEAD", ["a.cpp"]), {"a.cpp": {2, 5, 6}})


if __name__ == "__main__":
    unittest.main()
