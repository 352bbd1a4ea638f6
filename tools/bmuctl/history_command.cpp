#include "tools/bmuctl/history_command.hpp"

#include <algorithm>
#include <cstdio>
#include <functional>

#include "daemon/history/history_reader.hpp"
#include "daemon/shell/cli/exit_codes.hpp"
#include "tools/bmuctl/cell_choice.hpp"
#include "tools/bmuctl/history_file.hpp"
#include "tools/bmuctl/history_text.hpp"
#include "tools/bmuctl/time_words.hpp"
#include "tools/common/standard_output.hpp"
#include "tools/report/clocked_span.hpp"

namespace bmu {

namespace {

using exit_codes::exit_damaged;
using exit_codes::exit_ok;
using exit_codes::exit_system;
using exit_codes::exit_usage;
constexpr const char* default_from = "-1h";
constexpr std::size_t out_chunk_bytes = 1 << 16;

constexpr const char* footer_begin = R"(Examples:
  bmuctl history                                   the last hour, a line a minute
  bmuctl history --from today                      since midnight
  bmuctl history --from "2026-03-01 17:00" --to "2026-03-01 18:00" --cells 1.3,2.*
  bmuctl history --from begin --cells all --csv >history.csv
  bmuctl --json history --from -2h | jq '.soc_permille'
  bmuctl history --events --from yesterday         events
  bmuctl history --file /mnt/card/history.sqlite --from begin
  bmuctl history --file /var/lib/bmud/history.sqlite.damaged-20260301T171500Z --from begin   its readable rows

)";
constexpr const char* footer_end = R"(
Tables show this machine's time zone and how far it is ahead of UTC, CSV and JSON have UTC (2026-03-01T16:05:09Z).
Cells: all, 19 (no. 19), 1.3 (cell 3 of module 1), 2.* (all of module 2).

A minute from before the clock was set is shown at its time by the clock that was set later in the same session;
'--from begin' shows the times as written.

Each row is a minute: mean, minimum and maximum of its samples, and the state at its end. A value that was not measured
is empty, null or "--". JSON has one line per row. Before the end of the first minute there is no row: "Nothing recorded
yet", in JSON the line {"nothing_recorded_yet":true, ...}.

The file is that of the running daemon, otherwise /var/lib/bmud/history.sqlite. It is only read; the daemon can write it
meanwhile. Of a damaged file, including one that the daemon has quarantined, all readable rows are shown.

Exit codes: 0 shown, even if the time range is empty; 1 no history, an unreadable one, or the output cannot be written;
2 command line; 3 damaged: the readable rows are shown, and standard error names the others.)";

std::string complain(const std::string& text, const char* wanted) {
  return "found '" + text + "', expected " + wanted;
}
std::string is_choice(const std::string& text) {
  return cell_choice_from(text) ? "" : complain(text, cell_choice_form);
}

/// Buffers standard output: a month is some hundred megabytes of CSV.
class Output {
 public:
  Output() = default;
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;
  ~Output() { write_out(text_); }

  void add(const std::string& text) {
    text_ += text;
    if (text_.size() < out_chunk_bytes) return;
    write_out(text_);
    text_.clear();
  }

 private:
  std::string text_;
};

enum class Form { table, csv, json };

struct Shown {
  HistorySpan span;
  Form form = Form::table;
  CellChoice cells;
  bool with_colour = false;
};

/// The layout of the newest session: the columns of all rows.
const HistoryLayout& newest_layout(const HistoryReader& history) {
  static const HistoryLayout none;
  return history.lives().empty() ? none : history.lives().back().layout;
}

/// The sensors in the modules of the cells.
std::vector<HistoryPlace> sensors_beside(const std::vector<HistoryPlace>& cells, const HistoryLayout& layout) {
  std::vector<HistoryPlace> sensors;
  for (const HistoryPlace& sensor : layout.sensors()) {
    const bool is_beside =
        std::any_of(cells.begin(), cells.end(), [&](const HistoryPlace& cell) { return cell.module == sensor.module; });
    if (is_beside) sensors.push_back(sensor);
  }
  return sensors;
}

/// The selector that no cell of any session matches; "" if there is none, or no session at all.
std::string nobody_of(const HistoryReader& history, const CellChoice& choice) {
  std::vector<HistoryPlace> cells;
  for (const HistoryLife& life : history.lives()) {
    const std::vector<HistoryPlace> own = life.layout.cells();
    cells.insert(cells.end(), own.begin(), own.end());
  }
  return cells.empty() ? "" : meant_by_none(choice, cells);
}

/// Returns the number of rows shown.
std::size_t show_rows(const HistoryReader& history, report::ClockedSpan& span, const Shown& shown) {
  Output out;
  const std::vector<HistoryPlace> cells = chosen(shown.cells, newest_layout(history).cells());
  const std::vector<HistoryPlace> sensors = sensors_beside(cells, newest_layout(history));
  HistoryTable table(cells);
  std::size_t count = 0;
  if (shown.form == Form::csv) out.add(csv_head(cells, sensors));
  span.for_each_row([&](const HistoryRow& row) {
    const HistoryLife& life = *history.life_of(row);
    ++count;
    if (shown.form == Form::csv) {
      out.add(csv_line(row, life.layout, cells, sensors));
    } else if (shown.form == Form::json) {
      const std::vector<HistoryPlace> own = chosen(shown.cells, life.layout.cells());
      out.add(json_line(row, own, sensors_beside(own, life.layout)));
    } else {
      table.add(row, life);
    }
    return true;
  });
  if (!table.is_empty()) out.add(table.page().text(shown.with_colour));
  return count;
}

std::size_t show_events(report::ClockedSpan& span, const Shown& shown) {
  Output out;
  HistoryTable table({});
  std::size_t count = 0;
  if (shown.form == Form::csv) out.add(csv_event_head());
  span.for_each_event([&](const HistoryEvent& event) {
    ++count;
    if (shown.form == Form::csv) {
      out.add(csv_line(event));
    } else if (shown.form == Form::json) {
      out.add(json_line(event));
    } else {
      table.add(event);
    }
    return true;
  });
  if (!table.is_empty()) out.add(table.page().text(shown.with_colour));
  return count;
}

bool has_event(HistoryReader& history) {
  bool is_found = false;
  history.for_each_event({}, [&](const HistoryEvent&) {
    is_found = true;
    return false;
  });
  return is_found;
}

/// True without any minute and, if events are requested, without any event at any time.
bool is_nothing_recorded(HistoryReader& history, bool of_events) {
  return history.has_no_minute_yet() && !(of_events && has_event(history));
}

void say_nothing_recorded(const HistoryReader& history, Form form) {
  if (form == Form::json) {
    write_out(nothing_json_line(history.path(), history.period_s()));
  } else if (form == Form::table) {
    std::printf("Nothing %s.\n", recorded_yet_text(history.path(), history.period_s()).c_str());
  }
}

void say_nothing_there(HistoryReader& history, const char* what) {
  if (!history.problems().empty()) {
    std::printf("No %s of this span can be read: %s is damaged.\n", what, history.path().c_str());
    return;
  }
  const HistorySpan covered = history.covered();
  if (!covered.from_unix_ms || !covered.to_unix_ms) {
    const char* none = history.has_no_minute_yet() ? "no minute yet" : "no minute with a known time";
    std::printf("No %s in this span, and %s in all of %s.\n", what, none, history.path().c_str());
    return;
  }
  std::printf("No %s in this span. %s has minutes from %s to %s.\n", what, history.path().c_str(),
              local_time_text(*covered.from_unix_ms).c_str(), local_time_text(*covered.to_unix_ms).c_str());
}

/// On standard error, because a program may read standard output.
void say_of_no_time(std::size_t rows) {
  if (rows == 0) return;
  std::fprintf(stderr,
               "bmuctl: history: %zu minutes may belong to this time range and are not shown, because the clock was "
               "never set in their session; '--from begin' shows them\n",
               rows);
}

}  // namespace

void HistoryCommand::add_to(CLI::App& app) {
  command_ = app.add_subcommand("history", "minute averages and events from the history database");
  command_->add_option("--from", from_, "start of the time range; default: the last hour")->type_name("TIME");
  command_->add_option("--to", to_, "end of the time range")->type_name("TIME");
  command_->add_option("--cells", cells_, "cells to show one by one, with the sensors of their modules in CSV and JSON")
      ->check(is_choice)
      ->type_name("CELLS");
  command_->add_flag("--events", events_, "events instead of minutes");
  command_->add_flag("--csv", csv_, "comma separated values with a line of names");
  command_->add_option("--file", file_, "database to read instead of the daemon's")->type_name("PATH");
  command_->footer(std::string(footer_begin) + time_words_help + footer_end);
}

int HistoryCommand::run(const HistoryCommandContext& context) const {
  const bool has_span = !from_.empty() || !to_.empty();
  const auto span = time_span_from_words(has_span ? from_ : default_from, to_, now_in_unix_ms());
  if (!span || (context.json && csv_)) {
    std::fprintf(stderr, "bmuctl: history: %s\n",
                 span ? "--csv and --json: expected only one of them" : span.error().c_str());
    return exit_usage;
  }
  auto history = HistoryReader::open(file_.empty() ? history_file(context.socket) : file_);
  if (!history) {
    std::fprintf(stderr, "bmuctl: %s\n", history.error().c_str());
    return exit_system;
  }
  const Shown shown{.span = {.from_unix_ms = span->from_unix_ms, .to_unix_ms = span->to_unix_ms},
                    .form = context.json ? Form::json
                            : csv_       ? Form::csv
                                         : Form::table,
                    .cells = cell_choice_from(cells_).value_or(CellChoice{}),
                    .with_colour = context.with_colour};
  const std::string nobody = nobody_of(*history, shown.cells);
  if (!nobody.empty()) {
    std::fprintf(stderr, "bmuctl: history: --cells: found '%s', which no pack in %s has\n", nobody.c_str(),
                 history->path().c_str());
    return exit_usage;
  }
  report::ClockedSpan clocked(*history, shown.span);
  const std::size_t count = events_ ? show_events(clocked, shown) : show_rows(*history, clocked, shown);
  if (count == 0 && is_nothing_recorded(*history, events_)) {
    say_nothing_recorded(*history, shown.form);
  } else if (count == 0 && shown.form == Form::table) {
    say_nothing_there(*history, events_ ? "events" : "minutes");
  }
  say_of_no_time(clocked.rows_of_no_time());
  const std::vector<std::string> problems = history->problems();
  for (const std::string& problem : problems) std::fprintf(stderr, "bmuctl: %s\n", problem.c_str());
  return problems.empty() ? exit_ok : exit_damaged;
}

}  // namespace bmu
