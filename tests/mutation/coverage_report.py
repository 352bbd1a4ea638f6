#!/usr/bin/python3
"""Says which lines and branches of the safety files no test has run. Reads what `llvm-cov export -format=text` writes, one
file a test program, and adds them up.

Exit status: 0 if everything has run or stands in coverage_exceptions.txt with its reason, 1 if not, or if an exception is
no longer needed, 2 if something is wrong with the input.

A line counts like in llvm-cov: by the regions that begin in it or reach over it. A branch is a condition, or part of one,
that was never true or never false; for a switch it is whether some case fits. What exists only at compile time
(consteval functions, static_assert) has no counters, and what the compiler writes itself (= default) no conditions of ours.
"""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass, field
from pathlib import Path

import blocks
import safety_files

Range = tuple[int, int, int, int]  # line and column of the first character, and behind the last


@dataclass
class Covered:
    """How often what was run, of one file."""

    lines: dict[int, int] = field(default_factory=dict)
    branches: dict[Range, tuple[int, int]] = field(default_factory=dict)  # true, false

    def add(self, exported: dict) -> None:
        for line, count in counts_of_lines(exported["segments"]).items():
            self.lines[line] = self.lines.get(line, 0) + count
        for first_line, first_column, last_line, last_column, is_true, is_false, *_ in exported["branches"]:
            where = (first_line, first_column, last_line, last_column)
            so_far = self.branches.get(where, (0, 0))
            self.branches[where] = (so_far[0] + is_true, so_far[1] + is_false)


@dataclass(frozen=True)
class Gap:
    file: str
    line: int
    source: str
    missing: str

    def __str__(self) -> str:
        return f"{self.file}:{self.line}: {self.source}  [{self.missing}]"


def counts_of_lines(segments: list[list]) -> dict[int, int]:
    """LLVM's own reckoning (LineCoverageStats): the highest count of what begins in a line, or else what reaches into it."""
    by_line: dict[int, list[list]] = {}
    for segment in segments:
        by_line.setdefault(segment[0], []).append(segment)
    result = {}
    wrapped = None
    for line in range(min(by_line, default=1), max(by_line, default=0) + 1):
        own = by_line.get(line, [])
        begins = [count for _, _, count, has_count, is_entry, is_gap in own if has_count and is_entry and not is_gap]
        begins_skipped = bool(own) and not own[0][3] and own[0][4]
        if not begins_skipped and (begins or (wrapped is not None and wrapped[3])):
            reaching = [wrapped[2]] if wrapped is not None and wrapped[3] else []
            result[line] = max(begins + reaching)
        wrapped = own[-1] if own else wrapped
    return result


def read_exports(paths: list[Path], files: list[str]) -> dict[str, Covered]:
    """What was counted of each file; a file without code of its own has nothing to count."""
    result = {file: Covered() for file in files}
    for path in paths:
        for exported in json.loads(path.read_text())["data"][0]["files"]:
            file = safety_files.place_of(exported["filename"])
            if file in result:
                result[file].add(exported)
    return result


def gaps_of(file: str, covered: Covered) -> list[Gap]:
    text = (safety_files.ROOT / file).read_text().splitlines()
    # What the compiler writes itself is nobody's line.
    unrun = [line for line, count in covered.lines.items() if count == 0 and "= default;" not in text[line - 1]]
    result = [Gap(file, line, text[line - 1].strip(), "never run") for line in unrun]
    for (line, column, last_line, last_column), (is_true, is_false) in covered.branches.items():
        source = text[line - 1]
        if "= default;" in source or covered.lines.get(line) == 0:
            continue
        condition = source[column - 1 : last_column - 1] if line == last_line else source[column - 1 :]
        is_switch = source[: column - 1].endswith("switch (")
        sides = ("without a case that fits", "with a case that fits") if is_switch else ("true", "false")
        for count, side in zip((is_true, is_false), sides):
            if count == 0:
                result.append(Gap(file, line, source.strip(), f"never {side}: {condition}"))
    return sorted(result, key=lambda gap: gap.line)


def report(covered: dict[str, Covered]) -> int:
    path = safety_files.HERE / "coverage_exceptions.txt"
    exceptions = blocks.read(path, ("file", "line", "missing", "reason"))
    gaps = [gap for file, each in covered.items() for gap in gaps_of(file, each)]
    listed = {(each["file"], each["line"], each["missing"]) for each in exceptions}
    found = {(gap.file, gap.source, gap.missing) for gap in gaps}
    wrong = [str(gap) for gap in gaps if (gap.file, gap.source, gap.missing) not in listed]
    wrong += [f"{path.name} lists what is covered or gone: {': '.join(each)}" for each in sorted(listed - found)]
    lines = sum(len(each.lines) for each in covered.values())
    branches = sum(2 * len(each.branches) for each in covered.values())
    for line in wrong:
        print(line)
    print(
        f"coverage: {'FAILED, ' if wrong else ''}{len(covered)} safety files, {lines} lines, {branches} sides of branches, "
        f"{len(gaps)} not run, {len(listed)} exceptions"
    )
    return 1 if wrong else 0


def main() -> int:
    if len(sys.argv) < 2:
        print("usage: coverage_report.py EXPORT.json...", file=sys.stderr)
        return 2
    covered = read_exports([Path(name) for name in sys.argv[1:]], safety_files.safety_files())
    if not any(each.lines for each in covered.values()):
        print("coverage: the exports know none of the safety files; were they made in this checkout?", file=sys.stderr)
        return 2
    return report(covered)


if __name__ == "__main__":
    try:
        sys.exit(main())
    except (blocks.WrongBlock, safety_files.WrongList, OSError, json.JSONDecodeError) as error:
        print(f"coverage: {error}", file=sys.stderr)
        sys.exit(2)
