#!/usr/bin/env python3
"""Every row of the catalogue of failures has a test that bears its number, and a line on a page.

A test bears a number as its tag [F17]; a row of tests/catalogue as the first word of its macro; a step of the emulated machine's scripts
as a comment behind it, "# [F17]". The pages are docs/reaction-times.md and docs/hardships.md, whose tables have the number first. Rows
beyond 107 are this project's own, and are on docs/reaction-times.md.

usage: tests/meta/catalogue_rows.py
"""

import pathlib
import re
import sys

LAST_OF_CATALOGUE = 107
TEXTS = r'((?:"(?:[^"\\]|\\.)*"\s*)+)'
TEST_CASE = re.compile(r"TEST_CASE\(\s*" + TEXTS + r",\s*" + TEXTS)
MACRO = re.compile(r"^\s*(?:SLOW_)?FAULT\(\s*(\d+)\s*,", re.MULTILINE)
STEP = re.compile(r'^\s*(?:step|hold_and_let_go|end_while_closed|ends) "[^"]*".*# ((?:\[F\d+\])+)$', re.MULTILINE)
PAGES = ("docs/reaction-times.md", "docs/hardships.md")
FIRST_CELL = re.compile(r"^\| (\d+(?:, \d+)*) \|", re.MULTILINE)
# Pages whose rows stand in words: two faults at once, and a fault in each step of the closing.
IN_WORDS = {104, 105}


def numbers(text):
    return {int(number) for number in re.findall(r"\[F(\d+)\]", text)}


def borne(folder):
    """Of each number a place where it is borne."""
    found = {}
    for path in sorted((folder / "tests").rglob("*.cpp")):
        text = path.read_text()
        here = {int(number) for number in MACRO.findall(text)}
        for _, tags in TEST_CASE.findall(text):
            here |= numbers(tags)
        for number in here:
            found.setdefault(number, str(path.relative_to(folder)))
    for path in sorted((folder / "tests/rig").glob("*.sh")):
        for tags in STEP.findall(path.read_text()):
            for number in numbers(tags):
                found.setdefault(number, str(path.relative_to(folder)))
    return found


def listed(folder):
    found = set(IN_WORDS)
    for page in PAGES:
        for cell in FIRST_CELL.findall((folder / page).read_text()):
            found |= {int(number) for number in cell.split(", ")}
    return found


def problems_of(folder):
    tests, pages = borne(folder), listed(folder)
    rows = set(range(1, LAST_OF_CATALOGUE + 1)) | {number for number in pages if number > LAST_OF_CATALOGUE}
    for number in sorted(rows - set(tests)):
        yield f"row {number}: found no test that bears [F{number}], expected one that would fail if this failure had another outcome"
    for number in sorted(rows - pages):
        yield f"row {number}: found on neither of {', '.join(PAGES)}, expected a line there"
    for number in sorted(set(tests) - rows):
        yield f"{tests[number]}: found [F{number}], expected a row of the catalogue, 1 to {LAST_OF_CATALOGUE}, or one on {PAGES[0]}"


def main():
    if sys.argv[1:]:
        sys.exit(__doc__)
    problems = list(problems_of(pathlib.Path(__file__).resolve().parents[2]))
    print("\n".join(problems) or f"{LAST_OF_CATALOGUE} rows: each has a test and a line on a page")
    sys.exit(1 if problems else 0)


main()
