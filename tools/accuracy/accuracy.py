#!/usr/bin/env python3
"""Fits the cell files of measured cells and scores the estimators on them: config/cells/ and docs/accuracy.md.

Takes the folder with the recordings, one folder a cell as cells.json names them. What is missing is said, and nothing is
written. Exit status: 0 if every figure is within its limit, 1 if one is not, 2 if data are missing or a program fails.

  tools/accuracy/accuracy.py DATA                      fit, score, cross-validate, write
  tools/accuracy/accuracy.py --only lg-hg2 DATA        one cell, and print instead of writing the page
  tools/accuracy/accuracy.py --bmucell build/bin/bmucell DATA
"""

from __future__ import annotations

import argparse
import json
import math
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ESTIMATORS = ("ekf", "mixed", "coulomb")
GAIN_ERROR = 0.02
OFFSET_C = 0.005
SOC_ERROR_PCT = -10
SWITCH_ON_SOC_PCT = 60
SWITCH_ON_ERROR_PCT = 20


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
    file: Path = field(init=False)

    def __post_init__(self) -> None:
        self.file = ROOT / "config" / "cells" / f"{self.key}.json"

    def path(self, data: Path, name: str) -> Path:
        return data / self.folder / f"{name}.csv.gz"

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


def rms(values: list[float]) -> float:
    return math.sqrt(sum(value * value for value in values) / len(values))


def after_20min(scores: list[dict]) -> float:
    return rms([score["rmse_after_20min_pct"] for score in scores])


def missing_files(cells: list[Cell], data: Path) -> list[Path]:
    wanted = [cell.path(data, name) for cell in cells for name in cell.all_drives() + cell.slow]
    return [path for path in wanted if not path.is_file()]


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
    one_left_out: float | None
    temperature_left_out: float | None
    limit: list[float] | None
    switch_limit: float | None

    def is_good(self) -> bool:
        good = self.limit is None or self.rmse["ekf"] <= self.limit[0]
        if self.switch_limit is not None:
            good = good and self.switched_on is not None and self.switched_on <= self.switch_limit
        return good


def start(error_pct: float) -> tuple[str, str]:
    return ("--soc-error", f"{error_pct:g}")


def switched_on(bench: Bench, cell: Cell, names: list[str]) -> float | None:
    """The longest time to come within 3 %, if all do."""
    scores = bench.score(cell, cell.file, names, *start(SWITCH_ON_ERROR_PCT), "--from-soc", str(SWITCH_ON_SOC_PCT))
    times = [score["settle_3pct_s"] for score in scores]
    return None if None in times else max(times)


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
    return Row(
        temperature=temperature,
        files=len(names),
        rmse={each: after_20min(scores) for each, scores in by_estimator.items()},
        most=max(score["max_after_20min_pct"] for score in ekf),
        inside=sum(score["inside_uncertainty_pct"] for score in ekf) / len(ekf),
        opposite=after_20min(opposite),
        switched_on=switched_on(bench, cell, names),
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
            f"{shown(row.switched_on, '{:.0f} s')} | {shown(row.one_left_out)} | {shown(row.temperature_left_out)} |\n"
        )
    return text


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path, help="folder with one folder of recordings a cell")
    parser.add_argument("--bmucell", type=Path, default=ROOT / "build" / "bin" / "bmucell")
    parser.add_argument("--only", metavar="KEY", help="one cell of cells.json; nothing but its cell file is written")
    return parser.parse_args()


def read_cells(only: str | None) -> list[Cell]:
    cells = [Cell(**each) for each in json.loads((Path(__file__).parent / "cells.json").read_text())]
    if only is None:
        return cells
    chosen = [cell for cell in cells if cell.key == only]
    if not chosen:
        raise Failed(f"--only: found '{only}', wanted one of {', '.join(cell.key for cell in cells)}")
    return chosen


def page_of(parts: list[str]) -> str:
    head = (Path(__file__).parent / "page.md").read_text()
    return head.replace("@TABLES@", "\n".join(parts))


def main() -> int:
    arguments = parse_arguments()
    cells = read_cells(arguments.only)
    missing = missing_files(cells, arguments.data)
    if missing:
        raise Failed("these recordings are missing, nothing was done:\n  " + "\n  ".join(str(path) for path in missing))
    bench = Bench(arguments.bmucell, arguments.data)
    parts = []
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
            parts.append(f"## {cell.name} ({cell.kind})\n\n![The tables of this cell](pictures/{cell.key}.svg)\n\n{table_of(rows)}")
            if arguments.only:
                print(parts[-1])
    if not arguments.only:
        (ROOT / "docs" / "accuracy.md").write_text(page_of(parts))
    return 0 if is_good else 1


if __name__ == "__main__":
    try:
        sys.exit(main())
    except Failed as failed:
        print(f"accuracy: {failed}", file=sys.stderr)
        sys.exit(2)
