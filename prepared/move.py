#!/usr/bin/env python3
"""Performs the moves of moves.tsv in a checkout: git mv, every mention of a path, CMake lists, patches by hand below, clang-format.

    move.py [--root DIR] [--dry-run] [--no-format]

May be run again: what is done is left as it is. Exit status 1 if a patch does not fit any more or an old path is still named somewhere.
"""
import argparse, collections, os, pathlib, posixpath, re, subprocess, sys

HERE = pathlib.Path(__file__).resolve().parent
# Written by machines, or bytes.
LEFT_ALONE = re.compile(r"^(tests/ci/nightly-passed\.tsv|tests/fuzz/corpora/|.*\.(zst|gz|svg|png|log|bin)$)")
TOKEN = re.compile(r"(?:daemon|mmu|config|tests|tools)/[\w./-]*\w")
problems = []


def git(root, *words):
    return subprocess.run(["git", "-C", root, *words], check=True, capture_output=True, text=True).stdout


class Mover:
    def __init__(self, root, dry):
        self.root, self.dry = root, dry
        self.moves = dict(line.split("\t") for line in (HERE / "moves.tsv").read_text().splitlines())
        self.back = {new: old for old, new in self.moves.items()}
        # Without suffix, as lists of patterns and comments have it: core_config.*
        self.stems = {}
        for old, new in self.moves.items():
            self.stems[old.rsplit(".", 1)[0]] = new.rsplit(".", 1)[0]
        # From the folder estimators on, as pages have it.
        self.partial = {old[len("daemon/core/"):]: new[len("daemon/core/"):] for old, new in self.moves.items() if "/estimators/" in old}
        # Names that change, as comments have them.
        self.names = {posixpath.basename(o): posixpath.basename(n) for o, n in self.moves.items() if posixpath.basename(o) != posixpath.basename(n)}
        self.changed = []

    def move_files(self):
        count = 0
        for old, new in self.moves.items():
            source, target = self.root / old, self.root / new
            if source.exists() and target.exists():
                problems.append(f"both are there: {old} and {new}")
            elif source.exists():
                count += 1
                if not self.dry:
                    target.parent.mkdir(parents=True, exist_ok=True)
                    git(self.root, "mv", old, new)
            elif not target.exists():
                problems.append(f"not there: {old}")
        # A file that was added to a folder since.
        folders, stays = {posixpath.dirname(old) for old in self.moves}, set((HERE / "stays.txt").read_text().split())
        for f in git(self.root, "ls-files").splitlines():
            if posixpath.dirname(f) in folders and f.endswith((".cpp", ".hpp")) and f not in self.moves and f not in self.back and f not in stays:
                problems.append(f"is newer than moves.tsv, give it a place in gen_moves.py: {f}")
        return count

    def mapped(self, token):
        """A path, or one without its suffix where only a dot and more follows."""
        if token in self.moves:
            return self.moves[token]
        return None

    def rewrite(self, path, text):
        def full(match):
            token = match.group()
            start = match.start()
            # config/... of a longer path that is none of the project's
            if start and text[start - 1] in "_-" or start and text[start - 1].isalnum():
                return token
            return self.moves.get(token) or token
        result = TOKEN.sub(full, text)
        # core_config.* and core_image\. and the like
        def stem(match):
            new = self.stems.get(match.group(1))
            return new + match.group(2) if new else match.group()
        result = re.sub(r"(?<![\w-])((?:daemon|mmu|config|tests|tools)/[\w/]*\w)(\.\*|\\\.)", stem, result)
        if path.endswith((".md", ".rows", ".txt", ".hpp", ".cpp", ".py", ".sh")):
            result = re.sub(r"(?<![\w/])estimators/\w+\.[ch]pp", lambda m: self.partial.get(m.group(), m.group()), result)
            result = re.sub(r"(?<![\w/])report_\w+\.[ch]pp", lambda m: self.names.get(m.group(), m.group()), result)
        if path.endswith((".cpp", ".hpp")):
            result = self.beside(path, result)
        if posixpath.basename(path) == "CMakeLists.txt" or path.endswith(".cmake"):
            result = self.listed(path, result)
        return result

    def beside(self, path, text):
        """#include "x.hpp" of a file that lay beside."""
        folder = posixpath.dirname(self.back.get(path, path))
        def one(match):
            old = f"{folder}/{match.group(1)}"
            if "/" in match.group(1) or (old not in self.moves and path not in self.back):
                return match.group()
            new = self.moves.get(old, old)
            return f'#include "{new}"' if (self.root / new).exists() or (self.root / old).exists() else match.group()
        return re.sub(r'^#include "([^"]+)"', one, text, flags=re.MULTILINE)

    def listed(self, path, text):
        """Sources in a CMake list, relative to its folder."""
        folder = posixpath.dirname(path)
        def one(match):
            old = posixpath.normpath(posixpath.join(folder, match.group()))
            new = self.moves.get(old)
            return posixpath.relpath(new, folder) if new else match.group()
        return re.sub(r"(?<![\w./-])\w[\w/]*\.cpp\b|(?<=\$\{CMAKE_CURRENT_LIST_DIR\}/)[\w/]+\.cpp\b|(?<=\$\{CMAKE_CURRENT_SOURCE_DIR\}/)[\w/]+\.cpp\b", one, text)

    def texts(self):
        for path in git(self.root, "ls-files", "--cached", "--others", "--exclude-standard").splitlines():
            if LEFT_ALONE.match(path) or not (self.root / path).is_file() or (self.root / path).is_symlink():
                continue
            try:
                yield path, (self.root / path).read_text(encoding="utf-8")
            except UnicodeDecodeError:
                continue

    def write(self, path, text):
        self.changed.append(path)
        if not self.dry:
            (self.root / path).write_text(text, encoding="utf-8")

    def rewrite_all(self):
        for path, text in list(self.texts()):
            new_path = self.moves.get(path, path) if self.dry else path
            result = self.rewrite(new_path, text)
            if result != text:
                self.write(path, result)

    def reflow(self, path, library):
        """A library's sources, one folder behind the other."""
        file = self.root / path
        text = file.read_text()
        match = re.search(rf"add_library\({library} STATIC\s+([^)]*)\)", text)
        if not match:
            problems.append(f"{path}: no add_library({library} ...)")
            return
        groups = collections.defaultdict(list)
        for name in match.group(1).split():
            groups[posixpath.dirname(name) if name.endswith(".cpp") else "~"].append(name)
        lines = []
        for folder in sorted(groups, key=lambda f: (f.startswith("$"), f)):
            line = " "
            for name in sorted(groups[folder]):
                if len(line) + 1 + len(name) > 140:
                    lines.append(line)
                    line = " "
                line += " " + name
            lines.append(line)
        result = text[:match.start()] + f"add_library({library} STATIC\n" + "\n".join(lines) + ")" + text[match.end():]
        if result != text:
            self.write(path, result)

    def patch(self, path, old, new):
        file = self.root / path
        text = file.read_text() if file.exists() else ""
        if new and new in text:
            return
        if text.count(old) != 1:
            problems.append(f"{path}: patch does not fit: {old[:90]!r} is there {text.count(old)} times")
            return
        self.write(path, text.replace(old, new))

    def create(self, path, text):
        file = self.root / path
        if file.exists():
            return
        self.write(path, text)
        if not self.dry:
            git(self.root, "add", "-N", path)

    def format(self):
        sources = [f for f in dict.fromkeys(self.changed) if f.endswith((".cpp", ".hpp"))]
        if sources:
            subprocess.run(["nice", "-n", "19", "clang-format", "-i", *sources], cwd=self.root, check=True)

    def remaining(self):
        """Mentions of what is not there any more."""
        for path, text in self.texts():
            for number, line in enumerate(text.splitlines(), 1):
                for match in TOKEN.finditer(line):
                    if match.group() in self.moves and self.moves[match.group()] != match.group() and not (match.start() and (line[match.start() - 1].isalnum())):
                        problems.append(f"{path}:{number}: still names {match.group()}")
                for word in re.findall(r"(?<![\w])(?:daemon/core/)?estimators/\S*", line):
                    problems.append(f"{path}:{number}: still names {word}")
                for name in re.findall(r"\breport_\w+\.[ch]pp", line):
                    if name in self.names:
                        problems.append(f"{path}:{number}: still names {name}")


def by_hand(m):
    # CMake
    m.patch("CMakeLists.txt", "add_subdirectory(config)\nadd_subdirectory(tools)", "add_subdirectory(config)\nadd_subdirectory(daemon/shell/cli)\nadd_subdirectory(tools)")
    m.create("daemon/shell/cli/CMakeLists.txt", """# Command lines: their mistakes, and how a program describes itself to people and shells. For the daemon and the tools; its compile options
# are those of config and tools.
add_library(bmud_command_line STATIC command_line.cpp completion.cpp described_option.cpp manual_page.cpp)
bmud_compiled_together(bmud_command_line
  "command_line.cpp;completion.cpp;described_option.cpp;manual_page.cpp")
target_compile_options(bmud_command_line PRIVATE ${runs_once})
target_link_libraries(bmud_command_line PUBLIC bmud_flags CLI11::CLI11)
""")
    text = (m.root / "tools/common/CMakeLists.txt").read_text()
    result = re.sub(r"# Command lines:.*?CLI11::CLI11\)\n\n", "", text, flags=re.DOTALL)
    result = re.sub(r"# Files that are written whole.*?bmud_flags\)\n\n", "", result, flags=re.DOTALL)
    if result != text:
        m.write("tools/common/CMakeLists.txt", result)
    m.patch("daemon/shell/CMakeLists.txt", "include(ports.cmake)\n", """include(ports.cmake)

# Files that are written whole or not at all: for the tools, too.
add_library(bmud_whole_file STATIC system/whole_file.cpp)
target_link_libraries(bmud_whole_file PUBLIC bmud_flags)
""")
    for path, library in [("daemon/core/CMakeLists.txt", "bmud_core"), ("daemon/shell/CMakeLists.txt", "bmud_shell"), ("config/CMakeLists.txt", "bmud_config"),
                          ("mmu/CMakeLists.txt", "bmud_mmu"), ("mmu/CMakeLists.txt", "bmud_simulator"), ("tools/bmucell/CMakeLists.txt", "bmud_cell"),
                          ("tools/bmudump/CMakeLists.txt", "bmud_dump"), ("tools/report/CMakeLists.txt", "bmud_report")]:
        m.reflow(path, library)
    m.patch("tools/report/CMakeLists.txt", "report_from_*", "from_*")
    m.patch("tests/CMakeLists.txt", "file(GLOB unit_sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/unit/*_test.cpp)",
            "file(GLOB_RECURSE unit_sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/unit/*_test.cpp)")
    m.patch("tests/CMakeLists.txt", "${CMAKE_CURRENT_SOURCE_DIR}/scenario/*_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/scenario/accept/*_test.cpp)",
            "${CMAKE_CURRENT_SOURCE_DIR}/scenario/*_test.cpp ${CMAKE_CURRENT_SOURCE_DIR}/scenario/*/*_test.cpp)")
    m.patch("tests/CMakeLists.txt", "${CMAKE_CURRENT_SOURCE_DIR}/integration/*_test.cpp)", "${CMAKE_CURRENT_SOURCE_DIR}/integration/*/*_test.cpp)")
    m.patch("tests/CMakeLists.txt", """  foreach(group ${ARGN})
    separate_arguments(sources UNIX_COMMAND "${group}")
    list(GET sources 0 first)
    list(TRANSFORM sources REPLACE "(.+)" "${kind}/\\\\1_test.cpp")
    set_source_files_properties(${sources} PROPERTIES UNITY_GROUP "test_${kind}_${first}")
  endforeach()
""", """  get_target_property(all test_${kind} SOURCES)
  foreach(group ${ARGN})
    separate_arguments(names UNIX_COMMAND "${group}")
    list(GET names 0 first)
    foreach(name ${names})
      set(source ${all})
      list(FILTER source INCLUDE REGEX "/${name}_test\\\\.cpp$")
      list(LENGTH source count)
      if(NOT count EQUAL 1)
        message(FATAL_ERROR "bmud_tests_together(${kind}): found ${count} sources called ${name}_test.cpp, expected one")
      endif()
      set_source_files_properties(${source} PROPERTIES UNITY_GROUP "test_${kind}_${first}")
    endforeach()
  endforeach()
""")
    # Lists of patterns
    m.patch("tests/mutation/files.txt", "daemon/core/fault_reader*.*\n", "daemon/core/faults/fault_reader*.*\n")
    path = "tests/mutation/other_files.txt"
    text = (m.root / path).read_text()
    result = re.sub(r"daemon/core/estimators/\[!c\]\*( +)", r"daemon/core/estimation/*.?pp\1", text)
    result = re.sub(r"daemon/core/estimators/c\[!u\]\*( +)", r"daemon/core/estimation/soc/*.?pp\1", result)
    result = re.sub(r"daemon/core/estimation/soc/current_spans\.\* +the same\n", """daemon/core/estimation/health/[!c]*.?pp the same
daemon/core/estimation/health/c[!u]*.?pp the same
daemon/core/balancing/polarisation.hpp a bound: what follows the current late; balancing goes by it
daemon/core/cell/ocv_shift.* a bound: how far the voltage of a cell comes when a charge flows
""", result)
    if result != text:
        m.write(path, result)
    m.patch("tests/fuzz/explore.sh", "'config/(cell_|charge_plateau|derating_reader|fields|json_reader|list_fields)'", "'config/(cell_file/|fields/(fields|list_fields)|json/json_reader)'")
    m.patch("tests/fuzz/explore.sh", "'daemon/core/(cell_requests|cell_question|charger_|inverter_|second_pack)'",
            "'daemon/core/[a-z]*/(cell_requests|cell_question|charger_|inverter_|second_pack)'")
    m.patch("tests/fuzz/explore.sh", "'daemon/shell/(status_|why_|faults_|health_|modules_|balance_|freeze_).*'",
            "'daemon/shell/(status|json)/(status_|why_|faults_|health_|modules_|balance_|freeze_).*'")
    m.patch("tests/fuzz/explore.sh", "[script]='mmu/scenario'", "[script]='mmu/scenario/scenario'")
    m.patch("tests/fuzz/explore.sh", "'daemon/shell/serial_'", "'daemon/shell/serial/serial_'")
    m.patch("tests/fuzz/explore.sh", "'daemon/shell/state_'", "'daemon/shell/state/state_'")
    m.patch("tests/fuzz/explore.sh", r"'tools/bmucell/csv_(file|table|text)\.'", r"'tools/bmucell/data/csv_(file|table|text)\.'")
    m.patch("tests/meta/purity.sh", r"daemon/core/(core_config|cell_model)\.hpp", r"daemon/core/(types/core_config|cell/cell_model)\.hpp")
    # A line that would become too long, and that clang-format would break in the wrong place.
    text = (m.root / "mmu/plant/plant.hpp").read_text()
    result = re.sub(r"a resistance that answers at once and two pairs( that|\n//   that)\n//             answer later, all of them larger in the cold; it discharges itself. Each has a capacity, resistance and\n//             temperature of its own;",
                    "a resistance that answers at once and two\n//             pairs that answer later, all of them larger in the cold; it discharges itself. Each has a capacity,\n//             resistance and temperature of its own;", text)
    if result != text:
        m.write("mmu/plant/plant.hpp", result)
    # Layers
    text = (m.root / "tests/meta/layers.py").read_text()
    result = re.sub(r"    # A program's command line is told like.*?\n    # Written as the tools.*?\n[^\n]*\n", "", text, flags=re.DOTALL)
    if result != text:
        m.write("tests/meta/layers.py", result)
    m.patch("tests/meta/layers.py", '"tools/bmucell": ["config", "daemon/core", "protocol", "tools/common"]',
            '"tools/bmucell": ["config", "daemon/core", "daemon/shell/cli", "daemon/shell/system/whole_file.hpp", "protocol", "tools/common"]')
    m.patch("tests/meta/layers.py", '"tools/bmudump": ["daemon/shell/can/bus_port.hpp", "devices", "protocol", "tools/common"]',
            '"tools/bmudump": ["daemon/shell/can/bus_port.hpp", "daemon/shell/cli", "devices", "protocol", "tools/common"]')


def align(root, path, columns, dry):
    """Tables whose columns are set off by blanks."""
    file = root / path
    lines = file.read_text().splitlines()
    rows = [line.split(None, columns - 1) if line.strip() and not line.startswith("#") else line for line in lines]
    widths = [max(len(row[c]) for row in rows if isinstance(row, list)) for c in range(columns - 1)]
    result = [row if isinstance(row, str) else "".join(row[c].ljust(widths[c] + 1 + (columns > 2) * 3) for c in range(columns - 1)) + row[-1] for row in rows]
    if result != lines and not dry:
        file.write_text("\n".join(result) + "\n")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--root", type=pathlib.Path, default=pathlib.Path.cwd())
    parser.add_argument("--dry-run", action="store_true")
    parser.add_argument("--no-format", action="store_true")
    options = parser.parse_args()
    m = Mover(options.root.resolve(), options.dry_run)
    clash = set(m.moves) & set(m.moves.values())
    if clash:
        sys.exit(f"old and new at once: {clash}")
    count = m.move_files()
    m.rewrite_all()
    print(f"{count} files moved, {len(m.changed)} texts changed")
    if options.dry_run:
        for path in m.changed:
            print(f"  {path}")
    else:
        by_hand(m)
        align(m.root, "tests/mutation/other_files.txt", 2, False)
        align(m.root, "tests/meta/duplicates.exceptions", 3, False)
        if not options.no_format:
            m.format()
        # Its tests are listed in the order of their paths.
        subprocess.run([sys.executable, m.root / "tests/meta/requirements.py", "--write"], check=True)
        m.remaining()
        git(m.root, "add", "-A", "--", *[p for p in ("CMakeLists.txt", "config", "daemon", "docs", "mmu", "tests", "tools", "vcan-fixtures", "README.md", "CHANGELOG.md", "packaging", "devices", "protocol", "systemd") if (m.root / p).exists()])
    for problem in problems:
        print(problem, file=sys.stderr)
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
