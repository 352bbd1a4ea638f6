#!/usr/bin/env python3
"""Nothing is written twice in what is shipped: no run of 60 tokens stands in two places with nearly the same words.

The runs are found by sim_c++ (package similarity-tester), for which every name is like every other; of them count those whose words
are nearly the same: a table has the shape of the next one, a copy has its names, too. What may stay as it is stands with its reason in
duplicates.exceptions, and has to go from there with the copy.
"""

import difflib
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
EXCEPTIONS = pathlib.Path(__file__).resolve().parent / "duplicates.exceptions"
FOLDERS = ["config", "daemon", "devices", "mmu", "protocol", "tools"]
TOKENS_MIN = 60
SAME_WORDS_MIN = 0.85  # of all words of both

RUN = re.compile(r"^(\S+): line (\d+)-(\d+)\s*\|(\S+): line (\d+)-(\d+)\s*\[(\d+)\]$", re.MULTILINE)
COMPARED = re.compile(r"^Total input: (\d+) files", re.MULTILINE)
WORD = re.compile(r'"(?:\\.|[^"\\])*"|\w+')


def sources():
    listed = subprocess.run(["git", "-C", ROOT, "ls-files", "--cached", "--others", "--exclude-standard", *FOLDERS], check=True, capture_output=True, text=True).stdout
    # One that is deleted but not yet committed is not there.
    return [name for name in listed.split() if name.endswith((".cpp", ".hpp")) and (ROOT / name).is_file()]


def words(lines, first, last):
    text = "\n".join(line.split("//")[0] for line in lines[first - 1 : last])
    return WORD.findall(text)


def copies(names):
    """Each as (one file, the other, what is to be told)."""
    # Not wider lines than needed, but wide enough that no name is cut off.
    command = ["sim_c++", "-n", "-w", "400", "-r", str(TOKENS_MIN), *names]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    compared = COMPARED.search(done.stdout)
    if done.returncode != 0 or not compared or int(compared[1]) != len(names):
        sys.exit(f"duplicates.py: sim_c++ did not compare {len(names)} files:\n{done.stdout[-500:]}{done.stderr}")
    texts = {name: (ROOT / name).read_text().splitlines() for name in names}
    for one, first, last, other, other_first, other_last, tokens in RUN.findall(done.stdout):
        both = [words(texts[one], int(first), int(last)), words(texts[other], int(other_first), int(other_last))]
        same = difflib.SequenceMatcher(None, *both, autojunk=False).ratio()
        if same >= SAME_WORDS_MIN:
            yield one, other, f"{one}:{first}-{last} and {other}:{other_first}-{other_last}: {tokens} tokens, {same:.0%} the same words"


def exceptions():
    """Two files, in the order of their names: the line that they stand in."""
    found = {}
    for number, line in enumerate(EXCEPTIONS.read_text().splitlines(), start=1):
        if not line.strip() or line.startswith("#"):
            continue
        parts = line.split(None, 2)
        if len(parts) != 3:
            sys.exit(f"{EXCEPTIONS.name}:{number}: wanted two files and the reason")
        found[tuple(sorted(parts[:2]))] = number
    return found


def main():
    allowed = exceptions()
    used = set()
    is_good = True
    for one, other, text in copies(sources()):
        pair = tuple(sorted((one, other)))
        if pair in allowed:
            used.add(pair)
        else:
            print(f"{text}; have one place for it, or name it in {EXCEPTIONS.name}")
            is_good = False
    for pair in sorted(allowed.keys() - used):
        print(f"{EXCEPTIONS.name}:{allowed[pair]}: {pair[0]} and {pair[1]} have no copy any more; take the line away")
        is_good = False
    return 0 if is_good else 1


if __name__ == "__main__":
    sys.exit(main())
