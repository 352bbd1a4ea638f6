#!/usr/bin/python3
"""Says which share of the lines all tests together run, part by part, of the files that are not of safety: those have a
report of their own (coverage_report.py). Reads what `llvm-cov export -summary-only` writes for all programs.

Exit status: 0 if it is 90 % at least in each part, 1 if not, 2 if something is wrong with the input.
"""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from pathlib import Path

import safety_files

# What is shipped; what only tests is not asked for.
PARTS = ("protocol", "devices", "mmu", "config", "daemon/core", "daemon/history", "daemon/recording", "daemon/shell", "tools")
WANTED_PERCENT = 90
# Files below this are named, so that one sees where the rest is.
NAMED_BELOW_PERCENT = 85


@dataclass
class Lines:
    total: int = 0
    run: int = 0

    def add(self, other: Lines) -> None:
        self.total += other.total
        self.run += other.run

    def percent(self) -> float:
        return 100 * self.run / self.total if self.total else 100.0


def lines_of_files(exported: dict, root: Path) -> dict[str, Lines]:
    """From the top of the project; files elsewhere are left out."""
    result = {}
    for each in exported["data"][0]["files"]:
        file = safety_files.place_of(each["filename"], root)
        if file is not None:
            lines = each["summary"]["lines"]
            result[file] = Lines(lines["count"], lines["covered"])
    return result


def part_of(file: str) -> str | None:
    return next((part for part in PARTS if file.startswith(part + "/")), None)


def report(files: dict[str, Lines]) -> int:
    """Prints a line for each part, and below it the files of which little is run."""
    everywhere = Lines()
    too_little = []
    for part in PARTS:
        own = {file: lines for file, lines in files.items() if part_of(file) == part}
        together = Lines()
        for lines in own.values():
            together.add(lines)
        everywhere.add(together)
        if together.percent() < WANTED_PERCENT:
            too_little.append(part)
        print(f"{part:<18} {together.percent():5.1f} % of {together.total:6} lines in {len(own)} files")
        for file, lines in sorted(own.items(), key=lambda each: each[1].percent()):
            if lines.percent() < NAMED_BELOW_PERCENT:
                print(f"    {lines.percent():5.1f} % of {lines.total:4}  {file}")
    print(
        f"coverage elsewhere: {'FAILED in ' + ', '.join(too_little) + ': ' if too_little else ''}"
        f"{everywhere.percent():.1f} % of {everywhere.total} lines, at least {WANTED_PERCENT} % wanted in each part"
    )
    return 1 if too_little else 0


def main() -> int:
    if len(sys.argv) != 2:
        print("usage: other_coverage.py EXPORT.json", file=sys.stderr)
        return 2
    safe = set(safety_files.safety_files())
    files = lines_of_files(json.loads(Path(sys.argv[1]).read_text()), safety_files.ROOT)
    files = {file: lines for file, lines in files.items() if part_of(file) and file not in safe}
    missing = [part for part in PARTS if not any(part_of(file) == part for file in files)]
    if missing:
        print(f"coverage: the export knows no file of {', '.join(missing)}; was it made in this checkout?", file=sys.stderr)
        return 2
    return report(files)


if __name__ == "__main__":
    try:
        sys.exit(main())
    except (safety_files.WrongList, OSError, json.JSONDecodeError, KeyError) as error:
        print(f"coverage: {error}", file=sys.stderr)
        sys.exit(2)
