// Driver of an iso165C: reads its report of every second and sends no requests.
#include "devices/iso165c/iso165c.hpp"
#include "protocol/receive_check.hpp"

namespace bmu::iso165c {

namespace {

template <SignalName Flag>
bool has(const CanFrame& frame) {
  return read_raw<info, Flag>(frame) != 0;
}

MonitorWord take(const CanFrame& frame, MonitorReport& report) {
  if (frame.id != info.base_id || frame.is_extended || frame.is_error) return MonitorWord::none;
  if (frame.is_remote || content_fault(info, frame)) return MonitorWord::refused;
  report = {.is_low = has<"insulation_failure">(frame),
            .is_warning = has<"insulation_warning">(frame),
            .is_earth_lost = has<"chassis_fault">(frame),
            .is_faulty =
                has<"system_fault">(frame) || has<"controllers_parted">(frame) || has<"other_controller_silent">(frame),
            .is_off = has<"measurement_off">(frame),
            .is_testing = has<"testing_itself">(frame) || has<"calibrating">(frame),
            .is_test_pending = has<"self_test_pending">(frame) || has<"parameter_test_pending">(frame)};
  const bool is_of_now = !report.is_off && !report.is_testing && !has<"resistance_outdated">(frame);
  report.resistance_Ohm = is_of_now ? read<info, "insulation_resistance_Ohm">(frame) : not_known();
  return MonitorWord::report;
}

CanFrame make_report(const MonitorReport& report) {
  CanFrame frame = make_frame(info);
  const std::int64_t resistance_Ohm = report.resistance_Ohm.is_valid() ? report.resistance_Ohm.value : 0;
  write<info, "insulation_resistance_Ohm">(frame, resistance_Ohm);
  write<info, "insulation_failure">(frame, report.is_low ? 1 : 0);
  write<info, "insulation_warning">(frame, report.is_warning ? 1 : 0);
  write<info, "chassis_fault">(frame, report.is_earth_lost ? 1 : 0);
  write<info, "system_fault">(frame, report.is_faulty ? 1 : 0);
  write<info, "measurement_off">(frame, report.is_off ? 1 : 0);
  write<info, "testing_itself">(frame, report.is_testing ? 1 : 0);
  write<info, "self_test_pending">(frame, report.is_test_pending ? 1 : 0);
  write<info, "resistance_outdated">(frame, report.resistance_Ohm.is_valid() ? 0 : 1);
  return frame;
}

}  // namespace

const InsulationDriver driver{.name = "iso165c", .report_period = info.period, .take = take, .report = make_report};

}  // namespace bmu::iso165c
