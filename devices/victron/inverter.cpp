// Driver of Victron inverters. Unknown values are not sent: no document defines a code for them.
#include "devices/inverter_frames.hpp"
#include "devices/victron/victron.hpp"

namespace bmu::victron {

namespace {

constexpr std::string_view default_name = "BMUD";
constexpr inverter::CommonRows common{&limits, &charge, &measurements, &items, &maker, false, default_name};

/// Own frames, after the common ones.
enum class Own : std::uint8_t { name, modules, extremes, capacity };
constexpr std::uint8_t own_count = 4;

std::optional<CanFrame> extremes_frame(const BatteryReport& report) {
  const bool is_known = report.cell_voltage_min_uV.is_valid() && report.cell_voltage_max_uV.is_valid() &&
                        report.cell_temperature_min_dC.is_valid() && report.cell_temperature_max_dC.is_valid();
  if (!is_known) return std::nullopt;
  CanFrame frame = make_frame(extremes);
  write<extremes, "cell_voltage_min_uV">(frame, report.cell_voltage_min_uV);
  write<extremes, "cell_voltage_max_uV">(frame, report.cell_voltage_max_uV);
  write<extremes, "cell_temperature_min_dC">(frame, report.cell_temperature_min_dC);
  write<extremes, "cell_temperature_max_dC">(frame, report.cell_temperature_max_dC);
  return frame;
}

CanFrame modules_frame(const BatteryReport& report, const InverterOptions& options) {
  CanFrame frame = inverter::empty_frame(modules, options);
  write<modules, "module_count">(frame, report.module_count);
  return frame;
}

CanFrame capacity_frame(const BatteryReport& report, const InverterOptions& options) {
  CanFrame frame = inverter::empty_frame(capacity, options);
  write<capacity, "capacity_uAs">(frame, report.capacity_uAs);
  return frame;
}

std::optional<CanFrame> frame(std::size_t index, const BatteryReport& report, const InverterOptions& options) {
  if (index < inverter::common_count) return inverter::common_frame(index, common, report, options);
  switch (static_cast<Own>(index - inverter::common_count)) {
    case Own::name: return inverter::name_frame(name, report, default_name);
    case Own::modules: return modules_frame(report, options);
    case Own::extremes: return extremes_frame(report);
    case Own::capacity: break;
  }
  return capacity_frame(report, options);
}

/// 307h without its mark is from another device, and no keep-alive.
InverterWord take(const CanFrame& frame, InverterReport& /*report*/) {
  const InverterWord word = inverter::take_keep_alive(catalogue, frame);
  const bool is_gx = word == InverterWord::alive && frame.id == gx_alive.base_id;
  return is_gx && !read<gx_alive, "mark">(frame).is_valid() ? InverterWord::refused : word;
}
BatteryWord hear(const CanFrame& frame, BatteryReport& report) {
  return inverter::hear_limits_only(catalogue, limits, &items, frame, report);
}
InverterFrames words(const InverterReport& /*report*/) {
  InverterFrames frames = inverter::keep_alive_only(keep_alive);
  CanFrame gx = make_frame(gx_alive);
  write<gx_alive, "number">(gx, inverter::gx_number);
  write<gx_alive, "mark">(gx, inverter::gx_mark);
  frames.push_back(gx);
  return frames;
}

}  // namespace

const InverterDriver driver{.name = "victron",
                            .default_name = default_name,
                            .frame_count = inverter::common_count + own_count,
                            .period_min = 200ms,
                            .battery_life = 60s,
                            .keep_alive_period = 1s,
                            .frame = frame,
                            .take = take,
                            .hear = hear,
                            .words = words};

}  // namespace bmu::victron
