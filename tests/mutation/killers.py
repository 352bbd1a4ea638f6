"""Which test case noticed which mutant: in an earlier run this one, in this run one beside it. These are tried first; a verdict is never
taken from here, so what stands here can only cost or save time."""

from __future__ import annotations

import json
import os
from pathlib import Path

from mutants import Mutant


def default_path() -> Path:
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "bmud" / "mutation-killers.json"


# Test cases of the nearest mutants: most mutants of a function are noticed by the same few.
NEAR_MAX = 12


class Killers:
    def __init__(self, path: Path) -> None:
        self._path = path
        self._names: dict[str, str] = {}
        self._lines: dict[str, dict[str, int]] = {}
        try:
            found = json.loads(path.read_text())
            self._names = {key: name for key, name in found.items() if isinstance(name, str)}
        except (OSError, ValueError, AttributeError):
            pass  # The first run, or a file that is damaged: nothing is known.

    @staticmethod
    def _key(mutant: Mutant) -> str:
        # Without the line, which moves; two mutants may share a key.
        return "\t".join([mutant.file, mutant.source, str(mutant.column), mutant.change])

    def of(self, mutant: Mutant) -> str | None:
        return self._names.get(self._key(mutant))

    def near(self, mutant: Mutant) -> list[str]:
        """The test cases that have noticed mutants of its file in this run, the nearest first; a few."""
        lines = sorted((abs(line - mutant.line), name) for name, line in list(self._lines.get(mutant.file, {}).items()))
        return [name for _, name in lines[:NEAR_MAX]]

    def note(self, mutant: Mutant, name: str) -> None:
        self._names[self._key(mutant)] = name
        self._lines.setdefault(mutant.file, {})[name] = mutant.line

    def save(self) -> None:
        """Whole or not at all; slices of one run add to what is there."""
        self._path.parent.mkdir(parents=True, exist_ok=True)
        names = Killers(self._path)._names | self._names
        new = self._path.with_suffix(f".{os.getpid()}")
        new.write_text(json.dumps(names, indent=0, sort_keys=True) + "\n")
        new.replace(self._path)
