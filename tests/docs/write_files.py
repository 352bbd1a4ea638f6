#!/usr/bin/env python3
"""Writes the files that a page shows (run_page.py: <!-- write FILE -->) into a folder, for a build to compile them.

    write_files.py PAGE.md FOLDER
"""
import sys
from pathlib import Path

sys.dont_write_bytecode = True
import run_page  # noqa: E402


def main():
    page, folder = (Path(argument) for argument in sys.argv[1:3])
    for step in run_page.steps_of(page.read_text()):
        if step.file:
            file = folder / step.file
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text("\n".join(step.expected) + "\n")


if __name__ == "__main__":
    main()
