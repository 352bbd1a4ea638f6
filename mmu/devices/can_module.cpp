#include "mmu/devices/can_module.hpp"

#include <array>

namespace bmu {

namespace {

constexpr std::uint8_t counter_values = 15;  // where there is a counter: 0 to 14
/// Modules do not measure at the same instant.
constexpr Duration sampling_shift = 7ms;

constexpr ModuleParts cells_parts = bit_of(ModulePart::cells_1) | bit_of(ModulePart::cells_2) |
                                    bit_of(ModulePart::cells_3) | bit_of(ModulePart::cells_4);
/// In the order of OmittedFrames; the counterpart of MODULE is the voltage of the stack, IDENT has none.
constexpr std::array<ModuleParts, 6> parts_of_groups{
    0, bit_of(ModulePart::status), cells_parts, bit_of(ModulePart::temperatures), bit_of(ModulePart::voltage), 0};

constexpr ModuleParts parts_in(OmittedFrames group) {
  return parts_of_groups[static_cast<std::size_t>(group)];
}

/// Modules that are polled one by one do not wait for each other.
Duration delay_at(const CanModuleConfig& config, std::size_t place) {
  const ModuleDriver& driver = *config.driver;
  const Duration answer_length = config.frame_spacing * driver.frames_per_answer;
  return answer_delay(driver) + (driver.asks_each ? Duration{} : answer_length * static_cast<int>(place));
}

TimePoint first_sample_at(const CanModuleConfig& config, std::size_t place, TimePoint powered_at) {
  return powered_at + sampling_shift * static_cast<int>(place) % config.driver->sample_age_max;
}

}  // namespace

bool has_frames(const ModuleDriver& driver, OmittedFrames group) {
  return (driver.parts_of(driver.cell_count_max) & parts_in(group)) != 0;
}

CanModule::CanModule(const CanModuleConfig& config, std::uint8_t node, std::size_t place, TimePoint powered_at)
    : config_(config),
      node_(node),
      answer_delay_(delay_at(config, place)),
      sampling_(first_sample_at(config, place, powered_at), config.driver->sample_age_max) {
  BMU_ASSERT(node >= 1 && node <= config.driver->node_max);
}

void CanModule::observe(const CanFrame& frame, TimePoint now) {
  const std::optional<ModuleQuestion> question = config_.driver->question_of(frame);
  const bool is_asked = question && (question->node == 0 || question->node == node_);
  if (!is_asked) return;
  asked_at_ = now;
  bleed_above_uV_ = question->bleed_above_uV;
  if (!bleed_above_uV_) bleeding_ = 0;
  questions_.push(frame, now + answer_delay_);
}

void CanModule::sample(const ModuleMeasurements& measured, TimePoint now) {
  (void)sampling_.take(now);
  sample_ = measured;
  has_sample_ = true;
  bleeding_ = cells_to_bleed();
}

CellMask CanModule::cells_to_bleed() const {
  CellMask cells = 0;
  for (std::size_t cell = 0; cell < foreign_cells_max && bleed_above_uV_; ++cell) {
    const SignalValue& voltage_uV = sample_.cell_voltage_uV[cell];
    const std::int32_t reads_low_uV = has_cell(bleeding_, cell) ? config_.bled_reads_low_uV : 0;
    const bool is_above = voltage_uV.is_valid() && voltage_uV.value + reads_low_uV > *bleed_above_uV_;
    if (is_above) cells = static_cast<CellMask>(cells | cell_bit(cell));
  }
  return cells;
}

void CanModule::tick(const ModuleWireFaults& faults, TimePoint now) {
  if (bleed_above_uV_ && now - asked_at_ > config_.bleeds_on_for) {
    bleed_above_uV_.reset();
    bleeding_ = 0;
  }
  if (faults.is_silent) leaving_.clear();
  while (const std::optional<CanFrame> frame = questions_.pop(now)) {
    if (has_sample_) answer(*config_.driver->question_of(*frame), faults, now);
  }
}

void CanModule::answer(const ModuleQuestion& question, const ModuleWireFaults& faults, TimePoint now) {
  const ModuleDriver& driver = *config_.driver;
  const bool repeats = (faults.is_stuck || faults.is_replaying) && answers_given_ > 0;
  if (!repeats) refresh_words(faults);
  if (!faults.has_frozen_counter && !faults.is_replaying) {
    counter_ = static_cast<std::uint8_t>((counter_ + 1) % counter_values);
  }
  const ModuleFrames frames = driver.answers(faults.node.value_or(node_), question, said_, counter_, config_.options);
  if (!frames.empty()) ++answers_given_;
  TimePoint leaves_at = now + faults.delay;
  for (CanFrame frame : frames) {
    const ModuleParts parts = driver.take(frame, config_.options).parts;
    if (faults.is_silent || (parts & parts_in(faults.omitted)) != 0) continue;
    if (faults.has_damaged_frames && driver.has_checksum && parts != 0) frame.data[7] ^= 0x55U;
    leaving_.push(frame, leaves_at);
    leaves_at += config_.frame_spacing;
  }
}

/// Updates the content of answers; the switches are read back as they are.
void CanModule::refresh_words(const ModuleWireFaults& faults) {
  said_ = sample_;
  said_.bleeding_cells = faults.balancing_cells.value_or(bleeding_);
}

}  // namespace bmu
