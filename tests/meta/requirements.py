#!/usr/bin/env python3
"""Every requirement has a test that bears its identifier as a tag, but for those of WITHOUT_TEST, a list that may only become shorter. Every
tag that looks like an identifier is a requirement's, a row's of the catalogue ([F17]) or an invariant's ([I4], [RL]). A requirement all of
whose tests bear more than five others has no test of its own, and is refused.

docs/requirements.rows says of each requirement with a test what its tests assert. docs/requirements.md is made of it and of the tests; without an option this checks that the page is what they give.

usage: tests/meta/requirements.py [--write | --self-test]
"""
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
ROWS = ROOT / "docs/requirements.rows"
PAGE = ROOT / "docs/requirements.md"
STATES = ("met", "part", "open", "hardware")
# Nothing is built for these yet (state open), so no test shows them. Nothing may be added; what gets a test is taken out.
WITHOUT_TEST = set("CHG_1 CHG_2 CHG_3 CHG_4 CHG_5".split())
IDENTIFIER = re.compile(r"(?:BMS_F|BMS_NF|PB_F|PB_NF)\.\d+[a-z]?|(?:MMU|BMU|FS|RR|VEH|SOE|POW|AIR|SEC|RES|CHG)_[A-Z0-9]+[a-z]?")
ASSERTED = re.compile(rf"({IDENTIFIER.pattern}): (\S.*)")
# Tags of tests are in small letters otherwise.
LOOKS_LIKE_ONE = re.compile(r".*[A-Z].*")
# tests/meta/catalogue_rows.py holds the rows.
OTHER_NUMBERED = re.compile(r"F\d+|I\d+|RL")
SHARED_MAX = 5
# A text may be several literals, one behind the other.
TEXTS = r'((?:"(?:[^"\\]|\\.)*"\s*)+)'
TEST_CASE = re.compile(r"(?:TEST_CASE|SCENARIO)\(\s*" + TEXTS + r",\s*" + TEXTS + r"\)", re.DOTALL)
# More than these are only counted: the page is for reading, the tag finds them all.
SHOWN_MAX = 3

HEAD = """# Requirements

What is asked for, how far it is, where to find it in the code, and which tests show it. `met`: everything the requirement asks of
this program is there; `part`: what is there is named, the rest is not built yet; `open`: not built yet; `hardware`: a property of a
board, here a parameter of the emulated one. A test bears the identifiers of what it shows as tags: `build/bin/test_unit "[FS_2]"`
runs the unit tests that show FS_2. `tests/meta/requirements.py --write` makes this page, and fails where a requirement has no test,
but for a list of {without_test} `open` ones that may only become shorter. What the tests assert is what would have to fail without the
requirement.

| id | state | what it asks | what its tests assert | built in | shown by |
|---|---|---|---|---|---|
""".format(without_test=len(WITHOUT_TEST))


def literal(text):
    return "".join(re.findall(r'"((?:[^"\\]|\\.)*)"', text)).replace('\\"', '"').replace("\\\\", "\\")


def read_rows():
    """The rows, and of each identifier what its tests assert."""
    rows, asserted = [], {}
    for number, line in enumerate(ROWS.read_text().splitlines(), 1):
        if line.startswith("#") or not line.strip():
            continue
        if found := ASSERTED.fullmatch(line):
            identifier, text = found.groups()
            if identifier in asserted or "|" in text:
                sys.exit(f"{ROWS}:{number}: found '{line}', expected one text for {identifier}, without '|'")
            asserted[identifier] = text
            continue
        cells = [cell.strip() for cell in line.split("|")]
        if len(cells) != 5 or not IDENTIFIER.fullmatch(cells[0]) or cells[1] not in STATES:
            sys.exit(f"{ROWS}:{number}: found '{line}', wanted identifier | one of {', '.join(STATES)} | text | files | pages")
        rows.append(cells)
    return rows, asserted


def test_cases():
    """Of each test case (program, name, tags)."""
    for path in sorted((ROOT / "tests").rglob("*.cpp")):
        for name, tags in TEST_CASE.findall(path.read_text()):
            # CMake's lists are cut at them: ctest would look for two halves, find neither, and say that both passed.
            if ";" in literal(name):
                sys.exit(f"{path}: found ';' in the name '{literal(name)}', wanted one that ctest can run")
            yield path.relative_to(ROOT / "tests").parts[0], literal(name), re.findall(r"\[([^\]]+)\]", literal(tags))
    for path in sorted((ROOT / "tests/scenario/accept").glob("*.scn")):
        text = path.read_text()
        said, shows = re.search(r"^# A test: (.+)$", text, re.M), re.search(r"^# Shows \[([^\]]+)\]\.$", text, re.M)
        if not said or not shows:
            sys.exit(f"{path}: found no line '# A test: ...' or '# Shows [ID, ID].', expected both")
        yield "script", said[1].rstrip("."), re.split(r", *", shows[1])


def tests_by_requirement(cases):
    """Of each identifier the tests that bear it, (program, name): those first that are about the fewest others."""
    found = {}
    for program, name, tags in cases:
        borne = list(filter(IDENTIFIER.fullmatch, tags))
        for identifier in borne:
            found.setdefault(identifier, []).append((len(borne), program, name))
    return {identifier: [test[1:] for test in sorted(tests, key=lambda test: test[0])] for identifier, tests in found.items()}


def problems_of_tags(cases):
    """Tags that look like an identifier and are none, and requirements without a test of their own."""
    others = {}
    for program, name, tags in cases:
        borne = [tag for tag in tags if IDENTIFIER.fullmatch(tag)]
        for tag in tags:
            if LOOKS_LIKE_ONE.fullmatch(tag) and tag not in borne and not OTHER_NUMBERED.fullmatch(tag):
                yield f"[{tag}] of a test ({program}: {name}) looks like an identifier and is none"
        for tag in borne:
            others.setdefault(tag, []).append(len(borne) - 1)
    for tag, counts in sorted(others.items()):
        if min(counts) > SHARED_MAX:
            yield f"{tag}: each of its tests bears more than {SHARED_MAX} other identifiers, expected one that is about {tag}"


def shown_by(tests, pages):
    parts = [f"{kind}: {name.replace('|', '/')}" for kind, name in tests[:SHOWN_MAX]]
    if len(tests) > SHOWN_MAX:
        parts.append(f"and {len(tests) - SHOWN_MAX} more")
    return "; ".join(parts + ([pages] if pages else []))


def missing_files(cell, tracked):
    """What stands in backquotes as a file and is none: by its path, or by the end of one."""
    for name in re.findall(r"`([^`]+)`", cell):
        if not any(path == name or path.endswith("/" + name) or path.startswith(name) for path in tracked):
            yield name


def problems_of(rows, tests, tracked):
    known = [row[0] for row in rows]
    for identifier, state, _, built_in, _ in rows:
        if identifier not in tests and identifier not in WITHOUT_TEST:
            yield f"{identifier} is called {state}, but no test bears [{identifier}]"
        if identifier in WITHOUT_TEST and (identifier in tests or state != "open"):
            yield f"{identifier} is called {state} or has a test: take it out of WITHOUT_TEST of {pathlib.Path(__file__).name}"
        if state in ("met", "part") and not built_in:
            yield f"{identifier} is called {state}, but nothing says where it is built"
        for name in missing_files(built_in, tracked):
            yield f"{identifier}: there is no {name}"
        if known.count(identifier) > 1:
            yield f"{identifier} is listed twice"
    for identifier in sorted(WITHOUT_TEST - set(known)):
        yield f"{identifier} of WITHOUT_TEST is not listed"
    for identifier in sorted(set(tests) - set(known)):
        yield f"[{identifier}] is borne by a test ({tests[identifier][0][1]}), but not listed"


def problems_of_asserted(tests, asserted):
    for identifier in sorted(set(tests) - set(asserted)):
        yield f"{identifier} has a test, but nothing says what it asserts: a line '{identifier}: text' at the end"
    for identifier in sorted(set(asserted) - set(tests)):
        yield f"{identifier} has no test that could assert '{asserted[identifier]}'"


def self_test():
    shown = {"FS_1": [("unit", "a")]}
    by_count = tests_by_requirement([("unit", "a", ["FS_1", "FS_2"]), ("unit", "b", ["FS_1", "unit"])])
    assert by_count == {"FS_1": [("unit", "b"), ("unit", "a")], "FS_2": [("unit", "a")]}, by_count
    assert list(problems_of_asserted(shown, {"FS_1": "text"})) == []
    assert len(list(problems_of_asserted(shown, {}))) == 1 and len(list(problems_of_asserted({}, {"FS_1": "text"}))) == 1
    assert ASSERTED.fullmatch("BMS_F.2b: text") and not ASSERTED.fullmatch("BMS_F.2b: ") and not ASSERTED.fullmatch("XY_1: text")
    many = ["FS_1", "FS_2", "FS_3", "FS_4", "FS_5", "FS_6", "FS_7"]
    found = list(problems_of_tags([("unit", "a", many), ("unit", "b", ["FS_1", "unit"]), ("unit", "c", ["FS_2", "F17", "I4", "RL"])]))
    assert [text.split(":")[0] for text in found] == many[2:], found
    for tag in ("SEC_1", "BMS_F.2b", "PB_NF.3", "MMU_7b", "CHG_5", "VEH_1"):
        assert list(problems_of_tags([("unit", "a", [tag])])) == [], tag
    for tag in ("BMS_F2", "BMSF.2", "Fs_2", "XY_1", "F1b", "MMU-7", "UPPER"):
        assert len(list(problems_of_tags([("unit", "a", [tag])]))) == 1, tag
    def found(identifier, state, tests):
        row = [identifier, state, "asks", "`docs/`" if state != "open" else "", ""]
        others = [[other, "open", "asks", "", ""] for other in WITHOUT_TEST if other != identifier]
        return list(problems_of([row] + others, tests, ["docs/requirements.md"]))
    listed = sorted(WITHOUT_TEST)[0]
    shown = [("unit", "a")]
    assert found("FS_1", "met", {"FS_1": shown}) == [] and found(listed, "open", {}) == []
    for identifier, state, tests in (("FS_1", "met", {}), ("FS_1", "open", {}), ("FS_1", "hardware", {}), (listed, "open", {listed: shown}),
                                     (listed, "met", {}), ("FS_1", "met", {"FS_1": shown, "FS_2": shown})):
        assert len(found(identifier, state, tests)) == 1, (identifier, state, tests, found(identifier, state, tests))
    print("requirements.py: tags are told apart, a requirement without a test is refused, and so is a list that is longer than need be")


def main():
    if sys.argv[1:] == ["--self-test"]:
        return self_test()
    cases = list(test_cases())
    (rows, asserted), tests = read_rows(), tests_by_requirement(cases)
    tracked = subprocess.run(["git", "-C", ROOT, "ls-files"], check=True, capture_output=True, text=True).stdout.splitlines()
    problems = list(problems_of(rows, tests, tracked)) + list(problems_of_tags(cases)) + list(problems_of_asserted(tests, asserted))
    page = HEAD + "".join(
        f"| {name} | {state} | {asks} | {asserted.get(name, '')} | {built_in} | {shown_by(tests.get(name, []), pages)} |\n"
        for name, state, asks, built_in, pages in rows)
    if sys.argv[1:] == ["--write"]:
        PAGE.write_text(page)
    elif sys.argv[1:]:
        sys.exit(__doc__)
    elif PAGE.read_text() != page:
        problems.append(f"{PAGE.name} is not what its rows and the tests say; write it anew: tests/meta/requirements.py --write")
    for problem in problems:
        print(f"docs/requirements.rows: {problem}", file=sys.stderr)
    sys.exit(1 if problems else 0)


main()
