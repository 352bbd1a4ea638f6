"""survivors.txt: mutants that no test can or need tell from the original, each with the reason. Blocks like

file: daemon/core/limits/limits.cpp
line: if (room <= 0) return 0;
change: <= -> <
reason: without room the share is zero either way
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import blocks
from mutants import Mutant


@dataclass(frozen=True)
class Survivor:
    file: str
    line: str
    change: str
    reason: str

    def is_about(self, mutant: Mutant) -> bool:
        return (self.file, self.line, self.change) == (mutant.file, mutant.source, mutant.change)

    def __str__(self) -> str:
        return f"{self.file}: {self.line}  [{self.change}]"


def read(path: Path) -> list[Survivor]:
    return [Survivor(**block) for block in blocks.read(path, ("file", "line", "change", "reason"))]
