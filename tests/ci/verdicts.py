"""Which sources a checker had nothing to find in, kept over runs and clones.

A verdict "nothing found" is an empty file in ${XDG_CACHE_HOME:-~/.cache}/bmud/CHECKER, named by a checksum of all that it depends on: the
source, what it includes, the checker's version and options, the script that runs it. Whoever asks puts these together, each as a line. A
finding is never kept. A verdict that no run has asked for in 30 days is removed.
"""

from __future__ import annotations

import functools
import hashlib
import os
import pathlib
import subprocess
import time

KEPT_FOR_S = 30 * 24 * 3600


@functools.lru_cache(maxsize=None)
def sum_of_file(path: str) -> str:
    """Computed once in a run; sum_of_file.cache_clear() where a file may have changed since."""
    return hashlib.sha256(pathlib.Path(path).read_bytes()).hexdigest()


def version_of(program: str) -> list[str]:
    """The lines of --version that name it; others name the machine's processor."""
    said = subprocess.run([program, "--version"], stdout=subprocess.PIPE, text=True, check=True).stdout
    return [line for line in said.splitlines() if "version" in line] or said.splitlines()


class Verdicts:
    def __init__(self, checker: str) -> None:
        self._folder = pathlib.Path(os.environ.get("XDG_CACHE_HOME") or pathlib.Path.home() / ".cache") / "bmud" / checker
        self._folder.mkdir(parents=True, exist_ok=True)

    def path(self, lines: list[str]) -> pathlib.Path:
        """The file of the verdict that depends on these lines; it exists if nothing was found."""
        return self._folder / hashlib.sha256("\n".join(lines).encode()).hexdigest()

    def remove_old(self) -> None:
        for path in self._folder.iterdir():
            if time.time() - path.stat().st_mtime > KEPT_FOR_S:
                path.unlink(missing_ok=True)
