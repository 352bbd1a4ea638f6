#include "tools/bmudump/summary.hpp"

#include <algorithm>
#include <string>

#include "tools/bmudump/words.hpp"

namespace bmu::dump {
namespace {

constexpr std::size_t message_width = 26;  // CONTACTOR_COMMAND, CELLS_1 node 12

std::string hex(std::uint32_t id, int digits) {
  return formatted("%0*X", digits, static_cast<unsigned>(id));
}

double share_percent(std::int64_t part, std::int64_t whole) {
  return whole > 0 ? 100.0 * static_cast<double>(part) / static_cast<double>(whole) : 0.0;
}

/// Calls `print(id, row)` for each identifier seen, 11-bit ones first, in order.
template <class Print>
void for_each_id(const BusStatistics& bus, const Print& print) {
  for (std::size_t id = 0; bus.has_standard() && id < Catalogue::id_count; ++id) {
    if (bus.standard(id).frames > 0) print(hex(static_cast<std::uint32_t>(id), 3), bus.standard(id));
  }
  for (const std::uint32_t id : bus.extended_ids()) print(hex(id, 8), bus.extended(id));
}

/// A length alone may be from a car: the detection counts only if messages of a pack were received.
bool tells_dialect(const Bus& bus) {
  return bus.evidence.has_vehicle() && !bus.dialect.sign().empty();
}

bool has_counts(const BusStatistics& bus) {
  return bus.frames > 0 || bus.lost > 0;
}

struct Count {
  std::string_view name;  // in JSON, and with spaces in text
  std::uint64_t BusStatistics::*number;
};
constexpr Count counts[] = {
    {"ok", &BusStatistics::accepted},        {"failed", &BusStatistics::failed},
    {"unknown", &BusStatistics::unknown},    {"remote", &BusStatistics::remote},
    {"error_frames", &BusStatistics::error}, {"not_classic_can", &BusStatistics::fd},
};

}  // namespace

void Summary::print_text(std::span<const std::unique_ptr<Bus>> buses) const {
  bool is_empty = true;
  for (const std::unique_ptr<Bus>& bus : buses) {
    if (!has_counts(bus->statistics)) continue;
    print_bus(*bus);
    is_empty = false;
  }
  out_->begin_line();
  if (is_empty) out_->text("no frames\n");
}

void Summary::print_bus(const Bus& bus) const {
  const BusStatistics& all = bus.statistics;
  out_->begin_line();
  out_->text(bus.name + ": " + std::to_string(all.frames) + " frames, ");
  print_load(all);
  out_->text("\n ");
  std::string_view separator = " ";
  for (const Count& count : counts) {
    std::string name(count.name);
    std::replace(name.begin(), name.end(), '_', ' ');
    if (name == "not classic can") name = "not classic CAN";
    out_->text(std::string(separator) + name + " " + std::to_string(all.*count.number));
    separator = ", ";
  }
  if (all.lost > 0) out_->text(", lost " + std::to_string(all.lost));
  if (clock_jumps_ > 0) out_->text(", clock jumps " + std::to_string(clock_jumps_));
  if (tells_dialect(bus)) {
    const Dialect* const spoken = bus.dialect.spoken();
    out_->text("\n  vehicle messages: " + bus.dialect.sign() +
               (spoken == nullptr ? ", the name of no dialect" : ", dialect " + std::string(spoken->name)));
  }
  out_->text(formatted("\n  %-8s  %-*s %10s %9s %11s  %-31s %8s\n", "id", static_cast<int>(message_width), "message",
                       "frames", "failed", "rate", "longest gap (end time)", "load"));
  for_each_id(all, [&](const std::string& id, const IdStatistics& row) { print_row(id, row, all); });
  if (all.without_row == 0) return;
  out_->begin_line();
  out_->text("  more 29-bit identifiers, " + std::to_string(all.without_row) + " frames\n");
}

void Summary::print_load(const BusStatistics& bus) const {
  out_->text(formatted("%.6f s", bus.span_s()));
  if (bus.span_s() <= 0) return;
  const double load = bus.load_bit_per_s();
  out_->text(formatted(", load at least %.1f kbit/s (%.1f %% of %.0f kbit/s)", load * 1e-3,
                       100.0 * load / static_cast<double>(bit_rate_), static_cast<double>(bit_rate_) * 1e-3));
}

void Summary::print_row(std::string_view id, const IdStatistics& row, const BusStatistics& bus) const {
  out_->begin_line();
  out_->text(formatted("  %-8.*s  %-*s %10llu %9llu ", static_cast<int>(id.size()), id.data(),
                       static_cast<int>(message_width), name_text(row.message, row.node).c_str(),
                       static_cast<unsigned long long>(row.frames),
                       static_cast<unsigned long long>(row.failed_total())));
  out_->text(row.rate_per_s() > 0 ? formatted("%9.2f/s  ", row.rate_per_s()) : formatted("%11s  ", "-"));
  out_->text(row.gap_max_us > 0 ? formatted("%10.6f s %18.6f ", static_cast<double>(row.gap_max_us) * 1e-6,
                                            static_cast<double>(row.gap_end_us) * 1e-6)
                                : formatted("%-31s ", "         -"));
  const std::string remarks = remarks_on(row);
  out_->text(formatted("%6.1f %%", share_percent(row.bits, bus.bits)) + (remarks.empty() ? "" : "  ") + remarks + "\n");
}

/// "wrong crc 2, silent for 3.200000 s"
std::string Summary::remarks_on(const IdStatistics& row) const {
  std::string remarks = failures_text(row);
  const std::int64_t silence_us = row.silence_us(until_us_);
  if (silence_us == 0) return remarks;
  const char* const what = row.last_us > row.refresh_us ? "no frame passed the filter" : "silent";
  return remarks + (remarks.empty() ? "" : ", ") +
         formatted("%s for %.6f s", what, static_cast<double>(silence_us) * 1e-6);
}

void Summary::print_json(std::span<const std::unique_ptr<Bus>> buses) const {
  for (const std::unique_ptr<Bus>& bus : buses) {
    if (has_counts(bus->statistics)) print_bus_json(*bus);
  }
}

void Summary::print_bus_json(const Bus& bus) const {
  const BusStatistics& all = bus.statistics;
  out_->begin_line();
  out_->text("{\"bus\":");
  out_->json_string(bus.name);
  out_->text(",\"frames\":" + std::to_string(all.frames) + ",\"first_s\":");
  out_->time(all.first_us);
  out_->text(",\"last_s\":");
  out_->time(all.last_us);
  out_->text(",\"span_s\":");
  out_->time(all.until_us - all.from_us);
  out_->text(",\"clock_jumps\":" + std::to_string(clock_jumps_));
  out_->text(formatted(",\"load_bit_per_s\":%.0f,\"load_percent\":%.2f", all.load_bit_per_s(),
                       100.0 * all.load_bit_per_s() / static_cast<double>(bit_rate_)));
  for (const Count& count : counts) {
    out_->text(",\"" + std::string(count.name) + "\":" + std::to_string(all.*count.number));
  }
  out_->text(",\"lost\":" + std::to_string(all.lost));
  const Dialect* const spoken = tells_dialect(bus) ? bus.dialect.spoken() : nullptr;
  out_->text(",\"dialect\":" + (spoken == nullptr ? "null" : "\"" + std::string(spoken->name) + "\"") + ",\"ids\":[");
  bool is_first = true;
  for_each_id(all, [&](const std::string& id, const IdStatistics& row) {
    out_->begin_line();
    if (!is_first) out_->letter(',');
    is_first = false;
    print_row_json(id, row);
  });
  out_->text("]}\n");
}

void Summary::print_row_json(std::string_view id, const IdStatistics& row) const {
  out_->text("{\"id\":\"" + std::string(id) + "\",\"message\":");
  if (row.message == nullptr) {
    out_->text("null,\"node\":null");
  } else {
    out_->text("\"" + std::string(row.message->name) +
               "\",\"node\":" + (row.message->has_node() ? std::to_string(row.node) : "null"));
  }
  out_->text(",\"frames\":" + std::to_string(row.frames) + ",\"ok\":" + std::to_string(row.accepted));
  out_->text(formatted(",\"rate_per_s\":%.3f,\"gap_max_s\":%.6f,\"gap_end_s\":", row.rate_per_s(),
                       static_cast<double>(row.gap_max_us) * 1e-6));
  if (row.gap_max_us > 0) {
    out_->time(row.gap_end_us);
  } else {
    out_->text("null");
  }
  out_->text(",\"silent_s\":");
  if (const std::int64_t silence_us = row.silence_us(until_us_); silence_us > 0) {
    out_->time(silence_us);
  } else {
    out_->text("null");
  }
  out_->text(",\"bits\":" + std::to_string(row.bits) + ",\"failed\":{");
  std::string_view separator;
  for (std::size_t reason = 0; reason < row.failed.size(); ++reason) {
    if (row.failed[reason] == 0) continue;
    out_->text(std::string(separator) + "\"" + std::string(to_text(static_cast<RejectReason>(reason))) +
               "\":" + std::to_string(row.failed[reason]));
    separator = ",";
  }
  out_->text("}}");
}

std::uint64_t suspect_count(std::span<const std::unique_ptr<Bus>> buses) {
  std::uint64_t suspect = 0;
  for (const std::unique_ptr<Bus>& bus : buses) suspect += bus->statistics.unknown + bus->statistics.failed;
  return suspect;
}

}  // namespace bmu::dump
