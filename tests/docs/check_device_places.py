#!/usr/bin/env python3
"""docs/adding-a-device.md lists the files that name a device of another maker outside of its folder: those, and no others.

usage: check_device_places.py REPOSITORY
"""
import pathlib
import re
import sys

SHIPPED = ("config", "daemon", "devices", "mmu", "packaging", "protocol", "systemd", "tools")
PAGE = "docs/adding-a-device.md"
SECTION = "### Files outside the device folder"
ROW = re.compile(r"^\| `((?:%s)/[^`]+)` \| ([^|]+) \|" % "|".join(SHIPPED), re.MULTILINE)


def without_comments(path, text):
    return re.sub(r"//.*", "", text) if path.suffix in (".cpp", ".hpp") else text


def places(repository):
    """File and the devices that it names, of all files that name one."""
    devices = sorted(folder.name for folder in (repository / "devices").iterdir() if folder.is_dir())
    word = re.compile(r"\b(?:%s)\b" % "|".join(devices))
    found = {}
    for folder in SHIPPED:
        for path in sorted((repository / folder).rglob("*")):
            if not path.is_file():
                continue
            try:
                text = without_comments(path, path.read_text(encoding="utf-8"))
            except UnicodeDecodeError:
                continue
            name = path.relative_to(repository).as_posix()
            own = name.split("/")[1] if name.startswith("devices/") else ""
            named = set(word.findall(text)) - {own}
            if named:
                found[name] = named
    return found


def with_driver(repository):
    """The devices that the schema has as words of keys."""
    schema = (repository / "config/pack.schema.json").read_text(encoding="utf-8")
    return {
        folder.name
        for folder in (repository / "devices").iterdir()
        if folder.is_dir() and re.search(r'"%s"' % folder.name, schema)
    }


def listed(repository):
    text = (repository / PAGE).read_text(encoding="utf-8")
    text = text.partition(f"\n{SECTION}\n")[2].partition("\n## ")[0]
    rows = {}
    for name, devices in ROW.findall(text):
        rows[name] = with_driver(repository) if devices.startswith("all ") else set(re.findall(r"`(\w+)`", devices))
    return rows


def main():
    repository = pathlib.Path(sys.argv[1])
    found, told = places(repository), listed(repository)
    problems = []
    for name in sorted(found.keys() | told.keys()):
        if found.get(name) != told.get(name):
            have = ", ".join(sorted(found.get(name, ()))) or "none"
            want = ", ".join(sorted(told.get(name, ()))) or "none"
            problems.append(f"{name} names these devices: {have}; {PAGE} says: {want}")
    for problem in problems:
        print(problem)
    if not told:
        sys.exit(f"{PAGE}: no list of files found")
    sys.exit(1 if problems else 0)


if __name__ == "__main__":
    main()
