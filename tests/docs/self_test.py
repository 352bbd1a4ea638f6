#!/usr/bin/env python3
"""The runner of pages is a test only if it can fail: what it must take for the same, and what for different; and how it reads a page.

    self_test.py BIN_DIRECTORY SOURCE_DIRECTORY
"""
import os
import sys
from pathlib import Path

sys.dont_write_bytecode = True
import check_pages  # noqa: E402
import run_page  # noqa: E402

# What the page shows, what is printed.
SAME = [
    ("State  open for 1.8 s", "State       open for 2 min 5 s"),
    ("pack 191.277 V   link 0.000 V", "pack 88.1 V".replace("88.1", "88.123") + " link -0.001 V"),
    ("first\n...\nlast", "first\nlast"),
    ("first\n...\nlast", "first\na\nb\nlast"),
    ("configuration 1afe0c83d739c982", "configuration 0000000000000000"),
    ("2026-11-23 15:23:44.615 info    stopped", "2027-01-01 00:00:00.001 info stopped"),
    ("blackbox-20261123T152333.130Z-fault.log.zst", "blackbox-20270101T000000.000Z-fault.log.zst"),
    ("cell 2.7 (no. 19): 2.7456 V", "cell 2.7 (no. 19): 2.6000 V"),
    ("status active, ...", "status active, cell 2.7"),
    ("open   ...", "open"),
    ("open   ...", "open   tick_overrun"),
    ('{"n":1,"v":[3984900]}', '{"n":22,"v":[3]}'),
    ("decision  at most 34.157 A of 80.000 A", "decision  at most 33.991 A of 80.000 A"),
    ("C   module 46.248 V   last answer 47 ms ago", "C   module 44.794 V   last answer 7 ms ago"),
    ("pack 184.2 V ██▇░░", "pack 170.1 V █▁░░░"),
    ("1872 decisions, 8707 observations, 1 part", "1871 decisions, 8706 observations, 1 part"),
    ("", ""),
]
DIFFERENT = [
    ("Faults  none", "Faults  module_lost"),
    ("4 modules, 48 cells, 97 faults", "4 modules, 48 cells, 83 faults"),
    ("4 modules, 48 cells", "4 modules, 47 cells"),
    ("8707 observations, 1 part", "8707 observations, 2 parts"),
    ("one\ntwo", "one"),
    ("one", "one\ntwo"),
    ("one", ""),
    ("", "one"),
    ("pack 191.277 V", "pack 191.28 V"),
    ("pack 191.277 V", "pack 191.277 mV"),
    ("cell 2.7 (no. 19)", "cell 2.8 (no. 19)"),
    ("cell 2.7 (no. 19)", "cell 2.7 (no. 20)"),
    (", limit 2.8000 V", ", limit 2.9000 V"),
    ("ended with 3", "ended with 0"),
    ("demo 48s", "demo 96s"),
    ("first\n...\nlast", "first\nother"),
    ("for 1.8 s", "for ever"),
    ("found 4300, expected at most 4250", "found 4300, expected at most 4200"),
    ("pack 184.2 V ██▇░░", "pack 184.2 V ██▇░"),
    ("pack 184.2 V ██▇░░", "pack 184.2 V"),
]
PAGE = """
<!-- write words.txt -->
```
one 1
```
<!-- run hidden
mkdir there
-->
<!-- run -->
```console
$ cat words.txt; echo "ended with $?"
one 7
ended with 0
$ cd there
$ ls ../words.txt
../words.txt
```
<!-- run installed -->
```console
$ echo one | sudo tee /etc/bmud/words.txt
one
$ ls /etc/bmud/words.txt /usr/share/bmud/pack.schema.json
/etc/bmud/words.txt
/usr/share/bmud/pack.schema.json
```
<!-- run until -->
```console
$ echo x >>looks; wc -l <looks
3
$ test $(wc -l <looks) -gt 3 || { echo x >>looks; false; }
```
"""
BAD = [
    ("prints other words", "<!-- run -->\n```console\n$ echo yes\nno\n```\n"),
    ("fails in silence", "<!-- run -->\n```console\n$ false\n```\n"),
    ("an option that is gone", "<!-- run -->\n```console\n$ bmud --no-such-option\n```\n"),
    ("a hidden command fails", "<!-- run hidden\nfalse\n-->\n"),
    ("waits in vain", "<!-- run until -->\n```console\n$ echo yes\nno\n```\n"),
    ("ends the shell", "<!-- run -->\n```console\n$ exit\n```\n"),
]
HELD_UP = """
<!-- run hidden
echo "control loop: stalled for 140 ms" >bmud.log
-->
<!-- run until -->
```console
$ echo open
closed
```
"""
BAD_FORM = ["<!-- run -->\nno block\n", "<!-- run -->\n```console\n$ echo\n", "<!-- run hidden\ntrue\n", "<!-- run -->\n```\nx\n```\n"]
UNKNOWN = [("bmud", " --no-such-option"), ("bmuctl", " nonsense"), ("bmuctl", " modules --authorised"), ("mmusim", " --pack")]


def lines(text):
    return text.split("\n") if text else []


def takes(shown, printed):
    step = run_page.Step(1, "command", lines(shown))
    return run_page.is_as_shown(step, printed, 0)


def preference_problem(programs, source):
    """A daemon is preferred only to processes of its session, where the kernel schedules sessions (autogroup)."""
    session = run_page.Session(programs, source, Path("page"))
    try:
        if os.getsid(session.shell.pid) != os.getsid(0):
            return "a page's shell has a session of its own: nice values do not count outside of it"
        if os.getpgid(session.shell.pid) != session.shell.pid:
            return "a page's shell has no process group of its own: it cannot be ended with all that it has started"
    finally:
        session.end()
        session.remove()
    return None


def complaints(programs, source):
    for shown, printed in SAME:
        if not takes(shown, printed):
            yield f"taken for different: {shown!r}, {printed!r}"
    for shown, printed in DIFFERENT:
        if takes(shown, printed):
            yield f"taken for the same: {shown!r}, {printed!r}"
    if failure := run_page.attempt(programs, source, Path("page"), run_page.steps_of(PAGE)):
        yield f"a good page fails: {failure[0]}"
    if problem := preference_problem(programs, source):
        yield problem
    run_page.UNTIL_HELD_UP_S = 0.2
    failure = run_page.attempt(programs, source, Path("page"), run_page.steps_of(HELD_UP))
    if failure is None or not failure[1] or "at the last of" not in failure[0]:
        yield f"waits on, or does not say so, although the machine held up the daemon: {failure}"
    run_page.UNTIL_S = 0.2
    for what, page in BAD:
        if run_page.attempt(programs, source, Path("page"), run_page.steps_of(page)) is None:
            yield f"passes, although it {what}"
    for page in BAD_FORM:
        try:
            run_page.steps_of(page)
            yield f"is read, although it has no form: {page!r}"
        except run_page.Different:
            pass
    knower = check_pages.Programs(programs)
    for program, arguments in UNKNOWN[:-1]:
        if knower.problem_with(program, arguments) is None:
            yield f"{program}{arguments} is taken for known"
    if problem := knower.problem_with(*UNKNOWN[-1]):
        yield f"mmusim --pack: {problem}"


def main():
    programs, source = (Path(argument).resolve() for argument in sys.argv[1:3])
    found = list(complaints(programs, source))
    print("\n".join(found))
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
