// Driver of this protocol. Unknown values are not sent: no document defines a code for them.
#include "devices/discover/discover.hpp"
#include "devices/inverter_frames.hpp"

namespace bmu::discover {

namespace {

constexpr std::string_view default_name = "BMUD";
constexpr inverter::CommonRows common{&limits, &charge, &measurements, &items, &maker, false, default_name};
constexpr std::uint8_t frame_count = inverter::common_count;

std::optional<CanFrame> frame(std::size_t index, const BatteryReport& report, const InverterOptions& options) {
  return inverter::common_frame(index, common, report, options);
}
InverterWord take(const CanFrame& frame, InverterReport& /*report*/) {
  return inverter::take_keep_alive(catalogue, frame);
}
BatteryWord hear(const CanFrame& frame, BatteryReport& report) {
  return inverter::hear_limits_only(catalogue, limits, &items, frame, report);
}
InverterFrames words(const InverterReport& /*report*/) {
  return inverter::keep_alive_only(keep_alive);
}

}  // namespace

const InverterDriver driver{.name = "discover",
                            .default_name = default_name,
                            .frame_count = frame_count,
                            .period_min = 200ms,
                            .battery_life = 60s,
                            .keep_alive_period = 1s,
                            .frame = frame,
                            .take = take,
                            .hear = hear,
                            .words = words};

}  // namespace bmu::discover
