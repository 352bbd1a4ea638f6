#!/usr/bin/env python3
"""Measures the daemon as a process on an embedded bus, with mmusim as its pack (docs/performance.md).

  tests/bench/daemon_measures.py start     from its start to READY=1, again and again
  tests/bench/daemon_measures.py steady    memory and processor time, closed and driven
  tests/bench/daemon_measures.py parked    how often it wakes up when nobody wants anything
  tests/bench/daemon_measures.py --json --seconds 5 --runs 1 steady

A daemon runs "plain", with none of these options, "kept", with state, history, black box and recording, or as "real-time",
which is "kept" with --realtime-priority and --lock-memory. Progress goes to standard error. Exit status: 0, or 1 if the daemon or mmusim did not do what it should.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LARGEST = ROOT / "tests/bench/largest.json"
DEMO = ROOT / "config/packs/demo-48s.json"
PATIENCE_S = 60  # on a machine that is busy with other things
TICKS_PER_S = os.sysconf("SC_CLK_TCK")
DRIVEN = """0     insulation resistance_kOhm 5000
0     pack soc_permille 500
2     vehicle on
wait  contactor main_positive closed within 55
+1    load profile drive
"""
PARKED = "0     pack soc_permille 500\n"
EMPTY = "0     pack soc_permille 500\n4     cell 1.1 voltage_mV 1600\n"


class Failed(Exception):
    """The daemon or the emulator did not do what it should."""


def tell(text):
    print(text, file=sys.stderr, flush=True)


def pack_file(name, folder):
    """A pack file of this name: "demo", or a number of modules of 12 cells, cut from the largest pack."""
    if name == "demo":
        return DEMO
    text = re.sub(r"^\s*//.*$", "", LARGEST.read_text(), flags=re.MULTILINE)
    pack = json.loads(text)
    del pack["$schema"]
    pack["cell"] = str(LARGEST.parent / pack["cell"])
    pack["modules"][0]["nodes"] = list(range(1, int(name) + 1))
    pack["rest"] = {"after_ms": 1000}
    path = Path(folder) / f"{name}.json"
    path.write_text(json.dumps(pack))
    return path


def cells_of(name):
    return 48 if name == "demo" else 12 * int(name)


class Bench:
    """A bus, a folder, and the programs on it."""

    number = 0

    def __init__(self, args, pack, scenario):
        Bench.number += 1
        self.bin = args.bin
        self.bus = f"unix:measure-{os.getpid()}-{Bench.number}"
        self.scenario = scenario
        self.daemon = self.emulator = None
        self.folder = tempfile.TemporaryDirectory(prefix="bmud-measure.")
        self.path = Path(self.folder.name)
        self.pack = pack_file(pack, self.path)

    def __enter__(self):
        if self.scenario is not None:
            script = self.path / "run.scn"
            script.write_text(self.scenario)
            # With a time it goes on when the script is over.
            words = ["--pack", self.pack, "--bus", self.bus, "--scenario", script, "--quiet", "--seconds", "100000"]
            with open(self.path / "mmusim.log", "w", encoding="utf-8") as log:
                self.emulator = subprocess.Popen([self.bin / "mmusim", *words], stdout=log, stderr=log)
            self.let_emulator_first()
            time.sleep(0.5)
        return self

    def let_emulator_first(self):
        """Before all ordinary programs, where we may: what it is late with would be the daemon's loss."""
        try:
            os.sched_setscheduler(self.emulator.pid, os.SCHED_FIFO, os.sched_param(40))
        except PermissionError:
            tell("no right to real-time priorities: mmusim is an ordinary program")

    def __exit__(self, *_):
        for process in (self.daemon, self.emulator):
            if process is not None and process.poll() is None:
                process.kill()
                process.wait()
        Path("/dev/shm/bmud-bus." + self.bus.removeprefix("unix:")).unlink(missing_ok=True)
        self.folder.cleanup()

    def options(self, run):
        if run == "plain":
            return []
        (self.path / "black-box").mkdir(exist_ok=True)
        (self.path / "record").mkdir(exist_ok=True)
        kept = ["--state", self.path / "state.json", "--history", self.path / "history.sqlite"]
        kept += ["--black-box", self.path / "black-box", "--record", self.path / "record"]
        return kept + (["--realtime-priority", "50", "--lock-memory"] if run == "real-time" else [])

    def start(self, run, notify=None):
        environment = {k: v for k, v in os.environ.items() if k not in ("STATE_DIRECTORY", "NOTIFY_SOCKET")}
        if notify is not None:
            environment["NOTIFY_SOCKET"] = notify
        words = ["--config", self.pack, "--bus-internal", self.bus, "--socket", self.path / "bmud.sock"]
        with open(self.path / "bmud.log", "w", encoding="utf-8") as log:
            self.daemon = subprocess.Popen(
                [self.bin / "bmud", *words, *self.options(run)], env=environment, stdout=log, stderr=log
            )

    def check_alive(self):
        for name, process in (("bmud", self.daemon), ("mmusim", self.emulator)):
            if process is not None and process.poll() is not None:
                log = (self.path / f"{name}.log").read_text(encoding="utf-8")
                raise Failed(f"{name} ended with {process.returncode}: {log[-500:]}")

    def status(self):
        with socket.socket(socket.AF_UNIX) as connection:
            connection.settimeout(PATIENCE_S)
            connection.connect(str(self.path / "bmud.sock"))
            connection.sendall(b'{"cmd":"status"}\n')
            return json.loads(connection.makefile().readline())

    def wait_until(self, what, is_so):
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            self.check_alive()
            try:
                if is_so(self.status()):
                    return
            except (FileNotFoundError, ConnectionRefusedError):
                pass  # not yet
            time.sleep(0.2)
        log = (self.path / "bmud.log").read_text(encoding="utf-8")
        raise Failed(f"not {what} within {PATIENCE_S} s: {log[-1500:]}")

    def end(self):
        self.daemon.send_signal(signal.SIGTERM)
        if self.daemon.wait(PATIENCE_S) != 0:
            raise Failed(f"bmud ended with {self.daemon.returncode}")


# --- what /proc says -------------------------------------------------------------------------------------------------


def processor_s(pid):
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS_PER_S


def numbers_of(path):
    """The lines "Name:  number" of a file of /proc."""
    lines = (line.split() for line in Path(path).read_text(encoding="utf-8").splitlines())
    return {words[0].rstrip(":"): int(words[1]) for words in lines if len(words) > 1 and words[1].isdigit()}


def memory_MB(pid):
    rolled = numbers_of(f"/proc/{pid}/smaps_rollup")
    status = numbers_of(f"/proc/{pid}/status")
    kept = {
        "resident_MB": rolled["Rss"],
        "own_MB": rolled["Private_Clean"] + rolled["Private_Dirty"],
        "embedded_bus_MB": status["RssShmem"],
        "most_resident_MB": status["VmHWM"],
    }
    return {name: kB / 1000 for name, kB in kept.items()}


def switches(pid):
    """How often its threads went to sleep, and how often they were only put off."""
    counts = [0, 0]
    for task in Path(f"/proc/{pid}/task").iterdir():
        numbers = numbers_of(task / "status")
        counts[0] += numbers["voluntary_ctxt_switches"]
        counts[1] += numbers["nonvoluntary_ctxt_switches"]
    return counts


def watch(pid, seconds):
    """Processor time in percent of a core, and sleeps a second."""
    began_at, busy, slept = time.monotonic(), processor_s(pid), switches(pid)
    time.sleep(seconds)
    took, now = time.monotonic() - began_at, switches(pid)
    return {
        "processor_pct": 100 * (processor_s(pid) - busy) / took,
        "sleeps_per_s": (now[0] - slept[0]) / took,
        "put_off_per_s": (now[1] - slept[1]) / took,
    }


def median_of(windows):
    return {name: statistics.median(window[name] for window in windows) for name in windows[0]}


# --- what is measured ------------------------------------------------------------------------------------------------


def start_once(bench, run):
    """Milliseconds from just before the process is made to the datagram that says READY=1."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as ear:
        path = str(bench.path / "notify")
        Path(path).unlink(missing_ok=True)
        ear.bind(path)
        ear.settimeout(PATIENCE_S)
        began_at = time.monotonic()
        bench.start(run, path)
        while b"READY=1" not in ear.recv(4096):
            pass
        took = time.monotonic() - began_at
        bench.end()
    return 1000 * took


def measure_start(args):
    for pack in args.packs or ["demo", "63"]:
        for run in ("plain", "kept"):
            with Bench(args, pack, PARKED) as bench:
                times = []
                for i in range(args.runs or 100):
                    times.append(start_once(bench, run))
                    if (i + 1) % 20 == 0:
                        tell(f"{cells_of(pack)} cells, {run}: {i + 1} starts")
            times.sort()
            yield {
                "cells": cells_of(pack),
                "run": run,
                "starts": len(times),
                "least_ms": times[0],
                "median_ms": statistics.median(times),
                "p90_ms": times[min(len(times) * 9 // 10, len(times) - 1)],
                "max_ms": times[-1],
            }


def is_closed(status):
    return status["state"]["phase"] == "closed"


def measure_steady(args):
    for pack in args.packs or ["16", "63"]:
        for run in ("plain", "kept", "real-time"):
            with Bench(args, pack, DRIVEN) as bench:
                bench.start(run)
                bench.wait_until("closed", is_closed)
                time.sleep(3)  # the load has begun
                windows = []
                for _ in range(args.runs or 3):
                    windows.append(watch(bench.daemon.pid, args.seconds or 20))
                    tell(f"{cells_of(pack)} cells, {run}: {windows[-1]['processor_pct']:.2f} %")
                bench.check_alive()
                if not is_closed(bench.status()):
                    raise Failed("the pack has opened")
                shares = sorted(window["processor_pct"] for window in windows)
                row = {"cells": cells_of(pack), "run": run, "processor_least_pct": shares[0]}
                row["processor_pct"] = statistics.median(shares)
                yield row | {"processor_most_pct": shares[-1]} | memory_MB(bench.daemon.pid)


# What is quiet, by name: the script of the pack (none: nobody answers), and how it is known that it has come.
QUIET = {
    "parked": (PARKED, lambda status: status["poll"]["pace"] == "parked"),
    "modules asleep": (EMPTY, lambda status: status["state"]["rest"] == "resting"),
    "nobody on the bus": (None, lambda status: status["daemon"]["uptime_ms"] > 5000),
}


def measure_parked(args):
    for pack in args.packs or ["4", "16"]:
        for state, (scenario, has_come) in QUIET.items():
            # On a machine that is busy an ordinary process sleeps through some of its ticks, and wakes up less.
            for run in ("kept", "real-time"):
                with Bench(args, pack, scenario) as bench:
                    bench.start(run)
                    bench.wait_until(state, has_come)
                    time.sleep(1)
                    tell(f"{cells_of(pack)} cells, {run}: {state}")
                    window = median_of([watch(bench.daemon.pid, args.seconds or 30) for _ in range(args.runs or 1)])
                    bench.check_alive()
                    if not has_come(bench.status()):
                        raise Failed(f"not {state} any more")
                    yield {"cells": cells_of(pack), "state": state, "run": run} | window


MEASURES = {"start": measure_start, "steady": measure_steady, "parked": measure_parked}


def shown(value):
    return f"{value:.2f}" if isinstance(value, float) else str(value)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=MEASURES)
    parser.add_argument("--bin", type=Path, default=ROOT / "build/bin", help="folder with bmud and mmusim")
    parser.add_argument("--packs", nargs="+", help='"demo", or numbers of modules of 12 cells')
    parser.add_argument("--runs", type=int, help="starts, or windows of time, of each")
    parser.add_argument("--seconds", type=float, help="length of a window of time")
    parser.add_argument("--json", action="store_true", help="a line of JSON for each row")
    args = parser.parse_args()
    args.bin = args.bin.resolve()
    has_head = False
    try:
        for row in MEASURES[args.what](args):
            if args.json:
                print(json.dumps(row), flush=True)
                continue
            if not has_head:
                print("  ".join(row))
                has_head = True
            print("  ".join(shown(value).rjust(len(name)) for name, value in row.items()), flush=True)
    except (Failed, OSError) as error:
        print(f"daemon_measures: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
