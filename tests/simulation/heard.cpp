#include "tests/simulation/heard.hpp"

#include <algorithm>

#include "protocol/receive_check.hpp"
#include "protocol/tables/internal_bus.hpp"

namespace bmu::test {

namespace {

using namespace internal_bus;

bool is_sound(const CanFrame& frame) {
  if (form_fault(frame)) return false;
  const MessageMatch match = catalogue.find(frame.id);
  return match.message != nullptr && !content_fault(*match.message, frame);
}

/// Whether the current sensor flags this result, or itself, as wrong.
bool is_flagged(const CanFrame& frame) {
  constexpr std::uint8_t flags = 0xA0;
  const MessageMatch match = catalogue.find(frame.id);
  return match.message->sender == Sender::sensor && (frame.data[1] & flags) != 0;
}

}  // namespace

Heard::Heard(const CoreConfig& config) {
  // An answer counts until the next POLL. A frame that is sent without a POLL cannot be recognised as late, nor can a
  // temperature: it counts from its reception, and the next POLL may come much later.
  const Duration before_next_poll = config.poll.period + 10ms;
  constexpr Duration unasked = 500ms;
  // A missing sensor is confirmed only after its confirm time.
  const Duration temperature_age = config.ages.temperature + config.limits.confirm.temperature_not_measured;
  source_of_.fill(nobody);
  for (const ModuleConfig& one : config.modules) {
    add(status.base_id + one.node, Kind::module_status, config.ages.module_status, before_next_poll);
    for (std::size_t block = 0; block * cells_per_frame < one.cell_count; ++block) {
      add(cells_rows[block]->base_id + one.node, Kind::cells, config.ages.cell_voltage, before_next_poll);
    }
    add(temp_1.base_id + one.node, Kind::temperatures, temperature_age, unasked);
    const bool has_cell_in_temp_2 = one.temperature_sensor_count > cells_per_frame;
    add(temp_2.base_id + one.node, has_cell_in_temp_2 ? Kind::temperatures : Kind::board_temperatures, temperature_age,
        unasked);
    add(internal_bus::module.base_id + one.node, Kind::module_voltage, config.ages.cell_voltage, before_next_poll);
  }
  add(sensor_current.base_id, Kind::current, config.ages.pack_current, unasked);
  add(sensor_u1.base_id, Kind::pack_voltage, config.ages.pack_voltage, unasked);
  add(sensor_u2.base_id, Kind::link_voltage, config.ages.pack_voltage, unasked);
  add(pdu_status.base_id, Kind::pdu, config.ages.pdu_status, unasked);
}

void Heard::add(std::uint32_t id, Kind kind, Duration age, Duration on_the_way) {
  source_of_[id] = static_cast<std::uint16_t>(sources_.size());
  sources_.push_back({.id = id, .kind = kind, .age = age, .on_the_way = on_the_way});
}

void Heard::note_sent(const CanFrame& frame, TimePoint now) {
  if (frame.id >= id_count || source_of_[frame.id] == nobody) return;
  Source& source = sources_[source_of_[frame.id]];
  source.sent[source.next] = {frame.data, now};
  source.next = (source.next + 1) % remembered;
}

void Heard::note_told(const CanFrame& frame, TimePoint now) {
  if (frame.is_extended || frame.id >= id_count || source_of_[frame.id] == nobody || !is_sound(frame)) return;
  Source& source = sources_[source_of_[frame.id]];
  std::optional<TimePoint> made_at;
  for (const Sent& sent : source.sent) {
    if (sent.data == frame.data && sent.at > made_at.value_or(TimePoint{})) made_at = sent.at;
  }
  if (!made_at) ++forged_;
  if (!made_at || is_flagged(frame)) return;
  source.told_at = now;
  source.made_at = std::max(source.made_at, *made_at);
}

bool Heard::is_stale(const Source& source, TimePoint now, Duration more) {
  const Duration most = source.age + more;
  const bool never_came = source.told_at == TimePoint{};
  return never_came || now - source.told_at > most || now - source.made_at > most + source.on_the_way;
}

std::string Heard::stale(TimePoint now, Duration more, std::optional<Kind> kind) const {
  const auto found = std::find_if(sources_.begin(), sources_.end(), [&](const Source& source) {
    return (!kind || source.kind == *kind) && is_stale(source, now, more);
  });
  if (found == sources_.end()) return "";
  const MessageMatch match = catalogue.find(found->id);
  return std::string(match.message->name) + " of node " + std::to_string(match.node) + " came " +
         std::to_string(to_ms(now - found->told_at)) + " ms ago and was made " +
         std::to_string(to_ms(now - found->made_at)) + " ms ago";
}

}  // namespace bmu::test
