"""Which files decide whether contactors close: files.txt, and for the rest of daemon/core other_files.txt."""

from __future__ import annotations

import os
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent


class WrongList(Exception):
    """A list that does not fit the files that are there."""


def _lines(path: Path) -> list[tuple[int, str]]:
    numbered = enumerate(path.read_text().splitlines(), start=1)
    return [(number, line.strip()) for number, line in numbered if line.strip() and not line.startswith("#")]


def _files(root: Path, place: str, pattern: str) -> list[str]:
    found = sorted(str(path.relative_to(root)) for path in root.glob(pattern) if path.is_file())
    if not found:
        raise WrongList(f"{place}: no file is called {pattern}")
    return found


def place_of(filename: str, root: Path = ROOT) -> str | None:
    """From the top of the project, as the lists have it, of a name in an export of llvm-cov: where ccache has made paths relative
    it is one over the folder that was built in. None for what lies elsewhere."""
    path = Path(os.path.normpath(filename))
    return str(path.relative_to(root)) if path.is_relative_to(root) else None


def safety_files(root: Path = ROOT) -> list[str]:
    """From the top of the project, each once, in the order of the list."""
    path = HERE / "files.txt"
    found = [
        file
        for number, pattern in _lines(path)
        for file in _files(root, f"{path.name}:{number}", pattern)
    ]
    return list(dict.fromkeys(found))


def other_files(root: Path = ROOT) -> dict[str, str]:
    """File and the reason why it is none of safety."""
    path = HERE / "other_files.txt"
    result = {}
    for number, line in _lines(path):
        pattern, _, reason = line.partition(" ")
        if not reason.strip():
            raise WrongList(f"{path.name}:{number}: {pattern} is there without a reason")
        for file in _files(root, f"{path.name}:{number}", pattern):
            result[file] = reason.strip()
    return result
