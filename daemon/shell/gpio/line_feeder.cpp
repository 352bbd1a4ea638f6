#include "daemon/shell/gpio/line_feeder.hpp"

#include "daemon/core/types/contactor_id.hpp"

namespace bmu {

namespace {

// A contact's bit is the number of its output.
static_assert(static_cast<int>(GpioOutput::main_positive) == static_cast<int>(ContactorId::main_positive));
static_assert(static_cast<int>(GpioOutput::main_negative) == static_cast<int>(ContactorId::main_negative));
static_assert(static_cast<int>(GpioOutput::precharge) == static_cast<int>(ContactorId::precharge));
static_assert(static_cast<int>(GpioOutput::charge) == static_cast<int>(ContactorId::charge));
static_assert(gpio_inputs_max <= 16, "as many stops or loops as an image has bits");

void take_input(LineImage& image, const GpioLevel& level, unsigned& estops, unsigned& interlocks) {
  switch (level.kind) {
    case GpioInputKind::vehicle_on: image.vehicle_on = level.is_active; break;
    case GpioInputKind::charger_connected: image.charger_connected = level.is_active; break;
    case GpioInputKind::resume_button: image.resume_button = level.is_active; break;
    case GpioInputKind::insulation_ok: image.insulation_ok = !level.was_inactive; break;
    case GpioInputKind::supply_ok: image.supply_ok = !level.was_inactive; break;
    case GpioInputKind::estop:
      if (level.was_inactive) image.estops_pressed |= static_cast<std::uint16_t>(1U << estops);
      ++estops;
      break;
    case GpioInputKind::interlock:
      if (level.was_inactive) image.interlocks_open |= static_cast<std::uint16_t>(1U << interlocks);
      ++interlocks;
      break;
  }
}

}  // namespace

LineImage line_image(std::span<const GpioLevel> levels) {
  LineImage image;
  unsigned estops = 0;
  unsigned interlocks = 0;
  for (const GpioLevel& level : levels) {
    if (!level.feedback_of) {
      take_input(image, level, estops, interlocks);
    } else if (const auto output = static_cast<unsigned>(*level.feedback_of);
               output < contactor_id_count && level.is_active) {
      image.closed_contacts |= static_cast<std::uint8_t>(1U << output);
    }
  }
  return image;
}

LineImage with_doubts(LineImage image, const LineImage& doubts) {
  image.is_failed = image.is_failed || doubts.is_failed;
  image.insulation_ok = image.insulation_ok && doubts.insulation_ok;
  image.supply_ok = image.supply_ok && doubts.supply_ok;
  image.estops_pressed |= doubts.estops_pressed;
  image.interlocks_open |= doubts.interlocks_open;
  return image;
}

LineImage LineFeeder::look() {
  const auto levels = lines_.read();
  last_ = with_doubts(levels ? line_image(*levels) : LineImage{.is_failed = true}, doubts_);
  doubts_ = last_;
  return last_;
}

std::optional<LineImage> LineFeeder::drive(const ContactorOutputs& outputs) {
  const bool was_working = lines_.state() != GpioState::failed;
  if (lines_.drive(outputs) || !was_working) return std::nullopt;
  last_ = doubts_ = LineImage{.is_failed = true};
  return last_;
}

}  // namespace bmu
