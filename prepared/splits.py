#!/usr/bin/env python3
"""The header splits behind the moves: splits.py STEP... (names below), in a checkout in which move.py has run. No commits."""
import pathlib, re, subprocess, sys

C = "daemon/core/"


def read(path):
    return pathlib.Path(path).read_text()


def write(path, text):
    pathlib.Path(path).parent.mkdir(parents=True, exist_ok=True)
    pathlib.Path(path).write_text(text)


def cut(path, begin, end):
    """Takes away the text from `begin` up to and with `end`, and an empty line behind it; gives it."""
    text = read(path)
    assert text.count(begin) == 1, (path, begin, text.count(begin))
    start = text.index(begin)
    stop = text.index(end, start) + len(end)
    taken = text[start:stop]
    rest = text[stop:]
    rest = rest[1:] if rest.startswith("\n\n") else rest
    write(path, text[:start] + rest.lstrip("\n") if text[:start].endswith("\n\n") else text[:start] + rest)
    return taken.rstrip("\n") + "\n"


def header(path, about, standard, own, parts):
    lines = ["".join(f"// {line}\n" for line in about.split("\n")) + "#pragma once\n"]
    if standard:
        lines.append("".join(f"#include <{name}>\n" for name in sorted(standard)))
    if own:
        lines.append("".join(f'#include "{name}"\n' for name in sorted(own)))
    write(path, "\n".join(lines) + "\nnamespace bmu {\n\n" + "\n".join(parts) + "\n}  // namespace bmu\n")
    subprocess.run(["git", "add", "-N", path], check=True)


def includes(path, drop=(), add=()):
    text = read(path)
    for name in drop:
        assert f'#include "{name}"\n' in text, (path, name)
        text = text.replace(f'#include "{name}"\n', "")
    add = [name for name in add if f'#include "{name}"\n' not in text]
    if add:
        new = "".join(f'#include "{name}"\n' for name in sorted(add))
        # Not behind a source's own header, which stands alone.
        found = [m for m in re.finditer(r'^#include "[^"]+"\n', text, re.MULTILINE)]
        own = pathlib.PurePath(path).stem.removesuffix("_test")
        found = [m for m in found if not (path.endswith(".cpp") and m.group().endswith(f'/{own}.hpp"\n'))]
        if found:
            text = text[:found[-1].start()] + new + text[found[-1].start():]
        else:
            last = [m for m in re.finditer(r"^#(include|pragma)[^\n]*\n", text, re.MULTILINE)][-1]
            text = text[:last.end()] + "\n" + new + text[last.end():]
    write(path, text)


def replace(path, old, new):
    text = read(path)
    assert text.count(old) == 1, (path, old, text.count(old))
    write(path, text.replace(old, new))


def listed(row, other=None):
    """On the list of safety files, or on that of the others with its reason."""
    path = "tests/mutation/files.txt" if other is None else "tests/mutation/other_files.txt"
    write(path, read(path) + (row + "\n" if other is None else row.ljust(46) + other + "\n"))


def moved_lines(old, new):
    """Entries of the lists of exceptions whose line is in the new file now."""
    here, there = (set(map(str.strip, read(path).splitlines())) for path in (old, new))
    for path in ("tests/mutation/survivors.txt", "tests/mutation/coverage_exceptions.txt"):
        def one(match):
            return f"file: {new}\nline: {match.group(1)}" if match.group(1).strip() in there - here else match.group()
        write(path, re.sub(rf"file: {re.escape(old)}\nline: (.*)", one, read(path)))


def element():
    taken = cut(C + "measurement/pack_state.hpp", "/// Which cell, sensor, module, contactor or input a value belongs to.", "\n};\n")
    header(C + "types/element.hpp", "Where in the pack something is.", ["cstdint"], [C + "types/contactor_id.hpp"], [taken])
    includes(C + "measurement/pack_state.hpp", drop=[C + "types/contactor_id.hpp"], add=[C + "types/element.hpp"])
    includes(C + "types/fault_reading.hpp", drop=[C + "measurement/pack_state.hpp"], add=[C + "types/element.hpp"])
    includes(C + "estimation/health/step_response.hpp", add=[C + "measurement/pack_state.hpp"])
    includes(C + "estimation/pack_estimate.hpp", add=[C + "measurement/pack_state.hpp"])
    listed(C + "types/element.hpp", "where something is, for texts")


def contactors():
    sequence = C + "contactors/contactor_sequence.hpp"
    outputs = cut(sequence, "/// What is to be closed or driven.", "\n};\n")
    phase = cut(sequence, "enum class Phase : std::uint8_t", '  return "?";\n}\n')
    small = cut(sequence, "/// What contactors break without wear", "\n}\n")
    state = cut(sequence, "struct SequenceState {", "\n};\n")
    inputs = cut(sequence, "struct SequenceInputs {", "\n};\n")
    apart = cut(sequence, "/// How far the link may be from the pack", "\n}\n")
    follows = cut(sequence, "/// Link within the configured share of the pack", "\n}\n")
    instant = cut(sequence, "/// The sensor sends the results of one instant", "same_instant_max = 5ms;\n")
    together = cut(sequence, "/// Link and pack were both measured at `since` or later", "\n}\n")
    failure = cut(C + "faults/fault_table.hpp", "/// How a closing ended that did not succeed.", "\n};\n")
    new = C + "types/contactors.hpp"
    header(new, "The contactors as all stages know them: what is commanded, the phases of the sequence with its state and inputs, and when the\n"
           "DC link counts as following the pack.", ["array", "cstdint", "string_view"],
           [C + "types/contactor_id.hpp", C + "types/core_config.hpp", "protocol/time.hpp"], [outputs, phase, failure, small, state, inputs, apart, follows, instant, together])
    includes(sequence, drop=[C + "faults/fault_table.hpp"], add=[new])
    includes(C + "faults/fault_table.hpp", add=[new])
    includes(C + "faults/fault_readers_system.cpp", drop=[sequence], add=[new])
    includes(C + "faults/fault_readers_pack.cpp", drop=[C + "contactors/permission.hpp"], add=[new])
    includes(C + "plausibility/link_rise.cpp", drop=[sequence])
    includes(C + "plausibility/link_rise.hpp", add=[new])
    cut(C + "plausibility/link_rise.hpp", "struct SequenceState; ", "struct SequenceInputs;  // the same\n")
    includes(C + "decisions.hpp", drop=[sequence], add=[new])
    listed(new)
    moved_lines(sequence, new)
    moved_lines(C + "faults/fault_table.hpp", new)


def opening_cause():
    taken = cut(C + "records/event.hpp", "/// Why the contactors opened.", "\n};\n")
    header(C + "types/opening_cause.hpp", "Why the contactors opened; its text is event.hpp's.", ["cstdint"], [], [taken.split("\n", 1)[1]])
    includes(C + "records/event.hpp", add=[C + "types/opening_cause.hpp"])
    includes(C + "contactors/reclosing.hpp", drop=[C + "records/event.hpp"], add=[C + "types/opening_cause.hpp"])
    listed(C + "types/opening_cause.hpp", "names of causes, for records and texts")


def soc_method():
    taken = cut(C + "estimation/soc/soc_estimate.hpp", "enum class SocMethod", "\n}\n")
    header(C + "types/soc_method.hpp", "The methods by which the state of charge is estimated.", ["array", "cstddef", "string_view"], [], [taken])
    includes(C + "estimation/soc/soc_estimate.hpp", add=[C + "types/soc_method.hpp"])
    includes(C + "types/core_config.hpp", drop=[C + "estimation/soc/soc_estimate.hpp"], add=[C + "types/soc_method.hpp"])
    listed(C + "types/soc_method.hpp", "names of methods")


def charge_plateau_model():
    taken = cut(C + "estimation/health/charge_plateau.hpp", "/// What is known of a kind of cell. The file", "\n};\n")
    header(C + "cell/charge_plateau_model.hpp", "What a whole charge says of the capacity of a kind of cell (charge_plateau.hpp).", [], [], [taken])
    includes(C + "estimation/health/charge_plateau.hpp", add=[C + "cell/charge_plateau_model.hpp"])
    includes(C + "types/core_config.hpp", drop=[C + "estimation/health/charge_plateau.hpp"], add=[C + "cell/charge_plateau_model.hpp"])
    includes(C + "cell/ocv_shift.hpp", drop=[C + "types/core_config.hpp"], add=[C + "cell/cell_model.hpp"])
    listed(C + "cell/charge_plateau_model.hpp", "what a cell is said to be; checked where the file is read")


def cell_forecast_input():
    taken = cut(C + "limits/current_prediction.hpp", "/// What is known of a cell at the moment its voltage was taken.", "\n};\n")
    new = C + "estimation/cell_forecast_input.hpp"
    header(new, "What a forecast of one cell begins with (limits/current_prediction.hpp).", ["array"],
           [C + "cell/cell_dynamics.hpp", C + "estimation/soc/soc_estimate.hpp"], [taken])
    includes(C + "limits/current_prediction.hpp", drop=[C + "estimation/soc/soc_estimate.hpp"], add=[new])
    includes(C + "estimation/pack_estimate.hpp", drop=[C + "limits/current_prediction.hpp"], add=[new])
    includes(C + "limits/power_limits.cpp", add=[C + "limits/current_prediction.hpp"])


def bleed_current():
    taken = cut(C + "balancing/balancing_plan.hpp", "/// The current a resistor takes from a cell.", "\n}\n")
    new = C + "types/bleed_current.hpp"
    header(new, "What a balancing resistor takes from its cell.", ["cstdint"], [C + "types/core_config.hpp"], [taken])
    includes(C + "balancing/balancing_plan.hpp", add=[new])
    includes(C + "estimation/cell_charge.cpp", drop=[C + "balancing/balancing_plan.hpp"], add=[new])
    includes(C + "plausibility/balancing_switches.cpp", drop=[C + "balancing/balancing_plan.hpp"], add=[new])
    listed(new, "how much charge a cell has too much")


def event_queue():
    cut(C + "decisions.hpp", "/// Bounds what a tick has to copy;", "events_per_tick = 24;\n")
    replace(C + "records/event_queue.hpp", "class EventQueue {", """/// Bounds what a tick has to copy; a burst of events is spread over ticks, none is reordered.
inline constexpr std::size_t events_per_tick = 24;
using TickEvents = FixedVector<Event, events_per_tick>;

class EventQueue {""")
    replace(C + "records/event_queue.hpp", "void move_to(Decisions& out) {", "void move_to(TickEvents& out) {")
    replace(C + "records/event_queue.hpp", "out.events.try_push_back", "out.try_push_back")
    includes(C + "records/event_queue.hpp", drop=[C + "decisions.hpp"], add=[C + "records/event.hpp", "protocol/fixed_vector.hpp"])
    replace(C + "decisions.hpp", "FixedVector<Event, events_per_tick> events;", "TickEvents events;")
    includes(C + "decisions.hpp", drop=[C + "records/event.hpp"], add=[C + "records/event_queue.hpp"])
    for path in sorted(pathlib.Path("daemon/core").glob("core*.cpp")):
        write(path, re.sub(r"\.move_to\(out\)", ".move_to(out.events)", re.sub(r"\.move_to\(decisions\)", ".move_to(decisions.events)", read(path))))


def loop_counters():
    taken = cut("daemon/shell/loop.hpp", "/// How well the loop keeps its time.", "\n};\n")
    new = "daemon/shell/status/loop_counters.hpp"
    header(new, "How well the control loop keeps its time.", ["array", "cstdint"], ["daemon/core/types/observation.hpp", "protocol/time.hpp"], [taken.split("\n", 1)[1]])
    includes("daemon/shell/loop.hpp", add=[new])
    includes("daemon/shell/status/status_view.hpp", drop=["daemon/shell/loop.hpp"], add=[new])


def config():
    k = "config/"
    buses = cut(k + "pack_config.hpp", "struct BusNames {", "\n};\n")
    sources = cut(k + "pack_config.hpp", "/// The texts that a pack was read from", "\n};\n")
    pack = cut(k + "pack_config.hpp", "struct PackConfig {", "\n};\n")
    sections = [k + f"types/{name}_config.hpp" for name in ("gpio", "history", "intake_air", "interface", "serial")]
    header(k + "types/pack.hpp", "A pack as its file describes it.", ["cstdint", "optional", "string"], [*sections, C + "types/core_config.hpp"], [buses, sources, pack])
    position = cut(k + "pack_config.hpp", "/// Where in a text, counted from 1;", "\n};\n")
    problem = cut(k + "pack_config.hpp", "/// One thing wrong with the file.", "\n};\n")
    text = cut(k + "pack_config.hpp", '/// "pack.json: /modules/2/node:', "to_text(const ConfigProblem& problem);\n")
    alias = cut(k + "pack_config.hpp", "using ConfigProblems =", ";\n")
    header(k + "json/problem.hpp", "What is wrong with a file, and where in it.", ["cstddef", "optional", "string", "vector"], [], [position, problem, text, alias])
    includes(k + "pack_config.hpp", drop=[*sections, C + "types/core_config.hpp"], add=[k + "json/problem.hpp", k + "types/pack.hpp"])
    # Their definitions
    of_text = cut(k + "pack_config.cpp", "std::string to_text(const ConfigProblem& problem) {", "\n}\n")
    name = cut(k + "pack_config.cpp", "const std::string& BusNames::name(Port port) const {", "\n}\n")
    others = cut(k + "pack_config.cpp", "BusNames BusNames::with(const BusNames& given) const {", "\n}\n")
    write(k + "types/pack.cpp", f'#include "config/types/pack.hpp"\n\nnamespace bmu {{\n\n{name}\n{others}\n}}  // namespace bmu\n')
    subprocess.run(["git", "add", "-N", k + "types/pack.cpp"], check=True)
    replace(k + "CMakeLists.txt", "  json/json_reader.cpp json/read_file.cpp)", "  json/json_reader.cpp json/read_file.cpp\n  types/pack.cpp)")
    replace(k + "CMakeLists.txt", '"json/json_reader.cpp;pack_config.cpp;', '"json/json_reader.cpp;types/pack.cpp;pack_config.cpp;')
    reader = read(k + "json/json_reader.cpp")
    write(k + "json/json_reader.cpp", reader[:reader.rindex("}  // namespace bmu")] + of_text + "\n}  // namespace bmu\n")
    includes(k + "json/json_reader.hpp", drop=[k + "pack_config.hpp"], add=[k + "json/problem.hpp"])
    # A cell file
    cell = cut(k + "cell_file/cell_config.hpp", "/// A cell file: the model, and what is only for people.", "\n};\n")
    parts = [C + "cell/cell_dynamics.hpp", C + "cell/cell_model.hpp", C + "cell/derating.hpp"]
    plateau = C + ("cell/charge_plateau_model.hpp" if pathlib.Path(C + "cell/charge_plateau_model.hpp").exists() else "estimation/health/charge_plateau.hpp")
    header(k + "types/cell_file.hpp", "A cell as its file describes it.", ["optional", "string"], [*parts, plateau], [cell.split("\n", 1)[1] if False else cell])
    includes(k + "cell_file/cell_config.hpp", drop=[*parts, C + "estimation/health/charge_plateau.hpp"], add=[k + "types/cell_file.hpp", "protocol/result.hpp"])
    includes(k + "fields/pack_fields.hpp", drop=[k + "cell_file/cell_config.hpp", k + "pack_config.hpp"], add=[k + "types/cell_file.hpp", k + "types/pack.hpp"])
    includes(k + "json/json_reader.cpp", add=["protocol/assert.hpp"])
    includes("tests/unit/config/checks/bus_rate_test.cpp", add=[k + "pack_config.hpp"])
    write(k + "pack_config.hpp", re.sub(r"#include <(cstddef|optional|vector)>\n", "", read(k + "pack_config.hpp")))
    for path in [*sorted(pathlib.Path(k + "checks").glob("*.?pp")), pathlib.Path(k + "fields/gpio_section.hpp")]:
        if f'#include "{k}pack_config.hpp"\n' in read(path):
            includes(str(path), drop=[k + "pack_config.hpp"], add=[k + "types/pack.hpp"])


STEPS = {f.__name__: f for f in (element, contactors, opening_cause, soc_method, charge_plateau_model, cell_forecast_input, bleed_current, event_queue, loop_counters, config)}

if __name__ == "__main__":
    for step in sys.argv[1:] or list(STEPS):
        STEPS[step]()
