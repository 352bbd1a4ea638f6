"""Reads lists of exceptions: blocks of `key: value` lines with an empty line between, comments from # on a line's start."""

from __future__ import annotations

from pathlib import Path


class WrongBlock(Exception):
    """A list of exceptions cannot be read."""


def read(path: Path, keys: tuple[str, ...]) -> list[dict[str, str]]:
    """Every block with all of `keys`, each with a value."""
    result: list[dict[str, str]] = []
    values: dict[str, str] = {}
    for number, line in enumerate([*path.read_text().splitlines(), ""], start=1):
        if line.startswith("#"):
            continue
        if line.strip():
            key, separator, value = line.partition(": ")
            if not separator or key not in keys or key in values or not value.strip():
                raise WrongBlock(f"{path.name}:{number}: found {line!r}, wanted one of {', '.join(keys)}, once, with a value")
            values[key] = value.strip()
        elif values:
            missing = [key for key in keys if key not in values]
            if missing:
                raise WrongBlock(f"{path.name}:{number}: the block above has no {', '.join(missing)}")
            result.append(values)
            values = {}
    return result
