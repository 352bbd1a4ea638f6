#!/usr/bin/env python3
"""Holds the table of commands in docs/socket-protocol.md against a running daemon: which commands there are, which keys each
takes, and what its answer has.

    socket_commands.py PAGE.md SOCKET
"""
import json
import re
import socket
import sys
from pathlib import Path

# Asked with what makes them answer without changing anything.
ARGUMENTS = {"assign_module": {"serial_number": 1001, "node": 1}, "watch": {"period_ms": 60000}}


def ask(path, request):
    """The first line of the answer."""
    with socket.socket(socket.AF_UNIX) as connection:
        connection.settimeout(10)
        connection.connect(path)
        connection.sendall(json.dumps(request).encode() + b"\n")
        return json.loads(connection.makefile().readline())


def words(cell):
    return re.findall(r"`(\w+)`", cell)


def rows_of(page):
    """By command: the keys it takes, and those of its answer."""
    lines = Path(page).read_text().splitlines()
    begin = next(i for i, line in enumerate(lines) if line.startswith("| command | right |")) + 2
    rows = {}
    for line in lines[begin:]:
        if not line.startswith("|"):
            break
        command, _, takes, has = line.strip("|").split("|")
        rows[words(command)[0]] = (words(takes), words(has))
    return rows


def main():
    page, path = sys.argv[1:]
    rows = rows_of(page)
    problems = []

    def compare(what, shown, found):
        if sorted(shown) != sorted(found):
            problems.append(f"{what}: the page has {sorted(shown)}, the daemon {sorted(found)}")

    refusal = ask(path, {"cmd": "?"})["error"]["message"]
    compare("commands", rows, refusal.partition(", expected one of ")[2].split(", "))
    for command, (takes, has) in rows.items():
        refusal = ask(path, {"cmd": command, "?": 1})["error"]
        if refusal["code"] == "unknown_command":
            continue
        compare(f"what {command} takes", takes, re.findall(r'"(\w+)"', refusal["message"].partition(" accepts ")[2]))
        answer = ask(path, {"cmd": command, **ARGUMENTS.get(command, {})})
        compare(f"the answer to {command}", has, answer.keys() - {"ok", "cmd"})
    print("\n".join(problems))
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
