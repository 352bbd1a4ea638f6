#!/usr/bin/env python3
"""Writes README.md of each folder of the product's sources: what lives here, what it may include, where to start reading."""
import pathlib
R = """
daemon/core | The core: observations in, decisions out. Pure: no clock, socket, log, thread or heap. | all folders below, `devices`, `protocol` | `core.hpp`, then `core_decide.cpp`: the stages in their order
daemon/core/cell | A cell as its file describes it: open-circuit voltage, resistances, time constants, derating over temperature. | `protocol` | `cell_model.hpp`; the tables of a measured cell are `cell_dynamics.hpp`
daemon/core/types | What all stages share: configuration, observations, measured values with their age, contactors and phases, elements of the pack. No logic. | `cell`, `devices`, `protocol` | `core_config.hpp`, `observation.hpp`, `contactors.hpp`
daemon/core/measurement | Frames become values: modules, current sensor, lines, insulation monitor, chargers, inverter, second pack; and the pack as one summary. | `types`, `cell` | `module_table.hpp`, `sensor_table.hpp`, then `pack_state.hpp`
daemon/core/modules | What is sent to the module units: polls and their pace, limits after a restart, node numbers, broadcasts; and which modules are present. | `measurement` and below | `poll_schedule.hpp`, `module_setup.hpp`
daemon/core/estimation | The estimates of the pack: state of charge, health, energy, missing charge of each cell. | `soc`, `health`, `modules` and below | `pack_estimate.hpp`
daemon/core/estimation/soc | State of charge of one cell: coulomb counting, extended Kalman filter, mixed method, ends of a charge. | `modules` and below | `soc_estimate.hpp`, `cell_estimate.hpp`; the filter is `soc_filter.hpp`
daemon/core/estimation/health | Capacity and resistance of cells and pack, from steps of the current, rests and whole charges. | `soc`, `modules` and below | `cell_health.hpp`, `step_response.hpp`
daemon/core/limits | How much current and power the pack may carry, now and for ten seconds: tables, prediction of cell voltages, ramps. | `estimation` and below | `limits.hpp`, `current_prediction.hpp`
daemon/core/plausibility | Measurements compared over time and with each other: values that stand still, trends, overload by I²t, bus errors, charger against request, DC link. | `estimation` and below | `watchers.hpp`: one member a question
daemon/core/faults | The fault table, the reader of each row's value, and the state of each fault: pending, confirmed, latched. | `limits`, `plausibility` and below | `fault_table.hpp`, then `fault_memory.hpp`
daemon/core/contactors | Requests to close, permission, the sequence with its precharge, wear, the command on the bus, and the gate that checks every outgoing frame. | `faults` and below | `permission.hpp`, `contactor_sequence.hpp`
daemon/core/balancing | Which cells are discharged, by how much, and when not. | `contactors` and below | `balancing_plan.hpp`, `balancing_control.hpp`
daemon/core/charging | What a charger is asked for, its pause to measure resistances, charging on after a power cut. | `contactors` and below | `charge_control.hpp`
daemon/core/vehicle | Messages to other control units: vehicle reports in all dialects, cells on request, inverter. | `contactors` and below | `report_vehicle.hpp`, `vehicle_state.hpp`
daemon/core/records | What outlives a decision: events with their texts, freeze frames, fault history, persistent state. | all other folders of the core | `event.hpp`, `persistent_state.hpp`
daemon/shell | All of Linux that the daemon needs. Here: program, session and control loop. | all folders below, `daemon/core`, `daemon/history`, `daemon/recording`, `config` | `main.cpp`, `daemon_life.cpp`, `loop.hpp`
daemon/shell/can | CAN ports: SocketCAN, the embedded bus in shared memory, interfaces and their bit rates. | `system` | `bus_port.hpp`, `can_socket.hpp`
daemon/shell/gpio | Contactors and inputs on GPIO lines. | `system` | `gpio_lines.hpp`, `line_feeder.hpp`
daemon/shell/cli | Command lines of all programs: options, mistakes, manual pages, completions, exit codes. | | `command_line.hpp`
daemon/shell/json | JSON texts, and the parts of a status that recordings have, too. | `system` | `json_text.hpp`, `core_view.hpp`
daemon/shell/state | The state file: what the next session begins with, written by a thread of its own. | `system` | `state_store.hpp`, `state_text.hpp`
daemon/shell/recorder | Recordings and black boxes: queue from the loop, thread, files, compression. | `can`, `json`, `system` | `recorder.hpp`, `memory.hpp`
daemon/shell/serial | The serial console: commands, service mode, dump of the history. | `state`, `system` | `serial_console.hpp`, `serial_commands.hpp`
daemon/shell/status | The status socket: access rights, requests, and the answers as JSON. | all other folders of the shell | `status_socket.hpp`, `status_requests.cpp`
daemon/shell/system | Small things of the operating system: descriptors, errors, log, service manager, real-time priority, files. | | `owned_fd.hpp`, `journal.hpp`
daemon/history | The database of minutes and events: averaged, written by a thread, read by tools. | `daemon/core` | `history_store.hpp`, `history_row.hpp`
daemon/recording | Recordings as lines of a log, and the replay through the same core. | `daemon/core`, `config` | `record_line.hpp`, `replay.hpp`
config | Pack files: text in, a valid configuration or every problem out. | all folders below, `daemon/core` | `pack_config.hpp`
config/types | A pack and a cell as their files describe them. | `daemon/core` | `pack.hpp`
config/json | JSON with comments as a tree, and the list of problems with their places. | | `json_reader.hpp`, `problem.hpp`
config/fields | The keys of a pack file as rows: name, unit, range, default, text of the documentation. | `types`, `json` | `fields.hpp`, `pack_fields.hpp`
config/cell_file | Cell files: read, checked and written. | `fields` and below | `cell_config.hpp`
config/checks | Defaults that follow from other keys, and what no key shows alone: contradictions, load of the buses, identifiers. | `fields` and below | `pack_checks.hpp`
mmu | The emulated world: devices, electrical plant, scenarios. Pure. | `protocol`, `devices`, configuration and cell model of the core | `devices/mmu.hpp`, `scenario/simulator.hpp`
mmu/devices | The module unit with its parts, power distribution unit, sensors, and emulated devices of other makers. | `protocol`, `devices` | `mmu.hpp`; its microcontroller needs no more than that
mmu/plant | Cells, contactors, DC link, load and charger as an electrical circuit. | `mmu/devices` | `plant.hpp`
mmu/scenario | The script language, and all devices together in virtual time. | `mmu/devices`, `mmu/plant` | `scenario.hpp`, `world.hpp`
tools/report | A pack over time as one page, from a history or from recordings. | `daemon`, `tools/common` | `data.hpp`, `page.hpp`
protocol | Units, frames, messages as rows, receive check, lines of candump, DBC files. Pure. | `protocol/tables` | `message.hpp`, `signal.hpp`, `receive_check.hpp`
protocol/tables | The rows of the messages: internal bus, vehicle bus and its dialects. | `protocol` | `internal_bus.hpp`
devices | What drivers of foreign devices have in common, and the list of the devices. Each device has a folder. Pure. | `protocol` | `device.hpp`, then docs/adding-a-device.md
tools/common | What the tools share: terminal, files of logs, pictures, a core with an emulated pack in one process. | `daemon`, `config`, `mmu`, `protocol` | `terminal.hpp`, `line_reader.hpp`, `virtual_run.hpp`
tools/bmuctl | The operator's program: asks the status socket, shows pages and a live picture, writes reports. | `daemon`, `tools/report`, `tools/common` | `main.cpp`, `text_pages.hpp`
tools/bmudump | Frames as text: live or from logs, in tables, with statistics. | `identify`, `devices`, `protocol`, `tools/common` | `main.cpp`, `dump.hpp`
tools/bmudump/identify | Which device or dialect sent the frames of a log. | `devices`, `protocol`, `tools/common` | `device_fit.hpp`, `dialect.hpp`
tools/bmucell | Cell files from recorded tests, and scores of the estimators on recordings. | `data`, `fit`, `config`, `daemon/core`, `tools/common` | `main.cpp`, `evaluate.hpp`
tools/bmucell/data | Tables and series as they were recorded, checked. | `config`, `daemon/core`, `tools/common` | `series.hpp`, `csv_file.hpp`
tools/bmucell/fit | The parameters of a cell model from recorded voltages. | `data` and what that may include | `fit.hpp`
tools/bmureplay | Recordings through the core of this build, and the decisions compared. | `daemon`, `config`, `tools/common` | `main.cpp`, `run.hpp`
tools/mmusim | The emulated world as a program: on a bus, or with a core in virtual time. | `mmu`, `daemon`, `config`, `tools/common` | `main.cpp`, `run.hpp`
""".strip().splitlines()
for row in R:
    folder, what, may, start = (part.strip() for part in row.split(" | " if " | | " not in row else "|"))
    may = f"May include {may}." if may else "Includes no other folder of the daemon." if folder.startswith("daemon") else "Includes no other folder of `config`."
    text = f"# {folder}\n\n{what}\n\n{may}\n\nStart reading: {start}.\n"
    (pathlib.Path(folder) / "README.md").write_text(text)
print(len(R), "written")
