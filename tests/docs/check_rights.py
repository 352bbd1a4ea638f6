#!/usr/bin/env python3
"""Holds the lists of control commands in docs/installing.md and docs/bmuctl.md against the table of docs/socket-protocol.md.

    check_rights.py SOURCE_DIRECTORY

That table is held against the daemon's own by tests/unit/daemon/shell/status/socket_page_test.cpp.
"""
import re
import sys
from pathlib import Path

# The commands of bmuctl that send a command of the socket which takes control; one that is not here is its own name.
SENT_BY = {
    "accept_modules": {"modules accept"},
    "assign_module": {"modules assign"},
    "balance": {"balance --on", "--off"},
}


def control_commands(socket_page):
    """The commands of bmuctl that take control."""
    rows = re.findall(r"^\| `(\w+)` \| ([^|]*) \|", socket_page, re.MULTILINE)
    names = [name for name, right in rows if "control" in right]
    return set().union(*(SENT_BY.get(name, {name}) for name in names))


def listed(text):
    return {code.removeprefix("bmuctl ") for code in re.findall(r"`([^`]+)`", text)}


def found_in(pattern, page):
    match = re.search(pattern, page, re.MULTILINE | re.DOTALL)
    return listed(match.group(1)) if match else set()


def problems(source):
    docs = source / "docs"
    expected = control_commands((docs / "socket-protocol.md").read_text())
    if len(expected) < 5:
        yield f"docs/socket-protocol.md: found only {sorted(expected)} with the right control"
    for page, pattern in (("installing.md", r"may also control: (.*?)\. "), ("bmuctl.md", r"^\| control \|[^|]*\|([^|]*)\|")):
        found = found_in(pattern, (docs / page).read_text())
        if found != expected:
            yield f"docs/{page}: control commands: found {sorted(found)}, expected {sorted(expected)}"


def main():
    found = list(problems(Path(sys.argv[1]).resolve()))
    print("\n".join(found) or "both pages list the commands that take control")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
