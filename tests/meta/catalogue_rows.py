#!/usr/bin/env python3
"""Every row of the catalogue of failures has a test that bears its number, and a line on a page.

A test bears a number as its tag [F17]; a row of tests/catalogue as the first word of its macro; a step of the emulated machine's scripts
as a comment behind it, "# [F17]". The pages are docs/reaction-times.md and docs/hardships.md, whose tables have the number first. Rows
beyond 107 are this project's own, and are on docs/reaction-times.md.

Rows 40 to 77 happen to the real daemon on a real kernel: each is borne by a step of a script that a test runs in the
emulated machine, or is on NOT_IN_RIG.

usage: tests/meta/catalogue_rows.py [--self-test]
"""

import pathlib
import re
import sys
import tempfile

LAST_OF_CATALOGUE = 107
TEXTS = r'((?:"(?:[^"\\]|\\.)*"\s*)+)'
TEST_CASE = re.compile(r"TEST_CASE\(\s*" + TEXTS + r",\s*" + TEXTS)
MACRO = re.compile(r"^\s*(?:SLOW_)?FAULT\(\s*(\d+)\s*,", re.MULTILINE)
STEP = re.compile(r'^\s*(?:step|hold_and_let_go|end_while_closed|ends) "[^"]*".*# ((?:\[F\d+\])+)$', re.MULTILINE)
PAGES = ("docs/reaction-times.md", "docs/hardships.md")
FIRST_CELL = re.compile(r"^\| (\d+(?:, \d+)*) \|", re.MULTILINE)
RIG_ROWS = range(40, 78)
# Those that no step bears, and why.
NOT_IN_RIG = {
    69: "the emulated machine has its files through a device that its kernel cannot wake up again",
}


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
    for number, place in borne_in_rig(folder).items():
        found.setdefault(number, place)
    return found


def borne_in_rig(folder):
    """Of each number the guest script with a step that bears it, of those that a test of ctest runs."""
    found = {}
    run = (folder / "tests/rig/CMakeLists.txt").read_text()
    for path in sorted((folder / "tests/rig").glob("*.sh")):
        if f"/{path.name}" not in run:
            continue
        for tags in STEP.findall(path.read_text()):
            for number in numbers(tags):
                found.setdefault(number, str(path.relative_to(folder)))
    return found


def listed(folder):
    found = set()
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
    yield from rig_problems(borne_in_rig(folder))


def rig_problems(in_rig):
    for number in RIG_ROWS:
        if number not in in_rig and number not in NOT_IN_RIG:
            yield f"row {number}: found no step of tests/rig/*.sh that bears [F{number}], expected one in a script that a test runs, or a reason in NOT_IN_RIG"
        if number in in_rig and number in NOT_IN_RIG:
            yield f"{in_rig[number]}: found a step that bears [F{number}], expected none while NOT_IN_RIG has a reason for that"


def self_test():
    """Of a project in which every row has a test, a line and, where it needs one, a step; and of the same with one thing changed."""

    def problems_with(steps, skipped_test=None, run="${rig}/steps.sh", skipped_line=None):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            for place in ("tests/unit", "tests/rig", "docs"):
                (folder / place).mkdir(parents=True)
            rows = range(1, LAST_OF_CATALOGUE + 1)
            cases = [f'TEST_CASE("row", "[F{number}]") {{}}\n' for number in rows if number != skipped_test]
            (folder / "tests/unit/rows_test.cpp").write_text("".join(cases))
            (folder / "tests/rig/CMakeLists.txt").write_text(f"add_test(NAME rig COMMAND {run})\n")
            (folder / "tests/rig/steps.sh").write_text("".join(f"{step}\n" for step in steps))
            (folder / PAGES[0]).write_text("".join(f"| {number} | a row |\n" for number in rows if number != skipped_line))
            (folder / PAGES[1]).write_text("")
            return list(problems_of(folder))

    steps = {number: f'step "row {number}"  # [F{number}]' for number in RIG_ROWS if number not in NOT_IN_RIG}

    def expect(what, found, expected):
        if len(found) != len(expected) or any(text not in line for line, text in zip(found, expected)):
            sys.exit(f"catalogue_rows.py: {what}: found {found}, expected {expected}")

    expect("each row is where it belongs", problems_with(steps.values()), [])
    gone = {number: step for number, step in steps.items() if number != 53}
    expect("a step is gone, though a test elsewhere bears its number", problems_with(gone.values()), ["row 53: found no step"])
    expect("a step has lost its number", problems_with([*gone.values(), 'step "row 53"']), ["row 53: found no step"])
    expect("a number stands in another comment", problems_with([*gone.values(), "# [F53]"]), ["row 53: found no step"])
    several = [*gone.values(), 'end_while_closed "two rows" kill -KILL  # [F52][F53]']
    expect("a step bears two numbers", problems_with(several), [])
    expect("a row that is excepted has a step", problems_with([*steps.values(), 'step "asleep"  # [F69]']), ["steps.sh: found a step that bears [F69]"])
    expect("no test runs the script", problems_with(steps.values(), run="${rig}/other.sh"), [f"row {number}: found no step" for number in steps])
    expect("a row has no test at all", problems_with(steps.values(), 7), ["row 7: found no test"])
    expect("a row has no line", problems_with(steps.values(), skipped_line=104), ["row 104: found on neither of"])
    print("catalogue_rows.py: finds what it should")


def main():
    if sys.argv[1:] == ["--self-test"]:
        return self_test()
    if sys.argv[1:]:
        sys.exit(__doc__)
    problems = list(problems_of(pathlib.Path(__file__).resolve().parents[2]))
    print("\n".join(problems) or f"{LAST_OF_CATALOGUE} rows: each has a test and a line on a page")
    sys.exit(1 if problems else 0)


main()
