#!/usr/bin/env python3
"""clang-tidy finds nothing in the sources that a build folder compiles.

A source in which it found nothing is looked at again only after something has changed that its verdict depends on: the source, a header
that it includes (of others, too), a command that compiles it, a .clang-tidy file, the version of clang-tidy. verdicts.py keeps what it
found nothing in.

Headers are looked at with the sources that include them.

  tests/ci/tidy.py --build build-tidy                         every source
  tests/ci/tidy.py --build build-tidy --part 3/16             every sixteenth, beginning with the third
  tests/ci/tidy.py --build build-tidy --part 3/16 --and FILE  that file besides
  tests/ci/tidy.py --build build-tidy --only FILE             that file and no other
  tests/ci/tidy.py --build build-tidy --again                 whatever is kept

Exit status: 0 nothing found; 1 something found; 2 wrong usage, or the folder's commands cannot be read.
"""

from __future__ import annotations

import argparse
import concurrent.futures
import json
import os
import pathlib
import re
import shlex
import subprocess
import sys

sys.dont_write_bytecode = True

from verdicts import Verdicts, sum_of_file, version_of  # noqa: E402  nothing is left in the folder

PROGRESS_EVERY = 20


def part(text: str) -> slice:
    match = re.fullmatch(r"([1-9]\d*)/([1-9]\d*)", text)
    if not match or int(match[1]) > int(match[2]):
        raise argparse.ArgumentTypeError(f"found '{text}', expected K/N with K from 1 to N, as in 3/16")
    return slice(int(match[1]) - 1, None, int(match[2]))


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, required=True, metavar="FOLDER", help="has compile_commands.json")
    parser.add_argument("--part", type=part, default=slice(None), metavar="K/N", help="every Nth source, beginning with the Kth")
    parser.add_argument("--and", dest="besides", action="append", default=[], metavar="FILE", help="this source, too")
    parser.add_argument("--only", action="append", default=[], metavar="FILE", help="this source and no other")
    parser.add_argument("--again", action="store_true", help="look at all of them, whatever is kept")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--clang-tidy", default="clang-tidy", metavar="PROGRAM")
    return parser.parse_args()


def fail(text: str) -> None:
    print(f"tidy.py: {text}", file=sys.stderr)
    sys.exit(2)


def tracked(root: pathlib.Path, pattern: str) -> list[str]:
    done = subprocess.run(["git", "-C", root, "ls-files", "-z", "--cached", "--others", "--exclude-standard", pattern], stdout=subprocess.PIPE, check=True)
    return [name for name in done.stdout.decode().split("\0") if name and (root / name).is_file()]


def read_commands(build: pathlib.Path, root: pathlib.Path) -> dict[str, list[tuple[str, list[str]]]]:
    """By source, relative to the repository: folder and words of each command that compiles it."""
    path = build / "compile_commands.json"
    try:
        rows = json.loads(path.read_text())
    except (OSError, ValueError) as error:
        fail(f"{path}: {error}; configure the folder with CMake's CMAKE_EXPORT_COMPILE_COMMANDS")
    result: dict[str, list[tuple[str, list[str]]]] = {}
    for row in rows:
        file = pathlib.Path(row["directory"], row["file"]).resolve()
        words = row["arguments"] if "arguments" in row else shlex.split(row["command"])
        if file.is_relative_to(root):
            result.setdefault(str(file.relative_to(root)), []).append((row["directory"], words))
    return result


def without_output(words: list[str]) -> list[str]:
    result = []
    rest = iter(words)
    for word in rest:
        if word in ("-o", "-MF", "-MT", "-MQ"):
            next(rest, None)
        elif word not in ("-c", "-MD", "-MMD"):
            result.append(word)
    return result


def included(folder: str, words: list[str]) -> list[str] | None:
    """The source and all that it includes; None if one is missing, which clang-tidy reports better."""
    done = subprocess.run([*without_output(words), "-M"], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    if done.returncode != 0:
        return None
    names = done.stdout.split(":", 1)[1].replace("\\\n", " ")
    return [os.path.join(folder, name.replace("\\ ", " ")) for name in re.split(r"(?<!\\)\s+", names) if name]


class Keys:
    """What the verdict about a source depends on."""

    def __init__(self, root: pathlib.Path, program: str) -> None:
        self._root = root
        self._common = version_of(program)
        self._common += [f"{name} {sum_of_file(str(root / name))}" for name in tracked(root, "*.clang-tidy")]
        self._common.append(sum_of_file(__file__))

    def lines(self, commands: list[tuple[str, list[str]]]) -> list[str] | None:
        """None if something that it includes is missing."""
        lines = list(self._common)
        for folder, words in commands:
            files = included(folder, words)
            if files is None:
                return None
            lines.append(shlex.join(without_output(words)))
            lines += sorted({f"{os.path.normpath(name)} {sum_of_file(name)}" for name in files})
        # A clone in another folder has the same verdicts.
        return [line.replace(str(self._root), ".") for line in lines]


def look(name: str, commands: list[tuple[str, list[str]]], keys: Keys, verdicts: Verdicts, arguments: argparse.Namespace) -> str | None:
    """What clang-tidy says of a source, "" if that is nothing; None if that is known already."""
    lines = keys.lines(commands)
    kept = verdicts.path(lines) if lines else None
    if kept and kept.exists() and not arguments.again:
        kept.touch()
        return None
    command = [arguments.clang_tidy, "--quiet", f"-p={arguments.build}", name]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    if done.returncode == 0 and not done.stdout.strip():
        # Not if a source or header was edited meanwhile.
        sum_of_file.cache_clear()
        if kept and keys.lines(commands) == lines:
            kept.touch()
        return ""
    return done.stdout if done.stdout.strip() else f"{name}: clang-tidy ended with {done.returncode}: {done.stderr}"


def chosen(commands: dict, root: pathlib.Path, arguments: argparse.Namespace) -> list[str]:
    # Sources of the build that no commit has are generated, and not looked at.
    everything = [name for name in tracked(root, "*.cpp") if name in commands]
    for name in arguments.only:
        if name not in everything:
            fail(f"found {name}, expected a source that {arguments.build} compiles")
    if arguments.only:
        return arguments.only
    return sorted(set(everything[arguments.part]) | (set(arguments.besides) & set(everything)))


def main() -> int:
    arguments = parse_arguments()
    root = pathlib.Path.cwd().resolve()
    commands = read_commands(arguments.build, root)
    names = chosen(commands, root, arguments)
    if not names:
        fail(f"found no source, expected some that {arguments.build} compiles")
    keys = Keys(root, arguments.clang_tidy)
    verdicts = Verdicts("tidy")
    findings = []
    known = 0
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        said = pool.map(lambda name: look(name, commands[name], keys, verdicts, arguments), names)
        for number, (name, text) in enumerate(zip(names, said), start=1):
            known += text is None
            if text:
                findings.append(text)
                print(text, flush=True)
            if number % PROGRESS_EVERY == 0:
                print(f"tidy.py: {number} of {len(names)} sources, found something in {len(findings)}", flush=True)
    verdicts.remove_old()
    errors = sorted({line for text in findings for line in text.splitlines() if re.search(r": (error|warning): ", line) or "ended with" in line})
    print("\n".join([*errors, f"tidy.py: {len(names)} sources, {known} of them known; found something in {len(findings)}"]))
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
