#include "tools/bmudump/dump.hpp"

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <limits>

#include "protocol/tables/vehicle_bus.hpp"
#include "tools/bmudump/device_fit.hpp"
#include "tools/bmudump/summary.hpp"

namespace bmu::dump {
namespace {

constexpr std::uint32_t default_vehicle_base_id = vehicle_bus::default_base_id;

volatile std::sig_atomic_t stop_requested = 0;

FrameText::Style style_of(const Options& options) {
  const bool is_table = options.output == Output::follow;  // which has colours of its own
  return {.is_coloured = options.is_coloured && !is_table,
          .is_brief = options.is_brief || is_table,
          .is_short = is_table,
          .has_letters = options.has_letters};
}

}  // namespace

int worse(int one, int other) {
  // A run that could not be read to its end says less than one with damaged lines.
  if (one == exit_system || other == exit_system) return exit_system;
  return one == exit_ok ? other : one;
}

Catalogues::Catalogues(const DumpCatalogue::Choice& choice, std::span<const Dialect> rows, const std::string& wanted,
                       const std::vector<DeviceWord>& devices)
    : dialects_(rows), is_auto_(find_dialect(rows, wanted) == nullptr) {
  for (const Dialect& row : rows) {
    if (row.rows.empty()) continue;
    if (row.name == wanted) first_ = readers_.size();
    readers_.push_back(std::make_unique<DumpCatalogue>(choice, row));
  }
  dialect_count_ = readers_.size();
  for (const std::string& bus : buses_of(devices)) {
    const Dialect* const chosen = find_dialect(rows, wanted);
    readers_.push_back(
        std::make_unique<DumpCatalogue>(choice_on(devices, bus, choice), chosen == nullptr ? rows.front() : *chosen));
    device_buses_.push_back({.name = bus, .reader = readers_.size() - 1, .catalogue = readers_.back().get()});
  }
}

bool Catalogues::is_declared(std::size_t reader) const {
  return reader >= dialect_count_ && device_buses_[reader - dialect_count_].name != every_bus;
}

std::size_t Catalogues::reader_of(const Dialect& dialect) const {
  std::size_t reader = 0;
  while (reader < dialect_count_ && &at(reader).dialect() != &dialect) ++reader;
  return is_auto_ && reader < dialect_count_ ? reader : size();
}

Dump::Dump(const Options& options, const Catalogues& catalogues, const Filter& filter,
           std::span<const BusChoice> choices, int fd)
    : options_(&options),
      catalogues_(&catalogues),
      filter_(&filter),
      buses_(catalogues.at(catalogues.first()), catalogues.first(), catalogues.dialects(), choices,
             catalogues.device_buses()),
      start_(options.start),
      out_(fd),
      left_(options.count.value_or(std::numeric_limits<std::uint64_t>::max())),
      is_of_log_(!options.files.empty()),
      shows_lines_(options.output == Output::text || options.output == Output::json || options.output == Output::log),
      needs_counts_(options.output == Output::summary || options.output == Output::summary_json || options.is_strict ||
                    options.output == Output::follow) {
  for (std::size_t reader = 0; reader < catalogues.size(); ++reader) {
    formats_.emplace_back(catalogues.at(reader), style_of(options), start_);
  }
  if (options.output == Output::follow) follow_ = std::make_unique<Follow>(buses_, formats_, options.bit_rate);
}

bool Dump::show(const LogLine& line) {
  Bus* const bus = buses_.find(line.bus);
  if (bus == nullptr) return false;
  if (is_of_log_) note_clock(*bus, line);
  if (bus->filter == nullptr) return true;
  if (line.kind == LogLineKind::frame && bus->dialect.note(line.frame)) note_dialect(*bus);
  // Every frame is judged, also those not shown: whether an answer is late depends on the POLL before it.
  const CheckedFrame verdict = line.kind == LogLineKind::frame ? judge(*bus, line) : CheckedFrame{};
  if (!filter_->passes(line.frame) || !bus->filter->passes(line.frame)) return true;
  if (line.kind == LogLineKind::frame) bus->hint.note(line.frame, verdict);
  const SeenFrame seen{line, verdict};
  IdStatistics* const row = needs_counts_ ? bus->statistics.count(line, verdict, clock_.sum()) : nullptr;
  if (shows_lines_) {
    print(*bus, seen);
  } else if (follow_) {
    follow_->note(*bus, seen, row, clock_.left_out_us());
  }
  --left_;
  return true;
}

/// Whether the row has a seal of the internal bus, and neither an option nor another seal shows that this bus is one.
bool Dump::has_doubtful_seal(const Bus& bus, std::size_t row) const {
  const DumpCatalogue& catalogue = catalogues_->at(bus.reader);
  return catalogue.is_internal(row) && has_crc(*catalogue.all().messages()[row]) && !bus.evidence.has_internal() &&
         !catalogues_->is_declared(bus.reader);
}

/// Whether nothing but the identifier shows who a frame of this row is from: no option gives what is on this bus,
/// nothing there had a seal of the internal bus, and the pack that may send there has not said its name.
bool Dump::is_doubtful(const Bus& bus, std::size_t row) const {
  const DumpCatalogue& catalogue = catalogues_->at(bus.reader);
  if (catalogues_->is_declared(bus.reader)) return false;
  if (catalogue.is_device(row)) return true;
  if (catalogue.is_internal(row)) return !bus.evidence.has_internal();
  const bool is_chosen = options_->dialect != "auto" || options_->catalogue.vehicle_base_id != default_vehicle_base_id;
  return catalogue.is_vehicle(row) && !is_chosen && !bus.evidence.has_pack_name();
}

/// Of a row that is doubtful. A 622h whose length has chosen its row proves nothing by it.
Fit Dump::fit_in(const Bus& bus, std::size_t row, const CanFrame& frame) const {
  const DumpCatalogue& catalogue = catalogues_->at(bus.reader);
  if (has_doubtful_seal(bus, row)) return Fit::no;
  const Fit fit = fit_of(*catalogue.all().messages()[row], frame);
  const bool has_chosen_row = catalogue.is_vehicle(row) && bus.dialect.is_told_by_length_of(frame);
  return fit == Fit::proven && has_chosen_row ? Fit::unproven : fit;
}

/// Under a doubtful identifier a frame is unknown that cannot be what the row says, or of which nothing but the
/// identifier says so. Where others of the identifier have passed a checksum, one that does not is damaged.
CheckedFrame Dump::judge(Bus& bus, const LogLine& line) const {
  const CanFrame& frame = line.frame;
  const CheckedFrame verdict = bus.check.check(frame);
  if (verdict.message == nullptr) return verdict;
  const DumpCatalogue& catalogue = catalogues_->at(bus.reader);
  const std::size_t row = catalogue.all().row_of(frame);
  if (has_doubtful_seal(bus, row)) {
    bus.evidence.note_seal(verdict.is_accepted && fit_of(*verdict.message, frame) == Fit::proven);
  }
  if (is_doubtful(bus, row)) {
    const Fit fit = fit_in(bus, row, frame);
    bus.evidence.note(catalogue, row, fit);
    const bool is_damaged = has_crc(*verdict.message) && !verdict.is_accepted && bus.hint.has_passed(frame) &&
                            frame.length == verdict.message->length;
    if (!is_damaged && !bus.evidence.believes(catalogue, row, fit)) return {};
  } else if (verdict.is_accepted && !catalogue.parts_of(row).empty()) {
    bus.evidence.note(catalogue, row, Fit::proven);
  }
  if (catalogue.is_vehicle(row)) note_vehicle(bus, verdict, frame);
  return verdict;
}

void Dump::note_vehicle(Bus& bus, const CheckedFrame& verdict, const CanFrame& frame) const {
  if (verdict.is_accepted) bus.evidence.note_vehicle();
  if (frame.id == catalogues_->at(bus.reader).vehicle_base_id() && is_pack_name(frame)) bus.evidence.note_pack_name();
}

static_assert(ClockJumps::bus_count_max == BusTable::bus_count_max);

/// The frames of all buses of a log have the time of one clock, also those of buses that are not shown.
void Dump::note_clock(const Bus& bus, const LogLine& line) {
  clock_jump_ = clock_.take(bus.index, line.time_us);
  if (clock_jump_.is_found()) start_.leave_out(clock_jump_.by_us);
}

bool Dump::is_whole(const LogLine& line) {
  if (line.kind == LogLineKind::fd_frame) {
    const LongFrame frame = long_frame_of(line);
    return frame.digits.size() == 2 * (frame.is_xl ? xl_bytes_max : fd_bytes_max);
  }
  const CanFrame& frame = line.frame;
  if (frame.length == frame.data.size()) return true;
  if (frame.is_remote) return frame.length > 0;  // a digit, behind which there is nothing but a code above 8
  const Bus* const bus = buses_.find(line.bus);
  if (frame.is_error || bus == nullptr) return false;
  const DumpCatalogue& catalogue = catalogues_->at(bus->reader);
  const MessageSpec* const message = catalogue.all().find(frame).message;
  if (message == nullptr || frame.length != message->length) return false;
  const std::size_t row = catalogue.all().row_of(frame);
  return !is_doubtful(*bus, row) || bus->evidence.believes(catalogue, row, fit_in(*bus, row, frame));
}

bool Dump::count_lost(std::string_view name, std::uint64_t frames) {
  Bus* const bus = buses_.find(name);
  if (bus == nullptr) return false;
  bus->check.forget_counters();
  if (bus->filter == nullptr) return true;
  bus->statistics.lost += frames;
  print_lost(*bus, frames);
  return true;
}

/// Where it was, for what reads these lines.
void Dump::print_lost(const Bus& bus, std::uint64_t frames) {
  const std::string count = std::to_string(frames);
  out_.begin_line();
  if (options_->output == Output::json) {
    out_.text("{\"time_s\":null,\"bus\":");
    out_.json_string(bus.name);
    out_.text(",\"lost\":" + count + "}\n");
  } else if (options_->output == Output::log) {
    out_.text("DROPCOUNT: dropped " + count + " CAN frame" + (frames == 1 ? "" : "s") + " on '" + bus.name +
              "' socket (total drops " + std::to_string(bus.statistics.lost) + ")\n");
  }
}

void Dump::print(const Bus& bus, const SeenFrame& seen) {
  switch (options_->output) {
    case Output::text: return formats_[bus.reader].print_text(seen, out_);
    case Output::json: return formats_[bus.reader].print_json(seen, out_);
    default: break;
  }
  static_assert(long_log_line_length_max < TextWriter::line_room);
  out_.begin_line();
  out_.take(print_log_line(seen.line, out_.room()));
  out_.letter('\n');
}

/// A bus that says it speaks another dialect is read by that one from now on, or, where that cannot be, it is told.
void Dump::note_dialect(Bus& bus) {
  const Dialect* const spoken = bus.dialect.spoken();
  const std::size_t reader = spoken == nullptr ? bus.reader : catalogues_->reader_of(*spoken);
  if (reader == bus.reader) return;
  if (reader < catalogues_->size()) {
    bus.reader = reader;
    bus.check = ReceiveCheck(catalogues_->at(reader).all(), ReceiveCheck::Role::listener);
    return;
  }
  const DumpCatalogue& used = catalogues_->at(bus.reader);
  if (spoken == &used.dialect()) return;
  std::fprintf(
      stderr,
      "bmudump: %s: %s: that is the dialect %s, and it is read here as %s; do not believe what stands in %03Xh, "
      "%03Xh, %03Xh and %03Xh\n",
      bus.name.c_str(), bus.dialect.sign().c_str(), std::string(spoken->name).c_str(),
      std::string(used.dialect().name).c_str(), static_cast<unsigned>(used.vehicle_base_id() + 2),
      static_cast<unsigned>(used.vehicle_base_id() + 5), static_cast<unsigned>(used.vehicle_base_id() + 6),
      static_cast<unsigned>(used.vehicle_base_id() + 7));
}

/// On standard error, and not about buses for which somebody has said what is read there.
void Dump::tell_hints() const {
  if (options_->output == Output::log) return;
  for (const std::unique_ptr<Bus>& bus : buses_.buses()) {
    const auto own = catalogues_->device_buses();
    const bool is_own =
        std::any_of(own.begin(), own.end(), [&bus](const DeviceBus& one) { return one.reader == bus->reader; });
    const std::vector<const Device*> candidates = bus->hint.candidates(options_->catalogue.devices);
    if (is_own || candidates.empty()) continue;
    std::string words;
    for (const Device* device : candidates) {
      words += (words.empty() ? "--device " : " or --device ") + working_words(bus->name, *device, options_->catalogue);
    }
    std::fprintf(stderr, "bmudump: %s: %zu of %zu identifiers that are not explained here could be read with %s\n",
                 bus->name.c_str(), bus->hint.explained_by(*candidates.front()), bus->hint.unexplained(),
                 words.c_str());
  }
}

/// Devices that were asked for and whose frames are left unknown, as no bus was given for them and none of their frames
/// shows more than an identifier.
void Dump::tell_doubts() const {
  if (options_->output == Output::log) return;
  for (const std::unique_ptr<Bus>& bus : buses_.buses()) {
    const DumpCatalogue& catalogue = catalogues_->at(bus->reader);
    for (std::size_t part = 0; part < catalogue.part_count(); ++part) {
      const Device* const device = catalogue.device_of(part);
      const std::uint64_t count = bus->evidence.left_unknown(part);
      if (device == nullptr || count == 0 || bus->evidence.has(part)) continue;
      std::fprintf(stderr,
                   "bmudump: %s: %llu frame%s that could be of %s left unknown, as nothing but identifiers says so; if "
                   "this is its bus: --device %s\n",
                   bus->name.c_str(), static_cast<unsigned long long>(count), count == 1 ? "" : "s",
                   std::string(device->name).c_str(), words_on(bus->name, *device, options_->catalogue).c_str());
    }
  }
}

void Dump::forget_counters(std::string_view bus) {
  if (Bus* const known = buses_.find(bus)) known->check.forget_counters();
}

int Dump::finish(int code) {
  for (const std::unique_ptr<Bus>& bus : buses_.buses()) heard_until(bus->statistics.until_us);
  const Summary summary(options_->bit_rate, heard_until_us_, clock_.count(), out_);
  if (options_->output == Output::summary) summary.print_text(buses_.buses());
  if (options_->output == Output::summary_json) summary.print_json(buses_.buses());
  if (follow_) follow_->print_last(options_->is_coloured, out_);
  out_.flush();
  if (out_.is_closed() && out_.error() != EPIPE) {
    std::fprintf(stderr, "bmudump: cannot write: %s\n", std::strerror(out_.error()));
    return exit_system;
  }
  tell_hints();
  tell_doubts();
  const bool is_suspect = options_->is_strict && suspect_count(buses_.buses()) > 0;
  return worse(code, is_suspect ? exit_suspect : exit_ok);
}

void catch_stop_signals() {
  struct sigaction action {};
  action.sa_handler = [](int) { stop_requested = 1; };  // no SA_RESTART: a waiting read or poll returns
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
  action.sa_handler = SIG_IGN;  // a closed output is an answer of write(), not a death
  ::sigaction(SIGPIPE, &action, nullptr);
}

void request_stop() {
  stop_requested = 1;
}

bool is_stop_requested() {
  return stop_requested != 0;
}

}  // namespace bmu::dump
