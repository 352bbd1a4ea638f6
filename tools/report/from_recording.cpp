#include "tools/report/from_recording.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <utility>

#include "daemon/core/estimation/energy_left.hpp"
#include "tools/common/clock_set.hpp"
#include "tools/report/time.hpp"

namespace bmu::report {

namespace {

constexpr std::int64_t us_per_s = 1'000'000;
constexpr double milli = 1e3;
constexpr double uAs_per_Ah = 3.6e9;
constexpr double percent = 100.0;
/// Minimum length of a reported gap between two parts: a core decides at least every 50 ms.
constexpr std::int64_t gap_min_us = us_per_s;
constexpr std::uint64_t clock_notes_max = 20;

/// The time of "(1700000000.130000) vcan0 ..." and "# (1700000000.130000) tick ..."; none: it has none.
std::optional<std::int64_t> time_of(std::string_view line) {
  if (line.starts_with("# ")) line.remove_prefix(2);
  const std::size_t point = line.find('.');
  const std::size_t end = line.find(')');
  if (!line.starts_with('(') || end == std::string_view::npos || point > end) return std::nullopt;
  std::int64_t seconds = 0;
  std::int64_t micros = 0;
  std::from_chars(line.data() + 1, line.data() + point, seconds);
  std::from_chars(line.data() + point + 1, line.data() + end, micros);
  return seconds * us_per_s + micros;
}

std::string_view event_of(std::string_view line) {
  constexpr std::string_view begin = "# ! ";
  return line.substr(0, begin.size()) == begin ? line.substr(begin.size()) : std::string_view{};
}

Figure figure(bool is_known, double value, double sigma) {
  if (!is_known) return {};
  return {.value = static_cast<float>(value), .doubt = static_cast<float>(sigmas_told * sigma)};
}

}  // namespace

void RecordingReport::begin_file(const std::string& name) {
  settle();
  if (!is_over_) take_figures();
  files_.push_back({.name = name});
}

bool RecordingReport::take(std::string_view line) {
  altered_.reset();
  const bool is_head = line.starts_with("# bmud-recording ");
  if (is_head) settle();
  // The following times are on another clock.
  if (line.starts_with("# ahead_us ")) settle();
  if (const auto at_us = time_of(line)) {
    // A time that was modified to a later one would extend the report; the replay refuses this line then.
    if (held_us_ && *at_us < *held_us_ - gap_min_us) {
      held_us_.reset();
      altered_line_ = tick_line_;
    }
    settle();
  }
  if (!is_over_ && is_head) {  // another core follows
    add_bled();
    take_figures();
  }
  if (!replay_.take(line)) return false;
  if (altered_) {
    // Its decisions result from other frames than the recorded ones.
    ticks_ = replay_.counts().ticks;
    altered_line_ = replay_.counts().lines;
    data_.events.resize(std::min(events_before_last_, data_.events.size()));
    return false;
  }
  if (replay_.counts().begun != part_) begin_part();
  if (replay_.counts().ticks != ticks_) {
    ticks_ = replay_.counts().ticks;
    tick_line_ = replay_.counts().lines;
    held_us_ = time_of(line);
    return true;
  }
  const std::string_view event = event_of(line);
  if (!event.empty() && held_us_) held_events_.emplace_back(event);
  return true;
}

/// Takes the latest tick once the following line agrees with its time; the core has no further observation until then.
void RecordingReport::settle() {
  if (const auto at_us = std::exchange(held_us_, std::nullopt)) {
    take_tick(*at_us);
    for (std::string& event : held_events_) {
      if (is_tick_shown_) data_.events.push_back({.at_us = last_us_, .text = std::move(event)});
    }
  }
  held_events_.clear();
}

std::string RecordingReport::trouble(std::uint64_t line) const {
  if (!altered_) return "line " + std::to_string(line) + ": " + replay_.problem()->text;
  // The replay does not count omitted lines.
  const std::uint64_t count = replay_.counts().lines - altered_->line;
  return "line " + std::to_string(line - count) + ": from here to line " + std::to_string(line) +
         " the lines were modified: a line is missing, changed or added";
}

/// Null: the current file has no open gap.
RecordingReport::OpenHole* RecordingReport::open_hole_of_file() {
  return !holes_.empty() && holes_.back().file == files_.size() ? &holes_.back() : nullptr;
}

void RecordingReport::break_off(const std::string& why) {
  settle();
  is_tick_shown_ = false;
  if (OpenHole* const open = open_hole_of_file()) {  // no tick was taken since its start
    if (open->hole.text.find(why) == std::string::npos) open->hole.text += "; " + why;
    return;
  }
  holes_.push_back({.hole = {.from_us = last_us_ > 0 ? std::optional(last_us_) : std::nullopt,
                             .to_us = std::nullopt,
                             .text = (files_.empty() ? "" : files_.back().name + ", ") + why,
                             .is_damage = true},
                    .file = files_.size()});
}

void RecordingReport::go_on(const std::string& from_where) {
  if (OpenHole* const open = open_hole_of_file()) open->hole.text += "; reading goes on at " + from_where;
}

/// Starts a core with the state of the last one, or one after missing lines.
void RecordingReport::begin_part() {
  part_ = replay_.counts().begun;
  if (data_.cells.empty()) name_cells();
  is_other_pack_ = !has_same_modules();
  is_part_new_ = true;
  is_tick_shown_ = false;
  flow_ = replay_.core()->charge();
  add_bled();
}

void RecordingReport::add_bled() {
  for (std::size_t i = 0; i < bled_begin_uAs_.size(); ++i) bled_uAs_[i] += bled_last_uAs_[i] - bled_begin_uAs_[i];
  bled_begin_uAs_.clear();
}

bool RecordingReport::has_same_modules() const {
  std::size_t cells = 0;
  std::size_t sensors = 0;
  for (const ModuleConfig& module : replay_.pack()->core.modules) {
    for (std::size_t i = 0; i < module.cell_count; ++i, ++cells) {
      if (cells >= data_.cells.size() || data_.cells[cells].module != module.node) return false;
    }
    sensors += module.temperature_sensor_count;
  }
  return cells == data_.cells.size() && sensors == data_.sensors.size();
}

void RecordingReport::name_cells() {
  const PackConfig& pack = *replay_.pack();
  data_.pack_name = pack.name;
  data_.cell_name = pack.cell_name;
  data_.source = " by bmud " + replay_.reader().version();  // after the names of the files
  std::uint16_t number = 0;
  for (const ModuleConfig& module : pack.core.modules) {
    const std::string node = std::to_string(module.node);
    for (unsigned i = 1; i <= module.cell_count; ++i) {
      CellReport& cell = data_.cells.emplace_back();
      cell.name = node + "." + std::to_string(i);
      cell.module = module.node;
      cell.pack_number = ++number;
    }
    for (unsigned i = 1; i <= module.temperature_sensor_count; ++i) {
      data_.sensors.push_back({.name = "sensor " + node + "." + std::to_string(i), .temperature_C = {}});
    }
  }
  means_.resize(data_.cells.size(), data_.sensors.size());
  bled_uAs_.resize(data_.cells.size());
}

bool RecordingReport::is_shown(std::int64_t at_us) const {
  return (!options_.from_us || at_us >= *options_.from_us) && (!options_.to_us || at_us < *options_.to_us);
}

/// True for a tick that is not newer than the shown ones: an earlier file has it too, or the clock was set back.
bool RecordingReport::is_of_before(std::int64_t at_us) {
  File& file = files_.back();
  const bool is_first = !std::exchange(file.has_tick, true);
  if (is_first && files_.size() > 1 && at_us <= last_us_) file.overlap_begin_us = at_us;
  const bool overlaps = file.overlap_begin_us > 0 && !file.has_own;
  if (overlaps && at_us <= last_us_) {
    file.overlap_end_us = at_us;
    if (const OpenHole* const open = open_hole_of_file()) {
      data_.notes.push_back(open->hole.text + "; another file has what is missing there.");
      holes_.pop_back();
    }
    return true;
  }
  // A smaller step is a correction of the clock.
  if (at_us > last_us_ - gap_min_us) {
    file.has_own = true;
    return false;
  }
  ++ticks_back_;
  return true;
}

/// Converts to the clock as it was set last, as far as that is known by now.
std::int64_t RecordingReport::shown_time(std::int64_t recorded_us) {
  const std::int64_t ahead_us = replay_.reader().clock().ahead_us;
  const std::int64_t core_us = recorded_us - ahead_us;
  const std::int64_t life = replay_.reader().part_id().life;
  if (life == 0) return recorded_us;  // no session number: it is unknown which times share a clock
  if (lives_.empty() || life != life_) {
    begin_life(recorded_us);
  } else if (core_us > life_last_core_us_) {  // else it is an overlap with another file, with its earlier clock
    follow_clock(ahead_us - recorded_ahead_us_, recorded_us);
  }
  life_last_core_us_ = std::max(life_last_core_us_, core_us);
  return core_us + shown_ahead_us_;
}

/// Starts a session on its own clock; after other recorded sessions if that clock has not been set.
void RecordingReport::begin_life(std::int64_t recorded_us) {
  const bool is_known = std::find(lives_.begin(), lives_.end(), replay_.reader().part_id().life) != lives_.end();
  life_ = replay_.reader().part_id().life;
  if (!is_known) lives_.push_back(life_);
  recorded_ahead_us_ = shown_ahead_us_ = replay_.reader().clock().ahead_us;
  life_from_us_ = recorded_us;
  life_last_core_us_ = recorded_us - recorded_ahead_us_;
  if (is_known || last_us_ == 0) return;
  if (!is_clock_set(recorded_us) && recorded_us <= last_us_) {
    life_from_us_ = last_us_ + gap_min_us;
    shown_ahead_us_ += life_from_us_ - recorded_us;
    note_clock("From " + time_text(life_from_us_) +
               " on the clock has not been set since the computer started; how much time is missing before is not "
               "known.");
  } else if (is_clock_set(recorded_us) && !is_clock_set(last_us_)) {
    move_shown(std::numeric_limits<std::int64_t>::min(), recorded_us - gap_min_us - last_us_);
    note_clock("The clock was never set before " + time_text(recorded_us) +
               ": what was recorded before is shown right ahead of it.");
  }
}

void RecordingReport::follow_clock(std::int64_t set_by_us, std::int64_t recorded_us) {
  if (set_by_us == 0) return;
  recorded_ahead_us_ += set_by_us;
  if (std::abs(set_by_us) < gap_min_us) {  // a correction of the clock
    shown_ahead_us_ += set_by_us;
    return;
  }
  const bool was_set = is_clock_set(recorded_us - set_by_us);
  const bool is_set = is_clock_set(recorded_us);
  if (is_set) {
    const std::int64_t moved_us = recorded_ahead_us_ - shown_ahead_us_;
    move_shown(was_set ? std::numeric_limits<std::int64_t>::min() : life_from_us_, moved_us);
    life_from_us_ += moved_us;
    shown_ahead_us_ += moved_us;
  }
  note_clock("The clock was set " + std::string(set_by_us < 0 ? "back" : "forward") + " by " +
             span_text(std::abs(set_by_us)) + " at " + time_text(recorded_us) +
             (is_set && !was_set ? ", for the first time since the computer started" : "") +
             (is_set ? "; what came before is shown on the clock as it was set."
                     : "; what follows is shown on the clock as it was."));
}

void RecordingReport::note_clock(const std::string& text) {
  if (++clock_settings_ <= clock_notes_max) data_.notes.push_back(text);
}

/// Moves everything shown from `from_us` on.
void RecordingReport::move_shown(std::int64_t from_us, std::int64_t by_us) {
  const auto move = [from_us, by_us](std::int64_t& at_us) {
    if (at_us != 0 && at_us >= from_us) at_us += by_us;
  };
  for (std::int64_t& at_us : data_.times_us) {
    if (at_us + data_.sample_us > from_us) at_us += by_us;
  }
  if (sample_us_ != 0 && sample_us_ + data_.sample_us > from_us) sample_us_ += by_us;
  for (SpanReport& span : data_.spans) {
    move(span.from_us);
    move(span.to_us);
  }
  for (EventReport& event : data_.events) move(event.at_us);
  for (HoleReport& hole : data_.holes) {
    if (hole.from_us) move(*hole.from_us);
    if (hole.to_us) move(*hole.to_us);
  }
  for (OpenHole& open : holes_) {
    if (open.hole.from_us) move(*open.hole.from_us);
  }
  move(last_us_);
}

void RecordingReport::take_tick(std::int64_t recorded_us) {
  is_tick_shown_ = false;
  events_before_last_ = data_.events.size();
  if (files_.empty()) begin_file("");
  if (is_other_pack_) {
    ++ticks_foreign_;
    return;
  }
  std::int64_t at_us = shown_time(recorded_us);
  if (is_of_before(at_us)) {
    flow_ = replay_.core()->charge();
    return;
  }
  at_us = std::max(at_us, last_us_);
  if (is_part_new_) follow(at_us);
  const bool goes_on = at_us - last_us_ < gap_min_us;
  last_us_ = at_us;
  file_of_last_ = files_.size() - 1;
  if (options_.to_us && at_us >= *options_.to_us) end_shown(goes_on);
  if (!is_shown(at_us)) {
    flow_ = replay_.core()->charge();
    return;
  }
  is_tick_shown_ = true;
  // The incomplete sample may have been moved by a change of the clock.
  if (at_us - sample_us_ >= data_.sample_us) {
    const std::int64_t sample_us = at_us - at_us % data_.sample_us;
    close_sample();
    sample_us_ = sample_us - sample_us % data_.sample_us;  // the length of samples may have been doubled
  }
  means_.look(*replay_.core(), replay_.counts().last);
  look_at_flow();
  spans_.look(*replay_.core(), replay_.counts().last, at_us, data_.spans);
}

/// Handles the first tick of a part: it continues the last one that was shown, or there is a gap between them.
void RecordingReport::follow(std::int64_t at_us) {
  is_part_new_ = false;
  const RecordPartId before = std::exchange(part_id_, replay_.reader().part_id());
  if (!holes_.empty()) {
    for (OpenHole& open : holes_) {
      if (open.file != files_.size()) open.hole.text += "; reading goes on at the begin of " + files_.back().name;
    }
    return end_holes(at_us);
  }
  if (last_us_ == 0) return;
  const bool lost_lines = before.life != 0 && before.life == part_id_.life && part_id_.part > before.part + 1;
  if (!lost_lines && at_us - last_us_ < gap_min_us) return;
  const std::string& file = files_.back().name;
  const std::string& file_before = files_[file_of_last_].name;
  std::string text = "nothing was recorded";
  if (file_of_last_ + 1 != files_.size()) {
    text = "nothing between " + file_before + " and " + file;
  } else if (lost_lines) {
    text = file + ": lines were lost when it was recorded";
  }
  holes_.push_back({.hole = {.from_us = last_us_, .to_us = std::nullopt, .text = std::move(text), .is_damage = false},
                    .file = files_.size()});
  end_holes(at_us);
}

/// Ends the open gaps at this time, if there is one.
void RecordingReport::end_holes(std::optional<std::int64_t> at_us) {
  close_sample();
  spans_.break_off(data_.spans, last_us_);
  for (OpenHole& open : holes_) {
    open.hole.to_us = at_us;
    add_hole(std::move(open.hole));
  }
  holes_.clear();
}

/// Adds the part of a gap between --from and --to.
void RecordingReport::add_hole(HoleReport hole) {
  const std::optional<std::int64_t>& from_us = options_.from_us;
  const std::optional<std::int64_t>& to_us = options_.to_us;
  const bool is_before = from_us && hole.to_us && *hole.to_us <= *from_us;
  const bool is_behind = to_us && hole.from_us && *hole.from_us >= *to_us;
  if (is_before || is_behind) return;
  if (from_us && hole.from_us) hole.from_us = std::max(*hole.from_us, *from_us);
  if (to_us && hole.to_us) hole.to_us = std::min(*hole.to_us, *to_us);
  data_.holes.push_back(std::move(hole));
}

/// States at --to continue after it. The figures are those at --to, unless the tick after it is a second or more later
/// than the one before.
void RecordingReport::end_shown(bool goes_on) {
  if (std::exchange(is_over_, true)) return;
  close_sample();
  spans_.break_off(data_.spans, *options_.to_us);
  if (!goes_on) return;
  add_bled();
  take_figures();
}

void RecordingReport::close_sample() {
  if (means_.is_empty()) return;
  means_.move_to(data_, sample_us_);
  if (data_.times_us.size() >= options_.samples_max) halve(data_);
}

void RecordingReport::look_at_flow() {
  const Core& core = *replay_.core();
  const ChargeState& now = core.charge();
  out_mWh_ += static_cast<double>(now.energy_out_mWh - flow_.energy_out_mWh);
  in_mWh_ += static_cast<double>(now.energy_in_mWh - flow_.energy_in_mWh);
  out_uAs_ += static_cast<double>(now.out_uAs - flow_.out_uAs);
  in_uAs_ += static_cast<double>(now.in_uAs - flow_.in_uAs);
  flow_ = now;
  bled_last_uAs_.resize(data_.cells.size());
  for (std::size_t i = 0; i < bled_last_uAs_.size(); ++i) bled_last_uAs_[i] = core.watchers().switches.bled_uAs(i);
  if (bled_begin_uAs_.empty()) bled_begin_uAs_ = bled_last_uAs_;
}

/// Takes the core's figures of each cell at the end of a file with new ticks, or at the end of the shown span.
void RecordingReport::take_figures() {
  if (files_.empty() || !files_.back().has_own || is_other_pack_) return;
  const PackEstimate& estimate = replay_.core()->estimate();
  const EnergyLeft energy = energy_left(estimate, replay_.core()->config());
  data_.energy_left_Wh = figure(energy.is_known, energy.energy_Wh, energy.sigma_Wh);
  for (std::size_t i = 0; i < data_.cells.size(); ++i) {
    CellReport& cell = data_.cells[i];
    const SocEstimate soc = estimate.cell_soc(i);
    cell.soc_percent = figure(soc.is_known, percent * soc.soc, percent * soc.sigma);
    const ResistanceEstimate resistance = estimate.cell_resistance(i);
    cell.resistance_mOhm = figure(resistance.is_known, resistance.resistance_Ohm * milli, resistance.sigma_Ohm * milli);
    const HealthFigure health = estimate.cell_health(i).health().by_capacity;
    cell.health_percent = figure(health.is_known, health.permille / 10.0, health.sigma_permille / 10.0);
    cell.bled_Ah = static_cast<float>(static_cast<double>(bled_uAs_[i]) / uAs_per_Ah);
  }
}

void RecordingReport::note(std::uint64_t count, const std::string& what) {
  if (count > 0) data_.notes.push_back(std::to_string(count) + what);
}

void RecordingReport::note_overlaps() {
  for (const File& file : files_) {
    if (file.overlap_begin_us == 0) continue;
    data_.notes.push_back(
        file.has_own ? "What " + file.name + " has of " + stretch_text(file.overlap_begin_us, file.overlap_end_us) +
                           " is in the files before it, too, and is shown once."
                     : "All that is in " + file.name + " is in the files before it, too, and is shown once.");
  }
}

ReportData RecordingReport::finish() && {
  settle();
  replay_.end();
  if (!holes_.empty()) end_holes(std::nullopt);
  close_sample();
  spans_.break_off(data_.spans, last_us_);
  if (!is_over_) {
    add_bled();
    take_figures();
  }
  data_.energy_out_Wh = out_mWh_ / milli;
  data_.energy_in_Wh = in_mWh_ / milli;
  data_.charge_out_Ah = out_uAs_ / uAs_per_Ah;
  data_.charge_in_Ah = in_uAs_ / uAs_per_Ah;
  if (!files_.empty()) {
    const std::string& first = files_.front().name;
    data_.source =
        (files_.size() == 1 ? "the recording " + first
                            : std::to_string(files_.size()) + " recordings, " + first + " to " + files_.back().name) +
        data_.source;
  }
  const ReplayCounts& counts = replay_.counts();
  note(ticks_different_, " of " + std::to_string(counts.ticks) +
                             " decisions were others when the recording was made: what is shown may differ from "
                             "what was.");
  if (clock_settings_ > clock_notes_max) {
    note(clock_settings_ - clock_notes_max, " more settings of the clock are left out here.");
  }
  note(ticks_back_, " decisions are not shown, as the clock had been set back.");
  note(ticks_foreign_, " decisions are not shown, as they are of a pack with other modules.");
  note_overlaps();
  return std::move(data_);
}

}  // namespace bmu::report
