#include "daemon/recording/record_reader.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <utility>

#include "config/checks/bus_rate.hpp"
#include "config/fields/pack_fields.hpp"
#include "daemon/core/core_image.hpp"
#include "daemon/recording/image_lines.hpp"
#include "daemon/recording/record_writer.hpp"
#include "protocol/number_text.hpp"

namespace bmu {

namespace {

/// Limit for a damaged or hostile file; those of bmud are a tenth of it.
constexpr std::size_t image_size_max = std::size_t{32} << 20;

/// "| the end of a line", or "+ a part" that the next line continues.
bool append_line(std::string& text, std::string_view rest) {
  if (rest.empty() || (rest[0] != '|' && rest[0] != '+')) return false;
  if (rest.size() > 2) text += rest.substr(2);
  if (rest[0] == '|') text += '\n';
  return true;
}

/// The text up to the first space, and the text after it.
std::pair<std::string_view, std::string_view> two_words(std::string_view text) {
  const std::size_t space = std::min(text.find(' '), text.size());
  return {text.substr(0, space), text.substr(std::min(space + 1, text.size()))};
}

std::string hash_text(const PackConfig& pack) {
  std::array<char, 17> text{};
  std::snprintf(text.data(), text.size(), "%016llx", static_cast<unsigned long long>(pack.core.hash));
  return text.data();
}

/// Hash of the files as they were before their line ends were changed; "": they are not a configuration.
std::string hash_without_cr(PackSources sources) {
  std::erase(sources.pack_text, '\r');
  std::erase(sources.cell_text, '\r');
  const auto pack = parse_pack_config(sources);
  return pack ? hash_text(*pack) : "";
}

}  // namespace

RecordReader::Took RecordReader::fail(std::string text, RecordProblemKind kind) {
  problem_ = RecordProblem{.kind = kind, .line = lines_, .text = std::move(text)};
  place_ = Place::after_problem;
  return Took::problem;
}

RecordReader::Took RecordReader::fail_without_head() {
  return fail("header incomplete, expected '# bmud-recording' to '# core-end'",
              place_ == Place::before ? RecordProblemKind::no_recording : RecordProblemKind::damaged);
}

RecordReader::Took RecordReader::take(std::string_view line) {
  ++lines_;
  const auto parsed = parse_record_line(line, clock_, head_.buses);
  if (!parsed) {
    if (place_ == Place::before) return fail_without_head();
    return fail("column " + std::to_string(parsed.error().column + 1) + ": expected " + parsed.error().wanted);
  }
  const Took took = take_parsed(*parsed);
  add_to_sum(*parsed, line);
  return took;
}

RecordReader::Took RecordReader::take_parsed(const RecordLine& parsed) {
  if (std::holds_alternative<RecordNothing>(parsed)) return Took::nothing;
  if (const auto* const note = std::get_if<RecordNote>(&parsed)) return take_note(*note);
  if (place_ != Place::in_part) return fail_without_head();
  if (const auto* const tick = std::get_if<RecordTick>(&parsed)) return take_tick(*tick);
  if (const auto* const observation = std::get_if<Observation>(&parsed)) {
    observation_ = *observation;
    has_tick_ = false;
    return take_time(observation->at, Took::observation);
  }
  if (!has_tick_) return fail("found a decision line without a preceding tick");
  line_ = parsed;
  return Took::of_tick;
}

RecordReader::Took RecordReader::take_tick(const RecordTick& tick) {
  alteration_.reset();
  if (tick.lines_sum != sum_.value()) {
    alteration_ = RecordProblem{.line = sum_from_line_,
                                .text = "the lines from here to line " + std::to_string(lines_) +
                                        " were modified: a line is missing, changed or added"};
  }
  tick_ = tick;
  has_tick_ = true;
  return take_time(tick.at, Took::tick);
}

/// Adds all lines with a meaning; those of an image have a checksum of their own.
void RecordReader::add_to_sum(const RecordLine& parsed, std::string_view line) {
  const auto* const note = std::get_if<RecordNote>(&parsed);
  if (place_ == Place::in_head) {
    const bool is_head_s = note != nullptr && note->word != "image" && note->word != "zeros";
    if (is_head_s) head_.sum.add(line);
    return;
  }
  if (place_ != Place::in_part || std::holds_alternative<RecordNothing>(parsed)) return;
  if (std::holds_alternative<RecordTick>(parsed)) {
    sum_ = {};
    sum_from_line_ = lines_;
  }
  if (note == nullptr || note->word == "ahead_us") sum_.add(line);
}

RecordReader::Took RecordReader::take_time(TimePoint at, Took took) {
  const bool is_possible = at >= latest_ && at <= TimePoint{std::chrono::microseconds{record_time_max_us}};
  if (!is_possible) return fail("found a time before that of the previous line");
  latest_ = at;
  if (part_from_log_us_ == 0) {
    part_from_log_us_ = clock_.to_log_us(at);
    part_from_ = at;
  }
  return took;
}

RecordReader::Took RecordReader::take_note(const RecordNote& note) {
  has_tick_ = false;
  if (note.word == "bmud-recording") {
    if (number_of_text<int>(note.rest) != record_format) {
      return fail(
          "found a recording of format '" + std::string(note.rest) + "', expected " + std::to_string(record_format),
          RecordProblemKind::other_version);
    }
    before_ = place_ == Place::in_part ? head_.id : RecordPartId{};
    head_ = {};
    part_from_log_us_ = 0;
    part_from_ = {};
    place_ = Place::in_head;
    return Took::nothing;
  }
  if (note.word == "ahead_us") {
    const auto ahead_us = number_of_text<std::int64_t>(note.rest);
    if (!ahead_us || *ahead_us > record_time_max_us || *ahead_us < -record_time_max_us) {
      return fail("expected the offset of the clocks in microseconds");
    }
    clock_.ahead_us = *ahead_us;
    return Took::nothing;
  }
  // Outside a head it is an addition of a later version, or of a user.
  return place_ == Place::in_head ? take_head(note.word, note.rest) : Took::nothing;
}

RecordReader::Took RecordReader::take_head(std::string_view word, std::string_view rest) {
  if (word == "version") {
    head_.version = rest;
  } else if (word == "bus") {
    const auto [which, name] = two_words(rest);
    if (name.empty()) return fail("expected a bus and its name");
    // A bus that only a later version has is ignored.
    const std::optional<Port> port = port_of_text(which);
    if (!port) return Took::nothing;
    if (!is_bus_name(name)) return fail("expected " + std::string(bus_form));
    head_.buses.set_name(*port, name);
  } else if (word == "part") {
    const auto [life_text, part_text] = two_words(rest);
    const auto life = number_of_text<std::int64_t>(life_text);
    const auto part = number_of_text<std::uint64_t>(part_text);
    if (!life || !part) return fail("expected a session id and a part number");
    head_.id = {.life = *life, .part = *part};
  } else if (word == "configuration") {
    head_.origin.hash = rest;
  } else if (word == "internal_kbit_per_s") {
    const auto rate = number_of_text<std::int32_t>(rest);
    if (!rate || *rate < 1) return fail("expected a bitrate in kbit/s");
    head_.origin.internal_kbit_per_s = *rate;
  } else if (word == "pack-file") {
    head_.origin.sources.pack_name = rest;
  } else if (word == "cell-file") {
    head_.origin.sources.cell_name = rest;
  } else if (word == "pack" || word == "cell") {
    PackSources& sources = head_.origin.sources;
    if (!append_line(word == "pack" ? sources.pack_text : sources.cell_text, rest)) {
      return fail("expected a line of a file after '|' or '+'");
    }
  } else {
    return take_state(word, rest);
  }
  return Took::nothing;
}

RecordReader::Took RecordReader::take_state(std::string_view word, std::string_view rest) {
  const auto at_most = [&] { return " at most " + std::to_string(head_.image_size) + " bytes"; };
  if (word == "core") {
    const auto [layout_text, size_text] = two_words(rest);
    const auto layout = number_of_text<std::uint64_t>(layout_text, 16);
    const auto size = number_of_text<std::size_t>(size_text);
    if (!layout || !size || *size > image_size_max) return fail("expected layout and size of a core");
    head_.layout = *layout;
    head_.image_size = *size;
  } else if (word == "image") {
    if (!append_image_bytes(rest, head_.image_size, head_.image)) return fail("expected base64 of" + at_most());
  } else if (word == "zeros") {
    if (!append_image_zeros(rest, head_.image_size, head_.image))
      return fail("expected a number of zeros, and" + at_most());
  } else if (word == "core-end") {
    return end_head(rest);
  }
  return Took::nothing;
}

bool RecordReader::read_pack() {
  if (pack_ && head_.origin == origin_of_pack_) return true;
  auto pack = parse_pack_config(head_.origin.sources);
  if (!pack) {
    static_cast<void>(fail("the recorded configuration: " + to_text(pack.error().front())));
    return false;
  }
  const std::string hash = hash_text(*pack);
  if (head_.origin.hash != hash) {
    static_cast<void>(
        fail(hash_without_cr(head_.origin.sources) == head_.origin.hash
                 ? "found lines that end in CR LF, expected LF as written; remove the CRs with tr -d '\\r'"
                 : "found configuration " + hash + ", expected " + head_.origin.hash + " of the header"));
    return false;
  }
  origin_of_pack_ = head_.origin;
  const std::int64_t bit_per_s = std::int64_t{head_.origin.internal_kbit_per_s} * 1000;
  // As at the time of the recording, whichever names the file gives its buses.
  pack->core.served_by = served_by(head_.buses);
  pack_ = bit_per_s == 0 ? std::move(*pack) : at_rate(*pack, bit_per_s);
  return true;
}

RecordReader::Took RecordReader::end_head(std::string_view checksums) {
  if (!read_pack()) return Took::problem;
  const auto [image_text, head_text] = two_words(checksums);
  checksum_ = image_checksum(head_.image);
  if (head_.image.size() != head_.image_size || number_of_text<std::uint64_t>(image_text, 16) != checksum_) {
    return fail("the state of the core is damaged");
  }
  if (number_of_text<std::uint32_t>(head_text, 16) != head_.sum.value()) {
    return fail("the header was modified: a line is missing, changed or added");
  }
  place_ = Place::in_part;
  sum_ = {};
  sum_from_line_ = lines_ + 1;
  latest_ = TimePoint{};
  return Took::part;
}

Result<std::unique_ptr<Core>, RecordProblem> RecordReader::make_core(const CoreConfig& config) {
  if (head_.layout != core_image_layout()) {
    return failure(RecordProblem{
        .kind = RecordProblemKind::other_version,
        .line = lines_,
        .text = "it was written by version " + head_.version + ", whose core has other members than this one's"});
  }
  auto core = std::make_unique<Core>(config, TimePoint{});
  if (const auto problem = read_core_image(head_.image, *core)) {
    return failure(RecordProblem{.line = lines_, .text = "the state of the core: " + std::string(to_text(*problem))});
  }
  latest_ = core->decided_at();
  return core;
}

}  // namespace bmu
