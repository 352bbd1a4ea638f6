#!/usr/bin/env python3
"""The pages must lead somewhere where they are installed, too: each is there, and each of its links.

    check_installed.py BUILD_DIRECTORY
"""
import os
import subprocess
import sys
import tempfile
from pathlib import Path

sys.dont_write_bytecode = True
import check_pages  # noqa: E402


def main():
    with tempfile.TemporaryDirectory() as root:
        root = Path(root).resolve()
        subprocess.run(["cmake", "--install", sys.argv[1], "--component", "bmud"], env={**os.environ, "DESTDIR": str(root)},
                       stdout=subprocess.DEVNULL, check=True)
        pages = sorted(root.glob("**/doc/bmud/**/*.md"))
        found = [f"{page.relative_to(root)}: {problem}" for page in pages
                 for problem in check_pages.problems_of_links(page, page.read_text())]
        outside = [str(link.relative_to(root)) for link in root.rglob("*") if link.is_symlink() and not link.resolve().is_relative_to(root)]
    if len(pages) < 20:
        found.append(f"only {len(pages)} pages are installed")
    found += [f"{link}: leads out of what is installed" for link in outside]
    print("\n".join(found) or f"{len(pages)} installed pages lead to nothing that is not there")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
