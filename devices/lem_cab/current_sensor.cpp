// Driver of a LEM CAB. The current is invalid if the sensor indicates an error in either of its two fields.
#include "devices/lem_cab/lem_cab.hpp"
#include "protocol/receive_check.hpp"

namespace bmu::lem_cab {

CurrentNews take(const CanFrame& frame) {
  if (frame.id != current.base_id || frame.is_extended || frame.is_error) return {};
  if (frame.is_remote || content_fault(current, frame)) return {.word = CurrentWord::refused};
  const bool is_wrong =
      read_raw<current, "error">(frame) != 0 || read_raw<current, "error_information">(frame) != all_well;
  const SignalValue value = read<current, "sensor_current_mA">(frame);
  const bool is_of_another_device = is_wrong && value.validity == Validity::out_of_range;
  if (is_of_another_device) return {.word = CurrentWord::refused};
  return {CurrentWord::value, is_wrong && value.is_valid() ? not_known(Validity::sensor_fault) : value};
}

CanFrame report(const SignalValue& current_mA) {
  CanFrame frame = make_frame(current);
  write<current, "sensor_current_mA">(frame, current_mA.is_valid() ? current_mA : not_known(Validity::sensor_fault));
  write<current, "error_information">(frame, all_well);
  write<current, "error">(frame, current_mA.is_valid() ? 0 : 1);
  return frame;
}

const CurrentSensorDriver driver{.name = "lem_cab", .period = current.period, .take = take, .report = report};

}  // namespace bmu::lem_cab
