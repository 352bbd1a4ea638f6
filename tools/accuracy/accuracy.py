#!/usr/bin/env python3
"""Fits the cell files of measured cells and scores the estimators on them: config/cells/ and docs/accuracy.md.

Takes the folder with the recordings, one folder a cell as cells.json and ageing.json name them. What is missing is said, and
nothing is written. Exit status: 0 if every figure is within its limit, 1 if one is not, 2 if data are missing or a program
fails.

  tools/accuracy/accuracy.py DATA                      fit, score, cross-validate, write
  tools/accuracy/accuracy.py --only lg-hg2 DATA        one cell, and print instead of writing the page
  tools/accuracy/accuracy.py --section health DATA     only that section of the page; no cell file is fitted
  tools/accuracy/accuracy.py --bmucell build/bin/bmucell DATA
"""

from __future__ import annotations

import argparse
import json
import math
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ESTIMATORS = ("ekf", "mixed", "coulomb")
GAIN_ERROR = 0.02
OFFSET_C = 0.005
SOC_ERROR_PCT = -10
SWITCH_ON_SOC_PCT = 60
SWITCH_ON_ERROR_PCT = 20
NEVER_FURTHER_PCT = 0.05  # what flows in the first second
# Those of the page that can be written by themselves, as they follow each other.
SECTIONS = ("drives", "resistance", "health")


class Failed(Exception):
    """A program did not do what it was asked, or data are missing."""


@dataclass
class Cell:
    """A row of cells.json."""

    key: str
    name: str
    kind: str
    origin: str
    folder: str
    capacity_Ah: float
    charge_efficiency: float
    temperatures_C: list[float]
    drives: dict[str, list[str]]
    slow: list[str]
    limits: dict[str, list[float]]
    switched_on_within_s: dict[str, float]
    # Of what bmucell resistance takes: the recording and the table of its pulses; and what their RMS must not exceed.
    pulses: dict[str, list[str]] = field(default_factory=dict)
    resistance_limits: dict[str, float] = field(default_factory=dict)
    file: Path = field(init=False)

    def __post_init__(self) -> None:
        self.file = ROOT / "config" / "cells" / f"{self.key}.json"

    def path(self, data: Path, name: str) -> Path:
        return data / self.folder / f"{name}.csv.gz"

    def table(self, data: Path, name: str) -> Path:
        return data / self.folder / f"{name}.csv"

    def all_drives(self) -> list[str]:
        return [name for names in self.drives.values() for name in names]


class Bench:
    """Runs bmucell."""

    def __init__(self, program: Path, data: Path) -> None:
        self.program = program
        self.data = data

    def run(self, *arguments: str) -> str:
        done = subprocess.run([str(self.program), *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        if done.returncode != 0:
            raise Failed(f"bmucell {arguments[0]}: status {done.returncode}: {done.stderr.strip()}")
        return done.stdout

    def fit(self, cell: Cell, drives: list[str], out: Path, svg: Path | None = None) -> dict:
        arguments = ["fit", "--base", str(cell.file), "--out", str(out), "--json"]
        arguments += ["--name", cell.name, "--origin", cell.origin]
        arguments += ["--capacity-Ah", f"{cell.capacity_Ah}", "--charge-efficiency", f"{cell.charge_efficiency}"]
        arguments += ["--temperatures", ",".join(f"{each:g}" for each in cell.temperatures_C)]
        if cell.slow:
            arguments += ["--slow", *[str(cell.path(self.data, name)) for name in cell.slow]]
        if svg:
            arguments += ["--svg", str(svg)]
        arguments += ["--", *[str(cell.path(self.data, name)) for name in drives]]
        return json.loads(self.run(*arguments))

    def score(self, cell: Cell, file: Path, names: list[str], *more: str, sign: int = 1) -> list[dict]:
        """With the sensor's errors, or with their opposites."""
        sensor = ["--sensor-gain", f"{1 + sign * GAIN_ERROR:.6f}"]
        sensor += ["--sensor-offset-A", f"{sign * OFFSET_C * cell.capacity_Ah:.6f}"]
        files = [str(cell.path(self.data, name)) for name in names]
        return json.loads(self.run("eval", "--cell", str(file), "--json", *sensor, *more, *files))["files"]

    def resistance(self, cell: Cell, pulses: list[str]) -> list[dict]:
        series, table = cell.path(self.data, pulses[0]), cell.table(self.data, pulses[1])
        arguments = ["resistance", "--cell", str(cell.file), "--table", str(table), "--json", str(series)]
        return json.loads(self.run(*arguments))["scores"]


def rms(values: list[float]) -> float:
    return math.sqrt(sum(value * value for value in values) / len(values))


def after_20min(scores: list[dict]) -> float:
    return rms([score["rmse_after_20min_pct"] for score in scores])


def drive_files(cells: list[Cell], data: Path) -> list[Path]:
    return [cell.path(data, name) for cell in cells for name in cell.all_drives() + cell.slow]


def pulse_files(cells: list[Cell], data: Path) -> list[Path]:
    pairs = [(cell, pulses) for cell in cells for pulses in cell.pulses.values()]
    return [path for cell, (series, table) in pairs for path in (cell.path(data, series), cell.table(data, table))]


@dataclass
class Row:
    """What was found at one temperature."""

    temperature: str
    files: int
    rmse: dict[str, float]
    most: float
    inside: float
    opposite: float
    switched_on: float | None
    switched_on_most: float
    one_left_out: float | None
    temperature_left_out: float | None
    limit: list[float] | None
    switch_limit: float | None

    def is_good(self) -> bool:
        good = self.limit is None or self.rmse["ekf"] <= self.limit[0]
        if self.switch_limit is not None:
            good = good and self.switched_on is not None and self.switched_on <= self.switch_limit
            good = good and self.switched_on_most <= SWITCH_ON_ERROR_PCT + NEVER_FURTHER_PCT
        return good


def start(error_pct: float) -> tuple[str, str]:
    return ("--soc-error", f"{error_pct:g}")


def switched_on(bench: Bench, cell: Cell, names: list[str]) -> tuple[float | None, float]:
    """The longest time to come within 3 %, if all do, from a start that is too high or too low; and how far off it ever was."""
    scores = []
    for error_pct in (SWITCH_ON_ERROR_PCT, -SWITCH_ON_ERROR_PCT):
        scores += bench.score(cell, cell.file, names, *start(error_pct), "--from-soc", str(SWITCH_ON_SOC_PCT))
    times = [score["settle_3pct_s"] for score in scores]
    return None if None in times else max(times), max(score["max_pct"] for score in scores)


def without_file(bench: Bench, cell: Cell, names: list[str], scratch: Path) -> float | None:
    """Each drive scored with tables that were fitted to all the others."""
    if len(cell.all_drives()) < 2:
        return None
    scores = []
    for name in names:
        others = [each for each in cell.all_drives() if each != name]
        bench.fit(cell, others, scratch)
        scores += bench.score(cell, scratch, [name], *start(SOC_ERROR_PCT))
    return after_20min(scores)


def without_temperature(bench: Bench, cell: Cell, temperature: str, scratch: Path) -> float | None:
    """The drives at one temperature scored with tables that were fitted to all others, without a row of its own."""
    others = [name for key, names in cell.drives.items() if key != temperature for name in names]
    if not others:
        return None
    rows = [each for each in cell.temperatures_C if each != float(temperature)]
    slow = [name for name in cell.slow if not name.endswith("_T" + temperature.replace("-", "n"))]
    less = Cell(**{**{k: v for k, v in cell.__dict__.items() if k != "file"}, "temperatures_C": rows, "slow": slow})
    bench.fit(less, others, scratch)
    return after_20min(bench.score(cell, scratch, cell.drives[temperature], *start(SOC_ERROR_PCT)))


def row_of(bench: Bench, cell: Cell, temperature: str, scratch: Path) -> Row:
    names = cell.drives[temperature]
    by_estimator = {
        each: bench.score(cell, cell.file, names, *start(SOC_ERROR_PCT), "--estimator", each) for each in ESTIMATORS
    }
    ekf = by_estimator["ekf"]
    opposite = bench.score(cell, cell.file, names, *start(-SOC_ERROR_PCT), sign=-1)
    settled, furthest = switched_on(bench, cell, names)
    return Row(
        temperature=temperature,
        files=len(names),
        rmse={each: after_20min(scores) for each, scores in by_estimator.items()},
        most=max(score["max_after_20min_pct"] for score in ekf),
        inside=sum(score["inside_uncertainty_pct"] for score in ekf) / len(ekf),
        opposite=after_20min(opposite),
        switched_on=settled,
        switched_on_most=furthest,
        one_left_out=without_file(bench, cell, names, scratch),
        temperature_left_out=without_temperature(bench, cell, temperature, scratch),
        limit=cell.limits.get(temperature),
        switch_limit=cell.switched_on_within_s.get(temperature),
    )


def shown(value: float | None, form: str = "{:.2f}") -> str:
    return "-" if value is None else form.format(value)


def table_of(rows: list[Row]) -> str:
    text = (
        "| at | recordings | ekf | wanted | mixed | counting | ekf, at most | truth within 2 sigma | other signs | "
        "3 % after switching on | one recording left out | temperature left out |\n"
        "|---|---|---|---|---|---|---|---|---|---|---|---|\n"
    )
    for row in rows:
        wanted = "-" if row.limit is None else f"{row.limit[0]:g}, better {row.limit[1]:g}"
        text += (
            f"| {row.temperature} C | {row.files} | **{row.rmse['ekf']:.2f}** | {wanted} | {row.rmse['mixed']:.2f} | "
            f"{row.rmse['coulomb']:.2f} | {row.most:.2f} | {row.inside:.0f} % | {row.opposite:.2f} | "
            f"{shown(row.switched_on, '{:.0f} s')}, {row.switched_on_most:.1f} % | {shown(row.one_left_out)} | {shown(row.temperature_left_out)} |\n"
        )
    return text


def held_out(cell: Cell, rows: list[Row]) -> list[str]:
    """Where tables that did not see what they are scored on miss the limit."""
    text = []
    for row in rows:
        if row.limit is None:
            continue
        for what, value in (("one recording", row.one_left_out), ("the temperature", row.temperature_left_out)):
            if value is not None and value > row.limit[0]:
                text.append(f"{cell.name} at {row.temperature} C without {what} {value:.2f} (wanted {row.limit[0]:g})")
    return text


RESISTANCE_HEAD = """\
| at | charge | pulses | recursive | wanted | at most | mean | within 5 % | table within 2 sigma | steps | at most | mean | \
within 5 % |
|---|---|---|---|---|---|---|---|---|---|---|---|---|
"""


def drives_section(bench: Bench, cells: list[Cell]) -> tuple[str, bool]:
    """A picture for each cell: the first recording at its first temperature and at its coldest."""
    text = (Path(__file__).parent / "drives.md").read_text().rstrip() + "\n"
    for cell in cells:
        text += f"\n**{cell.name}**\n"
        coldest = min(cell.drives, key=float)
        for temperature in dict.fromkeys((next(iter(cell.drives)), coldest)):
            picture = f"drive-{cell.key}-{temperature.replace('-', 'minus-')}.svg"
            svg = ("--svg", str(ROOT / "docs" / "pictures" / picture))
            (score,) = bench.score(cell, cell.file, cell.drives[temperature][:1], *start(SOC_ERROR_PCT), *svg)
            figure = f"{score['rmse_after_20min_pct']:.2f} % after 20 minutes, at most {score['max_after_20min_pct']:.2f} %"
            text += f"\n![{cell.name} at {temperature} C](pictures/{picture})\n\nAt {temperature} C: {figure}.\n"
    return text, True


def figures_of(score: dict) -> list[str]:
    return [
        shown(score["max_pct"]),
        shown(score["mean_pct"], "{:+.2f}"),
        f"{score['within_5_pct']} of {score['told']}",
    ]


def resistance_row(temperature: str, scores: list[dict], charge: str, limit: float | None) -> str:
    recursive, steps = (
        next(each for each in scores if each["method"] == method and each["charge"] == charge)
        for method in ("recursive", "steps")
    )
    cells = [f"{temperature} C", charge, str(recursive["pulses"])]
    cells += [f"**{shown(recursive['rms_pct'])}**", shown(limit, "{:g}") if charge == "all" else "-"]
    cells += [*figures_of(recursive), shown(recursive["inside_uncertainty_pct"], "{:.0f} %")]
    cells += [shown(steps["rms_pct"]), *figures_of(steps)]
    return "| " + " | ".join(cells) + " |\n"


def resistance_of(bench: Bench, cell: Cell) -> tuple[str, bool]:
    """The table of one cell, and whether its resistances are within their limits."""
    text = RESISTANCE_HEAD
    is_good = True
    for temperature, pulses in cell.pulses.items():
        print(f"accuracy: resistance of {cell.key} at {temperature} C", file=sys.stderr)
        scores = bench.resistance(cell, pulses)
        limit = cell.resistance_limits.get(temperature)
        text += resistance_row(temperature, scores, "all", limit)
        if scores[0]["pulses"] != scores[1]["pulses"]:
            text += resistance_row(temperature, scores, "above 10 %", limit)
        rms_pct = scores[0]["rms_pct"]
        is_good = is_good and (limit is None or (rms_pct is not None and rms_pct <= limit))
    return text, is_good


def resistance_section(bench: Bench, cells: list[Cell]) -> tuple[str, bool]:
    """The text, and whether all that is limited is within its limit."""
    tables = []
    is_good = True
    for cell in cells:
        if not cell.pulses:
            continue
        table, is_cell_good = resistance_of(bench, cell)
        tables.append(f"### {cell.name}\n\n{table}")
        is_good = is_good and is_cell_good
    head = (Path(__file__).parent / "resistance.md").read_text()
    return head.replace("@TABLES@", "\n".join(tables)), is_good


class Ageing:
    """ageing.json: cells that were charged and tested until they were worn."""

    def __init__(self, bench: Bench) -> None:
        self.bench = bench
        self.plan = json.loads((Path(__file__).parent / "ageing.json").read_text())

    def files(self, cell: str) -> list[str]:
        folder = self.bench.data / self.plan["folder"]
        return [str(folder / self.plan[which].format(cell)) for which in ("charges", "tests")]

    def all_files(self) -> list[Path]:
        return [Path(name) for cell in self.plan["cells"] for name in self.files(cell)]

    def score(self, fitted_to: str, scored_on: str, *more: str) -> dict:
        arguments = ["health", "--json", "--rated-Ah", f"{self.plan['rated_Ah']}"]
        arguments += ["--current-A", f"{self.plan['current_A']}", "--full-voltage", f"{self.plan['full_voltage_V']}"]
        arguments += ["--end-current-A", f"{self.plan['end_current_A']}"]
        arguments += ["--loss-per-cycle", f"{self.plan['loss_per_cycle_pct']}"]
        charges, tests = self.files(fitted_to)
        arguments += ["--fit", charges, "--fit-tests", tests, *more, *self.files(scored_on)]
        return json.loads(self.bench.run(*arguments))


@dataclass
class HealthCase:
    """A row of the table."""

    name: str
    options: list[str]
    is_limited: bool = False


def health_cases(plan: dict) -> list[HealthCase]:
    cases = [HealthCase("the whole charge", [], True)]
    for voltage in plan["from_voltages_V"]:
        is_limited = voltage <= plan["limited_up_to_V"]
        cases.append(HealthCase(f"from {voltage:g} V", ["--from-voltage", f"{voltage}"], is_limited))
    cases += [HealthCase(f"from {soc:g} %", ["--from-soc", f"{soc}"]) for soc in plan["from_soc_pct"]]
    cases.append(HealthCase("first tests only", ["--fit-until-cycle", f"{plan['early_until_cycle']}"]))
    cases.append(HealthCase("every test", ["--all-tests"]))
    return cases


def health_columns(score: dict) -> str:
    single, told = score["single"], score["all"]
    if single is None:
        return "0 | - | - | - | -"
    return (
        f"{single['tests']} | **{single['rmse_pct']:.2f}** | {single['max_pct']:.1f} | "
        f"{single['inside_uncertainty_pct']:.0f} % | {told['rmse_pct']:.2f}, {told['inside_uncertainty_pct']:.0f} %"
    )


def health_section(ageing: Ageing) -> tuple[str, bool]:
    """The text, and whether all that is limited is within its limit."""
    plan = ageing.plan
    first, second = plan["cells"]
    ways = [(first, second), (second, first)]
    text = "| |" + "".join(f" charges | {b} by {a}: RMSE | at most | inside | all so far, inside |" for a, b in ways)
    text += "\n|---|" + "---|---|---|---|---|" * len(ways) + "\n"
    is_good = True
    for case in health_cases(plan):
        scores = [ageing.score(*way, *case.options) for way in ways]
        text += f"| {case.name} | " + " | ".join(health_columns(score) for score in scores) + " |\n"
        if case.is_limited:
            is_good = is_good and all(score["single"]["rmse_pct"] <= plan["limit_pct"] for score in scores)
    pictures = ""
    weights = ""
    for fitted_to, scored_on in ways:
        name = f"health-{scored_on.lower()}.svg"
        score = ageing.score(fitted_to, scored_on, "--svg", str(ROOT / "docs" / "pictures" / name))
        model = score["model"]
        weights += (
            f"Fitted to {fitted_to}: {model['plateau_weight']:.3f} of the plateau, {model['above_weight']:.3f} of what is above "
            f"it, sigma {model['sigma_Ah']:.4f} Ah. "
        )
        pictures += f"![{scored_on}, estimated by what was fitted to {fitted_to}](pictures/{name})\n\n"
    page = (Path(__file__).parent / "health.md").read_text()
    values = {
        "KIND": plan["kind"],
        "ORIGIN": plan["origin"],
        "CURRENT": f"{plan['current_A']:g}",
        "VOLTAGE": f"{plan['full_voltage_V']:g}",
        "LIMIT": f"{plan['limit_pct']:g}",
        "BETTER": f"{plan['better_pct']:g}",
        "TESTS": f"{score['tests']}",
        "EARLY": f"{plan['early_until_cycle']}",
        "LOSS": f"{plan['loss_per_cycle_pct']:g}",
        "TABLE": text,
        "PICTURES": f"{weights.strip()}\n\n{pictures.rstrip()}\n",
    }
    for key, value in values.items():
        page = page.replace(f"@{key}@", value)
    return page, is_good


@dataclass
class Section:
    """A section of the page that can be written by itself: from which recordings, and what makes it.

    `write` gives the text, from the heading to the last line, and whether all that is limited is within its limit.
    """

    files: list[Path]
    write: Callable[[], tuple[str, bool]]


def sections_of(bench: Bench, cells: list[Cell]) -> dict[str, Section]:
    """By the names in SECTIONS."""
    ageing = Ageing(bench)
    return {
        "drives": Section(drive_files(cells, bench.data), lambda: drives_section(bench, cells)),
        "resistance": Section(pulse_files(cells, bench.data), lambda: resistance_section(bench, cells)),
        "health": Section(ageing.all_files(), lambda: health_section(ageing)),
    }


def with_section(page: str, section: str) -> str:
    """The page with this section in the place of the one with the same heading, or before the last one."""
    parts = re.split(r"^(?=## )", page, flags=re.MULTILINE)
    heading = section.splitlines()[0]
    places = [place for place, text in enumerate(parts) if text.splitlines()[0] == heading]
    if places:
        parts[places[0]] = f"{section}\n"
    else:
        parts.insert(len(parts) - 1, f"{section}\n")
    return "".join(parts)


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path, help="folder with one folder of recordings a cell")
    parser.add_argument("--bmucell", type=Path, default=ROOT / "build" / "bin" / "bmucell")
    part = parser.add_mutually_exclusive_group()
    part.add_argument("--only", metavar="KEY", help="one cell of cells.json; nothing but its cell file is written")
    part.add_argument("--section", choices=SECTIONS, help="only this section of the page is written anew")
    return parser.parse_args()


def read_cells(only: str | None) -> list[Cell]:
    cells = [Cell(**each) for each in json.loads((Path(__file__).parent / "cells.json").read_text())]
    if only is None:
        return cells
    chosen = [cell for cell in cells if cell.key == only]
    if not chosen:
        raise Failed(f"--only: found '{only}', wanted one of {', '.join(cell.key for cell in cells)}")
    return chosen


def page_of(parts: list[str], sections: list[str], missed: list[str]) -> str:
    head = (Path(__file__).parent / "page.md").read_text().replace("@MISSED@", ";\n".join(missed))
    return head.replace("@TABLES@", "\n".join(parts)).replace("@SECTIONS@", "\n".join(sections))


def charge_parts(bench: Bench, cells: list[Cell], is_shown: bool) -> tuple[list[str], list[str], bool]:
    """A part of the page for each cell, what held-out recordings miss, and whether every figure is within its limit."""
    parts = []
    missed = []
    is_good = True
    with tempfile.TemporaryDirectory() as folder:
        for cell in cells:
            picture = ROOT / "docs" / "pictures" / f"{cell.key}.svg"
            picture.parent.mkdir(exist_ok=True)
            bench.fit(cell, cell.all_drives(), cell.file, picture)
            rows = []
            for temperature in cell.drives:
                print(f"accuracy: {cell.key} at {temperature} C", file=sys.stderr)
                rows.append(row_of(bench, cell, temperature, Path(folder) / "cell.json"))
            is_good = is_good and all(row.is_good() for row in rows)
            missed += held_out(cell, rows)
            parts.append(f"## {cell.name} ({cell.kind})\n\n![The tables of this cell](pictures/{cell.key}.svg)\n\n{table_of(rows)}")
            if is_shown:
                print(parts[-1])
    return parts, missed, is_good


def demand(files: list[Path]) -> None:
    missing = [path for path in files if not path.is_file()]
    if missing:
        raise Failed("these recordings are missing, nothing was done:\n  " + "\n  ".join(str(path) for path in missing))


def main() -> int:
    arguments = parse_arguments()
    bench = Bench(arguments.bmucell, arguments.data)
    cells = read_cells(arguments.only)
    sections = sections_of(bench, cells)
    chosen = [] if arguments.only else [sections[name] for name in SECTIONS if arguments.section in (None, name)]
    wanted = [] if arguments.section else drive_files(cells, bench.data)
    demand(wanted + [path for section in chosen for path in section.files])
    parts, missed, is_good = ([], [], True) if arguments.section else charge_parts(bench, cells, arguments.only is not None)
    texts = []
    for section in chosen:
        text, is_within = section.write()
        texts.append(text)
        is_good = is_good and is_within
    page = ROOT / "docs" / "accuracy.md"
    if arguments.section:
        page.write_text(with_section(page.read_text(), texts[0]))
    elif not arguments.only:
        page.write_text(page_of(parts, texts, missed))
    return 0 if is_good else 1


if __name__ == "__main__":
    try:
        sys.exit(main())
    except Failed as failed:
        print(f"accuracy: {failed}", file=sys.stderr)
        sys.exit(2)
