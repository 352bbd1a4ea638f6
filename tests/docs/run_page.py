#!/usr/bin/env python3
"""Runs the commands of a page of the documentation, and holds what they print against what the page shows.

    run_page.py BIN_DIRECTORY SOURCE_DIRECTORY PAGE.md [STOP_MS]

A page is one session of one shell, in a folder of its own that has config/, vcan-fixtures/ and build/bin as the project has them. What is run is marked by a
comment, which readers do not see:

    <!-- run -->               the ```console block that follows: "$ " is a command, "> " goes on with it, the rest is what it
                               prints, on standard output and standard error
    <!-- run until -->         the same, each command again and again until it prints that: for what takes a moment. A reader
                               is slower than a machine; these are looks, and may be repeated
    <!-- run installed -->     as "run", of what needs an installed package: /etc/bmud and /usr/share/bmud are folders of the
                               session, and "sudo" is left out
    <!-- run hidden            commands up to the closing "-->", which end with 0: what the reader has done on another page
    <!-- write FILE -->        the block that follows becomes that file

Where both are compared, runs of spaces are alike, a line "..." stands for any lines, "..." at the end of a line for the rest of
it with the spaces before, and a number for any number with as many digits behind its point, so that times and measured values may differ; spans of time,
dates and hashes stand for others of their kind, and a bar of the live picture for any bar of its length. Numbers that name something
are that number: behind the words of NAMING (but for a module's voltage and a measured current), and within words. A whole number before
a word of COUNTED is that number, too: a program or a pack file fixes how many there are. A page that shows such a number of a reply in
JSON puts the word behind it. Trailing spaces do not count. A command that prints nothing on the page prints nothing and ends with 0.

With BMUD_REWRITE in the environment the page is written anew instead, with what commands print now.

The bus unix:bench of the pages is one of this run. The daemon opens when the machine holds it up for too long, and modules fall silent
when it holds up the emulator; both say so in their logs. Then the whole page is run again, twice at most. Any other difference fails.

With STOP_MS the page's daemons are stopped for so long, again and again, and the page has to bear with it.
"""
import os
import re
import select
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path

UNTIL_S = 120.0
# A driver who turns the key again drives after the waiting time of the opening, 10 s, and what a drive shows takes as long.
UNTIL_HELD_UP_S = 40.0
COMMAND_S = 120.0
END_S = 30.0
AGAIN_S = 0.05
ATTEMPTS = 3
# What daemon and emulator say in their logs when the machine held them up.
LATE = "control cycle too late"
HELD_UP = ("control loop: stalled for", LATE, "because the process was stalled")
# These open a pack where they have to wait for compilers. Where this is permitted the scheduler prefers them, and nothing else of a page:
# who asks, or computes for seconds, would keep them from the processor.
PREFERRED = ("bmud", "mmusim")
INSTALLED = ("/etc/bmud", "/usr/share/bmud")
END = "--- end of the command:"
# A daemon that is stopped by STOP_MS runs for so long in between.
RUNS_S = 0.5

NAMING = r"(?:(?:modules?|at most)(?! \d+\.\d+ [AV]\b)|cell|no\.|nodes?|ended with|, limit|expected|found|serial number)"
# What is counted and not measured. Frames, decisions and observations depend on when a command looks.
COUNTED = r"(?:faults?|cells?|modules?|parallel|parts?)"
KINDS = [
    ("rest", r"\s*\.\.\.$"),
    ("date", r"\d{4}-\d\d-\d\d[ T]\d\d:\d\d:\d\d(?:\.\d+)?(?:[+-]\d\d:\d\d)?"),
    ("stamp", r"\d{8}T\d{6}\.\d{3}Z"),
    ("hash", r"\b[0-9a-f]{16}\b"),
    ("name", NAMING + r" \d+(?:\.\d+)*(?!\w)"),
    ("count", r"(?<![\w.])\d+ " + COUNTED + r"\b"),
    ("span", r"(?<![\w.])(?:\d+ (?:h|min) )?\d+(?:\.\d+)? (?:ms|s|min|h)\b"),
    ("number", r"(?<![\w.])-?\d+(?:\.\d+)?(?!\w)"),
    ("bar", r"[▁▂▃▄▅▆▇█░]+"),
    ("space", r"\s+"),
    ("text", r"."),
]
TOKEN = re.compile("|".join(f"(?P<{kind}>{pattern})" for kind, pattern in KINDS))


class Different(Exception):
    """What a command did is not what the page shows."""


@dataclass
class Step:
    """A command with what it should print; or a file to be written."""

    line: int
    command: str = ""
    expected: list = field(default_factory=list)
    until: bool = False
    hidden: bool = False
    file: str = ""
    installed: bool = False


def pattern_of_token(kind, text):
    if kind == "rest":
        return r"[^\n]*"
    if kind in ("name", "count", "text"):
        return re.escape(text)
    if kind == "space":
        return r"\s+"
    if kind == "number":
        digits = len(text.partition(".")[2])
        return r"-?\d+" + (rf"\.\d{{{digits}}}" if digits else "")
    if kind == "bar":
        return rf"[▁▂▃▄▅▆▇█░]{{{len(text)}}}"
    return f"(?:{dict(KINDS)[kind]})"


def pattern_of(expected):
    """What output of these lines has to match, as a whole."""
    parts = []
    for line in expected:
        if line.strip() == "...":
            parts.append(r"(?:[^\n]*\n)*?")
            continue
        tokens = TOKEN.finditer(line.rstrip())
        parts.append("".join(pattern_of_token(t.lastgroup, t.group()) for t in tokens) + r"[ \t]*\n")
    return re.compile("".join(parts))


def split_block(lines, first_line, how):
    """The commands of a console block with what each prints."""
    steps = []
    for number, line in enumerate(lines, first_line):
        if line.startswith("$ "):
            steps.append(Step(number, line[2:], until=how == "run until", installed=how == "run installed"))
        elif not steps:
            raise Different(f"line {number}: a console block begins with a command")
        elif line.startswith("> ") and not steps[-1].expected:
            steps[-1].command += "\n" + line[2:]
        else:
            steps[-1].expected.append(line)
    return steps


def fenced(lines, index):
    """The block whose fence is at this index: its lines, and the index behind it."""
    if index >= len(lines) or not lines[index].startswith("```"):
        raise Different(f"line {index + 1}: a block is wanted here")
    end = next((i for i in range(index + 1, len(lines)) if lines[i].startswith("```")), None)
    if end is None:
        raise Different(f"line {index + 1}: the block does not end")
    return lines[index + 1:end], end + 1


def steps_of(text):
    lines = text.splitlines()
    steps, index = [], 0
    while index < len(lines):
        mark = re.fullmatch(r"<!-- (run hidden|run until|run installed|run|write (\S+))( -->)?", lines[index])
        if not mark:
            index += 1
            continue
        what, start = mark.group(1), index + 1
        if what == "run hidden":
            index = next((i for i in range(start, len(lines)) if lines[i] == "-->"), None)
            if index is None:
                raise Different(f"line {start}: the comment does not end")
            steps.append(Step(start, "\n".join(lines[start:index]), hidden=True))
            continue
        block, index = fenced(lines, start)
        if mark.group(2):
            steps.append(Step(start, file=mark.group(2), expected=block))
        else:
            steps += split_block(block, start + 2, what)
    return steps


class Session:
    """A shell in a folder of its own."""

    def __init__(self, programs, source, page, stop_s=0.0):
        self.stop_s = stop_s
        self.folder = Path(tempfile.mkdtemp(prefix="bmud-docs."))
        for name in ("config", "vcan-fixtures"):
            (self.folder / name).symlink_to(source / name)
        # What a package installs (packaging/CMakeLists.txt).
        (self.folder / "etc/bmud").mkdir(parents=True)
        (self.folder / "usr/share").mkdir(parents=True)
        (self.folder / "usr/share/bmud").symlink_to(source / "config")
        (self.folder / "build").mkdir()
        (self.folder / "build/bin").symlink_to(programs)
        preferred = self.folder / ".preferred"
        preferred.mkdir()
        for name in PREFERRED:
            shim = preferred / name
            shim.write_text("#!/usr/bin/env bash\nrenice -n -15 -p $$ >/dev/null 2>&1\n"
                            f"exec -a {name} {shlex.quote(str(programs / name))} \"$@\"\n")
            shim.chmod(0o755)
        self.bus = f"bench-{os.getpid()}"
        settings = {"PATH": f"{preferred}:{programs}:{os.environ['PATH']}", "HOME": str(self.folder), "TZ": "UTC", "LC_ALL": "C.UTF-8",
                    "SOURCE": str(source), "PAGE": str(page), "TMPDIR": str(self.folder)}
        self.shell = subprocess.Popen(["bash", "--noprofile", "--norc", "-O", "expand_aliases"], cwd=self.folder, env=settings,
                                      stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                      # A group to be ended, and no session: between sessions of a machine with autogroup scheduling
                                      # nice values do not count, and each has an equal share.
                                      preexec_fn=os.setpgrp)
        self.rest = b""

    def end(self):
        """Ends what the page has started: the shell's process group, which is ours alone."""
        for signal_number in (15, 9):
            try:
                os.killpg(self.shell.pid, signal_number)
            except ProcessLookupError:
                break
            self.drain(END_S)
        self.shell.wait()

    def remove(self):
        Path(f"/dev/shm/bmud-bus.{self.bus}").unlink(missing_ok=True)
        shutil.rmtree(self.folder)

    def drain(self, at_most_s):
        """Until no process of the group lives: what the emulator was held up for it logs at its end, perhaps not to our pipe."""
        deadline = time.monotonic() + at_most_s
        while self.has_processes() and time.monotonic() < deadline:
            if select.select([self.shell.stdout], [], [], AGAIN_S)[0] and not os.read(self.shell.stdout.fileno(), 65536):
                time.sleep(AGAIN_S)

    def has_processes(self):
        """Without those that have ended: where nobody waits for orphans they stay in the group."""
        for stat in Path("/proc").glob("[0-9]*/stat"):
            try:
                state, _, group = stat.read_text(errors="replace").rpartition(")")[2].split()[:3]
            except (OSError, ValueError):
                continue
            if int(group) == self.shell.pid and state not in "ZX":
                return True
        return False

    def was_held_up(self):
        logs = [log.read_text(errors="replace") for log in self.folder.rglob("*.log") if log.is_file()]
        # What the stops themselves cause excuses no difference.
        return any(words in log for log in logs for words in HELD_UP if self.stop_s == 0 or words != LATE)

    def run_installed(self, command):
        """The same with the folders of a package in the session's."""
        for place in INSTALLED:
            command = command.replace(place, f"{self.folder}{place}")
        output, status = self.run(re.sub(r"\bsudo ", "", command))
        return output.replace(str(self.folder), ""), status

    def run(self, command):
        """What the command prints, and its exit status."""
        script = "{ " + command.replace("unix:bench", f"unix:{self.bus}") + "\n} </dev/null\n"
        self.shell.stdin.write((script + f"printf '\\n{END} %d\\n' $?\n").encode())
        self.shell.stdin.flush()
        deadline = time.monotonic() + COMMAND_S
        while not (end := re.search(rb"\n" + END.encode() + rb" (\d+)\n", self.rest)):
            left = deadline - time.monotonic()
            if left <= 0 or not select.select([self.shell.stdout], [], [], left)[0]:
                raise Different(f"'{command}' does not end within {COMMAND_S:g} s")
            more = os.read(self.shell.stdout.fileno(), 65536)
            if not more:
                raise Different(f"'{command}' ended the shell")
            self.rest += more
        output, self.rest = self.rest[:end.start()], self.rest[end.end():]
        return output.decode(errors="replace").replace(self.bus, "bench"), int(end.group(1))


class Stops:
    """Stops the daemons of a session, again and again, as a machine does that gives them no processor."""

    def __init__(self, session):
        self.session, self.stop_s, self.count = session, session.stop_s, 0
        self.is_over = threading.Event()
        self.thread = threading.Thread(target=self.run)
        if self.stop_s > 0:
            self.thread.start()

    def end(self):
        self.is_over.set()
        if self.thread.is_alive():
            self.thread.join()

    def daemons(self):
        for stat in Path("/proc").glob("[0-9]*/stat"):
            try:
                head, _, rest = stat.read_text(errors="replace").rpartition(")")
            except OSError:
                continue  # It has ended.
            number, _, name = head.partition(" (")
            if name == "bmud" and int(rest.split()[2]) == self.session.shell.pid:
                yield int(number)

    def signal_all(self, processes, number):
        for process in processes:
            try:
                os.kill(process, number)
            except ProcessLookupError:
                pass  # It has ended.

    def run(self):
        while not self.is_over.wait(RUNS_S):
            stopped = list(self.daemons())
            self.count += len(stopped)
            self.signal_all(stopped, signal.SIGSTOP)
            self.is_over.wait(self.stop_s)
            self.signal_all(stopped, signal.SIGCONT)


def is_as_shown(step, output, status):
    if step.hidden:
        return status == 0
    if not step.expected and status != 0:
        return False
    # The last line of a command need not end with a new line.
    text = output if not output or output.endswith("\n") else output + "\n"
    return pattern_of(step.expected).fullmatch(text) is not None


def perform(session, step):
    if step.file:
        (session.folder / step.file).write_text("\n".join(step.expected) + "\n")
        return
    began = time.monotonic()
    looks = 0
    while True:
        looks += 1
        output, status = (session.run_installed if step.installed else session.run)(step.command)
        if is_as_shown(step, output, status):
            return
        passed_s = time.monotonic() - began
        # A pack that was held up has opened: what only a closed one shows does not come any more where no driver turns the key again.
        is_lost = passed_s >= UNTIL_S or (passed_s >= UNTIL_HELD_UP_S and session.was_held_up())
        if not step.until or is_lost:
            wanted = "\n".join(step.expected)
            raise Different(f"line {step.line}: $ {step.command}\n--- the page shows:\n{wanted}\n"
                            f"--- it printed{f', at the last of {looks} looks' if step.until else ''}, and ended with {status}:\n{output}")
        time.sleep(AGAIN_S)


def attempt(programs, source, page, steps, stop_s=0.0):
    """None, or what was different and whether the machine was at fault."""
    session = Session(programs, source, page, stop_s)
    stops = Stops(session)
    difference = None
    try:
        for step in steps:
            perform(session, step)
        if stop_s > 0 and stops.count == 0:
            raise Different("no daemon was stopped")
    except Different as found:
        difference = str(found)
    finally:
        stops.end()
        session.end()
        failure = difference and (difference, session.was_held_up())
        session.remove()
    return failure


def rewrite(programs, source, page, steps):
    """Shows what commands print now where the page shows all of it: not where it has "...", nor where it waits for something."""
    lines = page.read_text().splitlines()
    session = Session(programs, source, page)
    try:
        shown = []
        for step in steps:
            if step.file or step.hidden or step.until or step.installed or any(line.endswith("...") for line in step.expected):
                perform(session, step)
            else:
                shown.append((step, session.run(step.command)[0].splitlines()))
    finally:
        session.end()
        session.remove()
    for step, output in reversed(shown):
        begin = step.line + step.command.count("\n")
        lines[begin:begin + len(step.expected)] = output
    page.write_text("\n".join(lines) + "\n")


def main():
    programs, source, page = (Path(argument).resolve() for argument in sys.argv[1:4])
    stop_s = float(sys.argv[4]) / 1000 if len(sys.argv) > 4 else 0.0
    # Who ends this run ends what the page has started, too.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    try:
        steps = steps_of(page.read_text())
    except Different as difference:
        print(f"{page}: {difference}")
        return 1
    if not steps:
        print(f"{page}: nothing is marked to be run")
        return 1
    if "BMUD_REWRITE" in os.environ:
        rewrite(programs, source, page, steps)
        return 0
    for _ in range(ATTEMPTS):
        began = time.monotonic()
        failure = attempt(programs, source, page, steps, stop_s)
        if failure is None:
            print(f"{page.name}: {len(steps)} steps as shown, in {time.monotonic() - began:.1f} s")
            return 0
        print(f"{page}: {failure[0]}")
        if not failure[1]:
            return 1
        print("the machine held the daemon up; once more\n")
    return 1


if __name__ == "__main__":
    sys.exit(main())
