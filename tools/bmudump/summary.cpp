#include "tools/bmudump/summary.hpp"

#include <algorithm>
#include <cstdio>
#include <numeric>

#include "protocol/can_bits.hpp"

namespace bmu::dump {
namespace {

std::uint64_t total(const std::array<std::uint64_t, reject_reason_count>& counts) {
  return std::accumulate(counts.begin(), counts.end(), std::uint64_t{0});
}

/// "1 to 4, 7" of the bits set.
std::string ranges_of(const std::bitset<64>& nodes) {
  std::string text;
  for (std::size_t first = 0; first < nodes.size(); ++first) {
    if (!nodes[first]) continue;
    std::size_t last = first;
    while (last + 1 < nodes.size() && nodes[last + 1]) ++last;
    text += (text.empty() ? "" : ", ") + std::to_string(first);
    if (last > first) text += (last == first + 1 ? ", " : " to ") + std::to_string(last);
    first = last;
  }
  return text;
}

std::string padded(const std::string& text, std::size_t width, bool is_right) {
  const std::string space(width - std::min(width, text.size()), ' ');
  return is_right ? space + text : text + space;
}

std::string fixed(double value, int decimals) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%.*f", decimals, value);
  return text.data();
}

}  // namespace

Summary::BusCounts& Summary::counts_of(const Bus& bus) {
  while (buses_.size() <= bus.index) {
    buses_.emplace_back();
    buses_.back().messages.resize(catalogue_->all().messages().size());
  }
  return buses_[bus.index];
}

void Summary::count(const Bus& bus, const SeenFrame& seen) {
  BusCounts& counts = counts_of(bus);
  const std::int64_t time_us = seen.line.time_us;
  if (counts.frames == 0) {
    counts.name = bus.name;
    counts.first_us = counts.last_us = time_us;
  } else if (seen.line.kind == LogLineKind::frame) {
    counts.bits += bits_on_wire(seen.line.frame);
  }
  counts.first_us = std::min(counts.first_us, time_us);
  counts.last_us = std::max(counts.last_us, time_us);
  ++counts.frames;
  if (seen.verdict.message == nullptr) return count_unjudged(counts, seen);
  MessageCounts& message = counts.messages[catalogue_->row_of(seen.line.frame.id)];
  message.nodes.set(seen.verdict.node);
  ++(seen.verdict.is_accepted ? message.accepted : message.failed[static_cast<std::size_t>(seen.verdict.reason)]);
}

void Summary::count_unjudged(BusCounts& counts, const SeenFrame& seen) {
  const CanFrame& frame = seen.line.frame;
  if (seen.line.kind == LogLineKind::fd_frame) {
    ++counts.fd;
  } else if (frame.is_error) {
    ++counts.error;
  } else if (frame.is_remote) {
    ++counts.remote;
  } else {
    ++counts.unknown;
    if (!frame.is_extended) ++counts.unknown_ids[frame.id];
  }
}

std::uint64_t Summary::suspect_count() const {
  std::uint64_t suspect = 0;
  for (const BusCounts& bus : buses_) {
    suspect += bus.unknown;
    for (const MessageCounts& message : bus.messages) suspect += total(message.failed);
  }
  return suspect;
}

std::string Summary::text() const {
  std::string text;
  for (const BusCounts& bus : buses_) {
    if (bus.frames > 0) text += bus_text(bus);
  }
  return text.empty() ? "no frames\n" : text;
}

std::string Summary::bus_text(const BusCounts& bus) const {
  std::uint64_t accepted = 0;
  std::uint64_t failed = 0;
  std::string lines;
  for (std::size_t row = 0; row < bus.messages.size(); ++row) {
    const MessageCounts& counts = bus.messages[row];
    accepted += counts.accepted;
    failed += total(counts.failed);
    if (counts.nodes.any()) lines += message_line(*catalogue_->all().messages()[row], counts);
  }
  std::string text = bus.name + ": " + std::to_string(bus.frames) + " frames, " + load_text(bus) + "\n";
  text += "  ok " + std::to_string(accepted) + ", failed " + std::to_string(failed) + ", unknown " +
          std::to_string(bus.unknown) + ", remote " + std::to_string(bus.remote) + ", error frames " +
          std::to_string(bus.error) + ", not classic CAN " + std::to_string(bus.fd) + "\n";
  text += "  " + padded("message", 19, false) + padded("ok", 10, true) + padded("failed", 9, true) + "\n" + lines;
  for (std::size_t id = 0; id < bus.unknown_ids.size(); ++id) {
    if (bus.unknown_ids[id] == 0) continue;
    std::array<char, 32> name{};
    std::snprintf(name.data(), name.size(), "unknown %03zX", id);
    text += "  " + padded(name.data(), 19, false) + padded(std::to_string(bus.unknown_ids[id]), 10, true) + "\n";
  }
  return text;
}

std::string Summary::message_line(const MessageSpec& message, const MessageCounts& counts) const {
  std::string line = "  " + padded(std::string(message.name), 19, false) +
                     padded(std::to_string(counts.accepted), 10, true) +
                     padded(std::to_string(total(counts.failed)), 9, true);
  if (message.has_node()) line += "  node " + ranges_of(counts.nodes);
  std::string separator = "  failed: ";
  for (std::size_t reason = 0; reason < counts.failed.size(); ++reason) {
    if (counts.failed[reason] == 0) continue;
    line += separator + std::string(to_text(static_cast<RejectReason>(reason))) + " " +
            std::to_string(counts.failed[reason]);
    separator = ", ";
  }
  return line + "\n";
}

std::string Summary::load_text(const BusCounts& bus) const {
  const double span_s = static_cast<double>(bus.last_us - bus.first_us) * 1e-6;
  std::string text = fixed(span_s, 6) + " s";
  if (span_s <= 0) return text;
  const double bits_per_s = static_cast<double>(bus.bits) / span_s;
  return text + ", load at least " + fixed(bits_per_s * 1e-3, 1) + " kbit/s (" +
         fixed(100.0 * bits_per_s / static_cast<double>(bit_rate_), 1) + " % of " +
         fixed(static_cast<double>(bit_rate_) * 1e-3, 0) + " kbit/s)";
}

}  // namespace bmu::dump
