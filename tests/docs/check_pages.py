#!/usr/bin/env python3
"""What all pages name must be there: options and commands of the programs, files of the project, other pages and their headings.

    check_pages.py BIN_DIRECTORY SOURCE_DIRECTORY

Looks at README.md and every page below docs/: at commands in code, wherever they stand; at words in code that are paths; and at
links. What commands print is run_page.py's business.
"""
import functools
import re
import subprocess
import sys
from pathlib import Path

PROGRAMS = ("bmud", "bmuctl", "bmudump", "bmureplay", "bmucell", "mmusim")
# Words behind these that are no option are commands of theirs.
WITH_COMMANDS = {"bmuctl", "bmucell"}
FOLDERS = ("config", "daemon", "devices", "docs", "mmu", "packaging", "protocol", "systemd", "tests", "tools", "vcan-fixtures")
CALL = re.compile(r"(?:^|[;&|(`]\s*|\$ |sudo |> )(?:[\w./-]*/)?(" + "|".join(PROGRAMS) + r")((?: [^|;&<>`#)]*)?)", re.MULTILINE)
PATH = re.compile(r"(?<![\w./~-])((?:" + "|".join(FOLDERS) + r")/[\w./-]*[\w/])(?![\w*<{])")


class Programs:
    def __init__(self, folder):
        self.folder = folder

    @functools.lru_cache(maxsize=None)
    def help_of(self, program, *commands):
        return subprocess.run([self.folder / program, *commands, "--help"], capture_output=True, text=True, check=True).stdout

    def options_of(self, program, *commands):
        return re.findall(r"^ +(?:-\w+,)*(--[\w-]+)", self.help_of(program, *commands), re.MULTILINE)

    def commands_of(self, program, *commands):
        """Those that its help lists."""
        listed = self.help_of(program, *commands).partition("Subcommands:\n")[2].partition("\n\n")[0]
        return re.findall(r"^  ([a-z]+) ", listed, re.MULTILINE)

    def problem_with(self, program, arguments):
        """What of this command line the program does not know; None if it knows all."""
        words = re.sub(r"\"[^\"]*\"|'[^']*'", "TEXT", arguments).split()
        commands, known = [], self.options_of(program)
        for word in words:
            if program in WITH_COMMANDS and re.fullmatch(r"[a-z]+", word):
                if word in self.commands_of(program, *commands):
                    commands.append(word)
                    known += self.options_of(program, *commands)
                elif not commands and word not in self.values_in(words):
                    return f"no command '{word}'"
            elif word.startswith("--") and (option := re.match(r"--[a-z]+(?:-[a-zA-Z]+)*", word)):
                if option.group() not in known:
                    return f"no option '{option.group()}'"
        return None

    @staticmethod
    def values_in(words):
        """Words behind an option, which may be its value."""
        return {word for before, word in zip(words, words[1:]) if before.startswith("-")}


def code_of(text):
    """Everything set as code: blocks, fenced and indented, and spans."""
    fenced = re.findall(r"^```.*?\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    rest = re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL)
    indented = re.findall(r"^ {4}\S.*$", rest, re.MULTILINE)
    spans = re.findall(r"(?<!`)`([^`\n]+)`(?!`)", re.sub(r"^ {4}.*$", "", rest, flags=re.MULTILINE))
    joined = [re.sub(r"\\\n(> | +)", " ", block) for block in fenced]
    return joined + [line.strip() for line in indented] + spans


def anchors_of(page):
    """The places in a page that links may lead to."""
    text = re.sub(r"^```.*?^```", "", page.read_text(), flags=re.MULTILINE | re.DOTALL)
    headings = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def problems_of_links(page, text):
    text = re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL)
    for target, anchor in re.findall(r"\]\(([^)#\s:]*)(?:#([^)\s]*))?\)", text):
        file = (page.parent / target).resolve() if target else page
        if not file.exists():
            yield f"link to {target}, which is not there"
        elif anchor and file.suffix == ".md" and anchor not in anchors_of(file):
            yield f"link to {target}#{anchor}: there is no such heading"


def problems_of(page, source, programs):
    text = page.read_text()
    yield from problems_of_links(page, text)
    for code in code_of(text):
        for program, arguments in CALL.findall(code):
            if problem := programs.problem_with(program, arguments):
                yield f"'{program}{arguments.rstrip()}': {problem}"
        for path in PATH.findall(code):
            if not (source / path).exists() and not list(source.glob(path + ".*")) and "NAME" not in path:
                yield f"{path} is not there"


def main():
    folder, source = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
    programs = Programs(folder)
    pages = [source / "README.md", *sorted((source / "docs").rglob("*.md"))]
    found = [f"{page.relative_to(source)}: {problem}" for page in pages for problem in problems_of(page, source, programs)]
    print("\n".join(found) or f"{len(pages)} pages name nothing that is not there")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
