#include "tools/bmureplay/decision_changes.hpp"

#include <algorithm>
#include <utility>

namespace bmu::replay {

namespace {

constexpr std::string_view frame_mark = "# > ";
constexpr std::string_view outputs_mark = "# =";
constexpr std::string_view event_mark = "# ! ";

bool has_line(const std::vector<std::string>& lines, const std::string& line) {
  return std::find(lines.begin(), lines.end(), line) != lines.end();
}

/// "" for a line that is neither.
std::string words_of(const std::string& line) {
  if (line.starts_with(event_mark)) return line.substr(event_mark.size());
  if (!line.starts_with(outputs_mark)) return "";
  const std::string which = line.substr(outputs_mark.size());
  return "contactors:" + (which.empty() ? std::string(" all open") : which);
}

struct SentFrame {
  std::string key;   // "can0 620"
  std::string data;  // behind the #
};

std::vector<SentFrame> frames_of(const std::vector<std::string>& lines) {
  std::vector<SentFrame> frames;
  for (const std::string& line : lines) {
    const std::size_t mark = line.find('#', frame_mark.size());
    if (!line.starts_with(frame_mark) || mark == std::string::npos) continue;
    frames.push_back({line.substr(frame_mark.size(), mark - frame_mark.size()), line.substr(mark + 1)});
  }
  return frames;
}

/// The first frame of that kind is taken out.
std::string take_data(std::vector<SentFrame>& frames, const std::string& key) {
  const auto found =
      std::find_if(frames.begin(), frames.end(), [&](const SentFrame& frame) { return frame.key == key; });
  if (found == frames.end()) return "";
  std::string data = std::move(found->data);
  frames.erase(found);
  return data;
}

}  // namespace

void DecisionChanges::add(Change change) {
  if (changes_.size() < changes_max) {
    changes_.push_back(std::move(change));
  } else {
    ++left_out_;
  }
}

void DecisionChanges::take(const ReplayDifference& difference) {
  const std::pair<const std::vector<std::string>&, const std::vector<std::string>&> sides[] = {
      {difference.recorded, difference.replayed}, {difference.replayed, difference.recorded}};
  for (const auto& [lines, others] : sides) {
    for (const std::string& line : lines) {
      std::string words = words_of(line);
      if (words.empty() || has_line(others, line)) continue;
      add({.log_us = difference.log_us, .is_recorded = &lines == &difference.recorded, .text = std::move(words)});
    }
  }
  compare_frames(difference);
}

void DecisionChanges::compare_frames(const ReplayDifference& difference) {
  const std::vector<SentFrame> recorded = frames_of(difference.recorded);
  std::vector<SentFrame> replayed = frames_of(difference.replayed);
  const auto note = [&](const std::string& key, const std::string& then, const std::string& now) {
    if (then == now) return;
    FrameChanges& changes = frames_[key];
    if (changes.count == 0) {
      changes = {.first_log_us = difference.log_us, .recorded = then, .replayed = now};
    }
    ++changes.count;
    changes.last_log_us = difference.log_us;
  };
  for (const SentFrame& frame : recorded) note(frame.key, frame.data, take_data(replayed, frame.key));
  for (const SentFrame& frame : replayed) note(frame.key, "", frame.data);
}

void DecisionChanges::append(const DecisionChanges& later) {
  for (const Change& change : later.changes_) add(change);
  left_out_ += later.left_out_;
  for (const auto& [key, changes] : later.frames_) {
    FrameChanges& all = frames_[key];
    const std::uint64_t before = all.count;
    const std::int64_t last = changes.last_log_us;
    if (before == 0) all = changes;
    all.count = before + changes.count;
    all.last_log_us = last;
  }
}

}  // namespace bmu::replay
