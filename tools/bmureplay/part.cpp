#include "tools/bmureplay/part.hpp"

#include <cerrno>
#include <cstring>
#include <utility>
#include <variant>

#include <fcntl.h>
#include <unistd.h>

#include "daemon/recording/record_line.hpp"
#include "tools/common/byte_order_mark.hpp"

namespace bmu::replay {

namespace {

constexpr std::string_view part_begins = "# bmud-recording ";

bool is_note(std::string_view line) {
  if (line.starts_with('(')) return false;
  const auto parsed = parse_record_line(line, {}, {});
  return parsed && (std::holds_alternative<RecordNote>(*parsed) || std::holds_alternative<RecordNothing>(*parsed));
}

}  // namespace

bool PartReader::open_next() {
  while (!files_.empty()) {
    name_ = std::move(files_.front());
    files_.pop_front();
    fd_ = OwnedFd(name_ == "-" ? ::dup(STDIN_FILENO) : ::open(name_.c_str(), O_RDONLY | O_CLOEXEC));
    if (fd_.is_open()) {
      reader_ = std::make_unique<LineReader>(fd_.get());
      growing_ = {.file = name_};
      return true;
    }
    tell({.file = name_, .text = std::strerror(errno)});
    has_failed_ = true;
  }
  return false;
}

void PartReader::tell(Damage damage) {
  if (damages_.size() < damages_max) damages_.push_back(std::move(damage));
}

void PartReader::end_hole() {
  if (!std::exchange(is_in_hole_, false) || damages_.empty()) return;
  damages_.back().goes_on_line = reader_->line_number();
}

/// Reads up to the head of the next part. False: no complete part yet, more has to be read.
bool PartReader::take_lines() {
  LineReader::Line line;
  while (reader_->take(line)) {
    line.text = without_byte_order_mark(line.text);  // also within a file that was concatenated from several
    if (line.is_too_long) {
      tell({.file = name_, .line = reader_->line_number(), .text = "the line is too long for a recording"});
      continue;
    }
    if (!line.has_end) {  // the truncated line could pass for another decision
      tell({.file = name_,
            .line = reader_->line_number(),
            .text = "the last line has no end: the file was cut off there"});
      growing_.ends_torn = true;
      continue;
    }
    const bool begins = line.text.starts_with(part_begins);
    if (is_in_hole_ && !begins) continue;
    end_hole();
    const bool begins_next = begins && (std::exchange(is_in_part_, true) || growing_.ends_torn);
    if (begins_next && !growing_.text.empty()) {
      whole_ = std::exchange(growing_, Part{.file = name_, .first_line = reader_->line_number()});
    }
    if (growing_.text.size() + line.text.size() >= bytes_max_) {
      tell({.file = name_,
            .line = reader_->line_number(),
            .text = "the part is longer than any of a recording, which has at most " + std::to_string(bytes_max_) +
                    " bytes; what follows up to the next one is left out"});
      is_in_hole_ = growing_.ends_torn = true;
      if (whole_) return true;
      continue;
    }
    is_in_part_ = is_in_part_ || !is_note(line.text);
    if (growing_.text.empty()) growing_.first_line = reader_->line_number();
    growing_.text.append(line.text).push_back('\n');
    if (whole_) return true;
  }
  return false;
}

void PartReader::end_file() {
  reader_ = nullptr;
  is_in_hole_ = is_in_part_ = false;
  fd_ = OwnedFd();
  if (!growing_.text.empty()) whole_ = std::move(growing_);
  growing_ = {};
}

std::optional<Part> PartReader::next() {
  whole_.reset();
  while (!whole_) {
    if (reader_ == nullptr && !open_next()) return std::nullopt;
    if (take_lines()) break;
    switch (reader_->fill()) {
      case LineReader::Filled::more:
      case LineReader::Filled::interrupted: break;
      case LineReader::Filled::damaged:
        tell({.file = name_,
              .text = "bytes " + std::to_string(reader_->damage().begin) + " to " +
                      std::to_string(reader_->damage().end) + ": " + reader_->damage().what});
        is_in_hole_ = true;
        growing_.ends_torn = !growing_.text.empty();
        break;
      case LineReader::Filled::error:
        tell({.file = name_, .text = std::strerror(errno)});
        has_failed_ = growing_.ends_torn = true;
        end_file();
        break;
      case LineReader::Filled::end:
        if (!take_lines()) end_file();
        break;
    }
  }
  return std::exchange(whole_, std::nullopt);
}

}  // namespace bmu::replay
