#!/usr/bin/python3
"""Our DBC files in an independent reader, canmatrix: they load without a word, and what it makes of a log is what bmudump
makes of it, signal by signal.

    cross_check.py BMUDUMP LOG DIALECT            the internal bus and the vehicle messages
    cross_check.py BMUDUMP LOG --device NAME [OPTION...]
                                                  a foreign device, or every charger ("charger"); options are bmudump's

Exits with 1 and the first differences, with 77 where canmatrix is not installed (tools/packages.sh test). The first line names
Debian's own python, which is the one that Debian's packages are for."""

import json
import logging
import subprocess
import sys
import tempfile

SKIPPED = 77
TEXT_SIZES_BITS = (32, 64)
NODES = "1,2,63"
# What a name ends with, and how many of it are one of what the DBC has: written down anew, not taken from the tables.
PER_UNIT = {"uV": 1e6, "mV": 1e3, "mA": 1e3, "dC": 10, "Ohm": 1e3, "uOhm": 1e3, "uAs": 3.6e9, "mWh": 1e6, "permille": 10, "ppm": 1e4, "W": 1, "ms": 1, "s": 1}
UNITS = {"uV": "V", "mV": "V", "mA": "A", "dC": "C", "Ohm": "kOhm", "uOhm": "mOhm", "uAs": "Ah", "mWh": "kWh", "permille": "%", "ppm": "%", "W": "W",
         "ms": "ms", "s": "s"}

try:
    import warnings

    warnings.simplefilter("ignore")  # of canmatrix' own source with a newer python
    logging.disable(logging.CRITICAL)  # which formats it cannot read
    import canmatrix
    import canmatrix.formats

    logging.disable(logging.NOTSET)
except ImportError as missing:
    print(f"skipped: {missing}; tools/packages.sh test installs it")
    sys.exit(SKIPPED)


class Complaints(logging.Handler):
    """Keeps what canmatrix has to say."""

    def __init__(self):
        super().__init__(logging.WARNING)
        self.words = []

    def emit(self, record):
        self.words.append(record.getMessage())


def load_dbc(bmudump, bus, complaints, *options):
    with tempfile.NamedTemporaryFile("w", suffix=".dbc") as file:
        subprocess.run([bmudump, "--dbc", bus, *options], stdout=file, check=True)
        file.flush()
        loaded = canmatrix.formats.loadp_flat(file.name)
    complaints.words += [str(error) for error in loaded.load_errors]
    return {identifier(frame): frame for frame in loaded.frames}


def identifier(frame):
    """As a log has it: eight digits if it has 29 bits."""
    return f"{frame.arbitration_id.id:0{8 if frame.arbitration_id.extended else 3}X}"


def dbc_name(name):
    stem, _, unit = name.rpartition("_")
    return (stem, unit) if unit in PER_UNIT else (name, None)


def is_text(raw, size_bits):
    """Printable letters with nothing but zeros behind them: what bmudump prints as a text."""
    letters = raw.to_bytes(size_bits // 8, "big").rstrip(b"\0")
    return all(0x20 <= letter <= 0x7E for letter in letters)


def difference(signal, ours, theirs, unit):
    """What is different between our value and theirs, or nothing."""
    definition = theirs.signal
    if isinstance(ours, str):
        raw = int.from_bytes(ours.encode("latin-1"), "big")
        return None if int(theirs.raw_value) == raw else f"text {ours!r} is raw {theirs.raw_value}"
    if unit and definition.unit != UNITS[unit]:
        return f"unit {definition.unit!r}, wanted {UNITS[unit]!r}"
    physical = float(theirs.phys_value)
    may_be_text = definition.size in TEXT_SIZES_BITS and not definition.unit
    if ours is None and may_be_text and not is_text(int(theirs.raw_value), definition.size):
        return None
    if ours is None:
        is_named = int(theirs.raw_value) in definition.values
        is_outside = not float(definition.min) <= physical <= float(definition.max)
        return None if is_named or is_outside else f"no number of ours is {physical} there, neither named nor out of range"
    wanted = ours / PER_UNIT.get(unit, 1)
    return None if abs(physical - wanted) <= 1e-9 * max(1.0, abs(wanted)) else f"{wanted} here is {physical} there"


def compare(line, frames, seen):
    frame = frames.get(line["id"])
    if frame is None:
        return [f"{line['id']} is not in the DBC"]
    seen.add(line["id"])
    # A frame may leave out what has no signal.
    decoded = frame.decode(bytes.fromhex(line["bytes"]).ljust(frame.size, b"\0"))
    found = []
    names = {"crc"}
    for name, ours in line["signals"].items():
        theirs_name, unit = dbc_name(name)
        names.add(theirs_name)
        if theirs_name not in decoded:
            found.append(f"{line['id']} {frame.name}: {name} is not decoded")
            continue
        what = difference(name, ours, decoded[theirs_name], unit)
        if what:
            found.append(f"{line['id']} {frame.name} [{line['bytes']}] {name}: {what}")
    found += [f"{line['id']} {frame.name}: only the DBC has {name}" for name in set(decoded) - names]
    return found


def words_of_device(bmudump, name):
    """What makes bmudump read it, or each charger of its list, on the bus of make_every_frame: one that is named, where every frame is the device's."""
    if name != "charger":
        return ["--device", f"vcan0={name}"]
    listed = subprocess.run([bmudump, "--devices"], stdout=subprocess.PIPE, check=True, text=True).stdout.splitlines()
    chargers = [line.split()[0] for line, kind in zip(listed, listed[1:]) if kind.strip().startswith("charger,")]
    return [word for charger in chargers for word in ("--device", f"vcan0={charger}")]


def main(bmudump, log, dialect, device=None, *options):
    complaints = Complaints()
    logging.getLogger().addHandler(complaints)
    if dialect == "--device":
        how = [*words_of_device(bmudump, device), *options]
        frames = load_dbc(bmudump, device, complaints, *options)
    else:
        how = ["--dialect", dialect]
        how_ours = [*how, "--nodes", NODES]
        frames = {
            **load_dbc(bmudump, "internal", complaints, *how_ours),
            **load_dbc(bmudump, "vehicle", complaints, *how_ours),
        }
    with open(log, encoding="ascii") as lines:
        data = [line.split("#")[1].strip() for line in lines]
    text = subprocess.run([bmudump, "-r", log, "--json", "--strict", *how], stdout=subprocess.PIPE, check=True).stdout
    ours = [json.loads(line) for line in text.splitlines()]
    seen = set()
    found = list(complaints.words)
    if len(ours) != len(data):
        found.append(f"{len(ours)} JSON lines of {len(data)} frames")
    signals = 0
    for line, one in zip(ours, data):
        line["bytes"] = one
        if line.get("dialect", dialect) != dialect:
            found.append(f"{line['id']} is read as {line['dialect']}, wanted {dialect}")
        signals += len(line["signals"])
        found += compare(line, frames, seen)
    found += [f"{name} {frame.name} is not in the log" for name, frame in frames.items() if name not in seen]
    print("\n".join(found[:20]))
    print(f"{len(ours)} frames of {len(seen)} identifiers, {signals} signals compared, {len(found)} differences")
    return 1 if found or signals == 0 else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
