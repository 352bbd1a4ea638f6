"""All mutants of the safety files, read once: libclang takes more than a minute for them, and sixteen slices of one run ask for the same.
They are kept in the folder of the build until something they come from changes: a source or header of the project, these scripts, the
list of files, the compiler."""

from __future__ import annotations

import hashlib
import pickle
import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path

import mutants
import safety_files
from mutants import Mutant, Source

Found = tuple[list[Source], list[Mutant]]
Finder = Callable[[Path, list[str]], Found]

PROJECT = ("config", "daemon", "devices", "mmu", "protocol")


def checksum(root: Path, files: Sequence[str]) -> str:
    """Of all that the mutants of these files come from."""
    headers = [path for folder in PROJECT for path in (root / folder).rglob("*.hpp")]
    scripts = safety_files.HERE.glob("*.py")
    compiler = subprocess.run(["clang++", "--version"], stdout=subprocess.PIPE, check=True).stdout
    result = hashlib.sha256(compiler)
    for path in sorted({*headers, *scripts, *(root / file for file in files)}):
        result.update(f"{path} {hashlib.sha256(path.read_bytes()).hexdigest()}\n".encode())
    result.update("\n".join(files).encode())
    return result.hexdigest()


def find(root: Path, files: list[str], work: Path, finder: Finder = mutants.find) -> Found:
    """What mutants.find finds. A record that is damaged, or of other sources, is written anew."""
    record = work / "mutants.pickle"
    wanted = checksum(root, files)
    try:
        kept, found = pickle.loads(record.read_bytes())
        if kept == wanted:
            return found
    except (OSError, ValueError, TypeError, EOFError, AttributeError, ImportError, pickle.UnpicklingError):
        pass  # The first run, or a file that is damaged: nothing is known.
    found = finder(root, files)
    work.mkdir(parents=True, exist_ok=True)
    new = record.with_suffix(".new")
    new.write_bytes(pickle.dumps((wanted, found)))
    new.replace(record)
    return found
