#!/usr/bin/env python3
"""Every block of a page that shows commands, or what a program prints, is run by a test, or is on the list of exceptions.

    check_shown.py SOURCE_DIRECTORY

A block, fenced or indented, may be one of these without being run: JSON; a block whose fence names another language than console
(scenarios.md: tests/scenario/script_test.cpp runs its scripts). Any other block needs a mark of run_page.py, or the mark

    <!-- rig NAME -->

with an empty line behind it before an indented block, which a guest script of tests/rig runs by "run_shown PAGE NAME"; or an entry in
not_run.txt, which gives its page, its first line and the reason. An entry that no block needs is an error, and so is a mark without such
a call, or a call without its mark.
"""
import re
import sys
import tempfile
from pathlib import Path

EXCEPTIONS = "tests/docs/not_run.txt"
MARK = re.compile(r"<!-- (?:run(?: until| installed)?|write \S+) -->")
RIG_MARK = re.compile(r"<!-- rig (\S+) -->")
RIG_CALL = re.compile(r"\brun_shown ([a-z-]+) ([a-z-]+)")
OUTPUT_LANGUAGES = ("", "console", "text")


def blocks_of(text):
    """Each block as its first line's number, its language ("" without one), its lines, and whether it bears a mark."""
    lines = text.splitlines()
    index = 0
    while index < len(lines):
        begin = index
        if lines[index].startswith("<!--"):
            while index < len(lines) and not lines[index].endswith("-->"):
                index += 1
            index += 1
        elif lines[index].startswith("```"):
            index = next((i for i in range(begin + 1, len(lines)) if lines[i].startswith("```")), len(lines))
            is_marked = begin > 0 and MARK.fullmatch(lines[begin - 1]) is not None
            yield begin + 2, lines[begin][3:].strip(), lines[begin + 1:index], is_marked
            index += 1
        elif lines[index].startswith("    ") and (begin == 0 or not lines[begin - 1].strip()):
            is_marked = begin > 1 and RIG_MARK.fullmatch(lines[begin - 2]) is not None
            while index < len(lines) and (lines[index].startswith("    ") or not lines[index].strip()):
                index += 1
            yield begin + 1, "", [line[4:] for line in lines[begin:index] if line.strip()], is_marked
        else:
            index += 1


def needs_a_mark(language, lines):
    return language in OUTPUT_LANGUAGES and bool(lines) and not lines[0].startswith('"')


def read_exceptions(text):
    """The page and the first line of each, with the reason: lines "PAGE: FIRST LINE" with the reason indented below."""
    found = {}
    for line in text.splitlines():
        if line.startswith("    ") and found:
            found[last] = (found[last] + " " + line.strip()).strip()
        elif line.strip() and not line.startswith("#"):
            page, _, first = line.partition(": ")
            last = (page, first.strip())
            found[last] = ""
    return found


def problems(source, exceptions):
    used = set()
    for page in [source / "README.md", *sorted((source / "docs").rglob("*.md"))]:
        name = str(page.relative_to(source))
        for number, language, lines, is_marked in blocks_of(page.read_text()):
            if is_marked or not needs_a_mark(language, lines):
                continue
            key = (name, lines[0].strip())
            if key in exceptions and key not in used:
                used.add(key)
            else:
                yield f"{name}:{number}: block {lines[0].strip()!r} is not run, expected a mark of run_page.py or a line in {EXCEPTIONS}"
    for key, reason in exceptions.items():
        if key not in used:
            yield f"{EXCEPTIONS}: no block of {key[0]} needs the exception {key[1]!r}"
        if not reason:
            yield f"{EXCEPTIONS}: reason missing for {key[0]}: {key[1]!r}"
        for file in re.findall(r"(?:tests|docs)/[\w./-]*\w", reason):
            if not (source / file).exists():
                yield f"{EXCEPTIONS}: {file} is not there"


def rig_problems(source):
    """Each mark for the rig is called by one of its scripts, and each call has its mark."""
    marks = [(page.stem, name) for page in sorted((source / "docs").glob("*.md"))
             for name in re.findall(rf"^{RIG_MARK.pattern}$", page.read_text(), re.MULTILINE)]
    calls = {call for script in (source / "tests/rig").glob("*.sh") for call in RIG_CALL.findall(script.read_text())}
    for page, name in sorted(set(marks) - calls):
        yield f"docs/{page}.md: found no script of tests/rig with run_shown {page} {name}, expected one for the mark"
    for page, name in sorted(calls - set(marks)):
        yield f"tests/rig: run_shown {page} {name}: found no mark <!-- rig {name} --> in docs/{page}.md"
    for page, name in sorted({mark for mark in marks if marks.count(mark) > 1}):
        yield f"docs/{page}.md: found the mark <!-- rig {name} --> more than once, expected it once"


def complaints():
    """The test itself: which blocks it has to find, and which not."""
    shown = {
        "```console\n$ bmuctl why\nyes\n```": 1,
        "    $ bmuctl why\n    yes\n": 1,
        "```\nbmuctl why\nyes\n```": 1,
        "```\n$ bmuctl why\n```": 1,
        "```text\nyes\n```": 1,
        "```\nbmuctl why \\\n  yes\nbmuctl cells\n```": 1,
        "    sudo systemctl restart bmud\n": 1,
        "<!-- rig name -->\n\n    sudo systemctl restart bmud\n": 0,
        "<!-- rig name -->\n\nand\n\n    sudo systemctl restart bmud\n": 1,
        "<!-- run -->\n```console\n$ bmuctl why\nyes\n```": 0,
        "<!-- run hidden\n    yes\n-->\n": 0,
        "- a list\n    goes on\n": 0,
        "```json\n{}\n```": 0,
    }
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "docs").mkdir()
        page = Path(folder) / "README.md"
        for text, count in shown.items():
            page.write_text(text)
            found = list(problems(Path(folder), {}))
            if len(found) != count:
                yield f"{text!r}: found {found}, expected {count} problem(s)"
        page.write_text("    $ bmuctl why\n    yes\n")
        if list(problems(Path(folder), read_exceptions("README.md: $ bmuctl why\n    a reason\n"))):
            yield "an exception is not applied"
        if len(list(problems(Path(folder), read_exceptions("README.md: $ bmuctl why\n")))) != 1:
            yield "an exception without a reason is not found"
        page.write_text("    $ bmuctl why\n    yes\n\nand\n\n    $ bmuctl why\n    no\n")
        if len(list(problems(Path(folder), read_exceptions("README.md: $ bmuctl why\n    a reason\n")))) != 1:
            yield "an exception is applied to two blocks"
        rig = Path(folder) / "tests/rig"
        rig.mkdir(parents=True)
        (Path(folder) / "docs/page.md").write_text("<!-- rig one -->\n\n    true\n")
        for call, count in (("run_shown page one", 0), ("", 1), ("run_shown page two", 2)):
            (rig / "script.sh").write_text(call + "\n")
            if len(found := list(rig_problems(Path(folder)))) != count:
                yield f"{call!r}: found {found}, expected {count} problem(s)"
        (Path(folder) / "docs/page.md").unlink()
        page.write_text("")
        if len(list(problems(Path(folder), read_exceptions("README.md: $ bmuctl why\n    a reason\n")))) != 1:
            yield "an exception without a block is not found"


def main():
    source = Path(sys.argv[1]).resolve()
    exceptions = read_exceptions((source / EXCEPTIONS).read_text())
    found = [*complaints(), *problems(source, exceptions), *rig_problems(source)]
    print("\n".join(found) or f"every block that shows commands or output is run, but for {len(exceptions)} exceptions")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
