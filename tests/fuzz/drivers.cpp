// Frames as each device's driver reads them: accepted values are valid, an unknown or refused frame changes nothing,
// and values that a driver has read are encoded and read again with the same result, for the emulated devices and for
// frames sent through a gate.
//
// Input: which device (1), options of modules and inverters (1), then 12 bytes per frame: how (1: .0 with the length of
// its row), which row (2), length (1), 8 data bytes.
#include "devices/device_list.hpp"
#include "protocol/receive_check.hpp"
#include "tests/fuzz/fuzz.hpp"

using namespace bmu;

namespace {

CanFrame next_frame(fuzz::Numbers& input, const Catalogue& catalogue) {
  const bool has_length_of_row = (input.next<std::uint8_t>() & 0x01U) != 0;
  const std::uint16_t which = input.next<std::uint16_t>();
  const MessageSpec& message = *catalogue.messages()[which % catalogue.messages().size()];
  const auto nodes = static_cast<std::uint16_t>(message.node_max - message.node_min + 1);
  CanFrame frame = make_frame(message, static_cast<std::uint8_t>(message.node_min + which / 64U % nodes));
  const std::uint8_t length = input.next<std::uint8_t>() % 9;
  if (!has_length_of_row) frame.length = length;
  for (std::uint8_t& byte : frame.data) byte = input.next<std::uint8_t>();
  return frame;
}

void check_charger(const ChargerDriver& driver, const CanFrame& frame,
                   std::array<ChargerReport, charger_units_max>& reports) {
  const std::array<ChargerReport, charger_units_max> before = reports;
  const ChargerNews news = driver.take(frame, reports);
  const bool is_taken = news.word != ChargerWord::none && news.word != ChargerWord::refused;
  if (!is_taken) FUZZ_CHECK(reports == before);
  if (is_taken) {
    FUZZ_CHECK(news.unit < driver.unit_count_max);
    const ChargerReport& report = reports[news.unit];
    FUZZ_CHECK(!report.voltage_mV.is_valid() || report.voltage_mV.value <= charger_output_raw_max * 100);
    FUZZ_CHECK(report.troubles < 1U << charger_trouble_count);
    std::array<ChargerReport, charger_units_max> again{};
    for (const CanFrame& said : driver.reports(news.unit, report)) static_cast<void>(driver.take(said, again));
    // An emulated charger always has a valid voltage.
    FUZZ_CHECK(!report.voltage_mV.is_valid() || again[news.unit].voltage_mV == report.voltage_mV);
  }
  if (const auto command = driver.order_of(frame)) {
    FUZZ_CHECK(command->unit < driver.unit_count_max);
    FUZZ_CHECK(driver.commanded_unit(frame) == command->unit);
    const auto again = driver.order_of(driver.command(command->unit, command->order));
    FUZZ_CHECK(again && again->unit == command->unit && again->order.is_enabled == command->order.is_enabled);
    FUZZ_CHECK(!command->order.is_enabled || again->order == command->order);
  }
}

void check_current(const CurrentSensorDriver& driver, const CanFrame& frame) {
  const CurrentNews news = driver.take(frame);
  FUZZ_CHECK(news.word == CurrentWord::value || !news.current_mA.is_valid());
  if (news.word != CurrentWord::value) return;
  const CurrentNews again = driver.take(driver.report(news.current_mA));
  FUZZ_CHECK(again.word == CurrentWord::value && again.current_mA.is_valid() == news.current_mA.is_valid());
  FUZZ_CHECK(!news.current_mA.is_valid() || again.current_mA == news.current_mA);
}

void check_monitor(const InsulationDriver& driver, const CanFrame& frame, MonitorReport& report) {
  const MonitorReport before = report;
  if (driver.take(frame, report) != MonitorWord::report) return FUZZ_CHECK(report == before);
  // While it does not measure there is no current resistance.
  if (report.is_off || report.is_testing) FUZZ_CHECK(!report.resistance_Ohm.is_valid());
  MonitorReport again;
  FUZZ_CHECK(driver.take(driver.report(report), again) == MonitorWord::report);
  again.resistance_Ohm.is_valid() ? FUZZ_CHECK(again == report) : FUZZ_CHECK(!report.resistance_Ohm.is_valid());
}

void check_inverter(const InverterDriver& driver, const CanFrame& frame, InverterReport& report,
                    BatteryReport& battery) {
  const InverterReport before = report;
  const InverterWord word = driver.take(frame, report);
  if (word == InverterWord::none || word == InverterWord::refused) FUZZ_CHECK(report == before);
  FUZZ_CHECK(report.values_out_of_range >= before.values_out_of_range);
  const BatteryReport battery_before = battery;
  const BatteryWord heard = driver.hear(frame, battery);
  if (heard == BatteryWord::none || heard == BatteryWord::refused) FUZZ_CHECK(battery == battery_before);
  // A frame has one sender.
  FUZZ_CHECK(word == InverterWord::none || heard == BatteryWord::none);
}

void check_battery_frames(const InverterDriver& driver, const BatteryReport& battery, const InverterOptions& options) {
  BatteryReport again = battery;
  for (std::size_t index = 0; index < driver.frame_count; ++index) {
    const auto frame = driver.frame(index, battery, options);
    if (!frame) continue;
    FUZZ_CHECK(frame->length <= 8 && driver.hear(*frame, again) != BatteryWord::refused);
  }
  FUZZ_CHECK(again.charge_limit_mA <= battery.charge_limit_mA &&
             again.discharge_limit_mA <= battery.discharge_limit_mA);
}

void check_modules(const ModuleDriver& driver, const CanFrame& frame, const ModuleOptions& options) {
  const ModuleReport report = driver.take(frame, options);
  FUZZ_CHECK(report.node <= driver.node_max);
  if (report.node == 0) FUZZ_CHECK(report.parts == 0 && report.cell_voltage_uV.empty());
  FUZZ_CHECK(report.first_cell + report.cell_voltage_uV.size() <= foreign_cells_max);
  FUZZ_CHECK(values_out_of_range(report, driver.cell_count_max, driver.temperature_count_max) <= 9);
  for (const SignalValue& voltage : report.cell_voltage_uV) {
    constexpr std::int64_t no_cell_uV = 6'600'000;
    FUZZ_CHECK(!voltage.is_valid() || (voltage.value >= 0 && voltage.value < no_cell_uV));
  }
  const auto question = driver.question_of(frame);
  if (!question) return;
  FUZZ_CHECK(question->node <= driver.node_max);
  for (std::uint8_t node = 1; node <= driver.node_max; ++node) {
    for (const CanFrame& answer : driver.answers(node, *question, {}, 0, options)) {
      const ModuleReport said = driver.take(answer, options);
      FUZZ_CHECK(said.node == node || said.parts == 0);
    }
  }
}

void check_set_up(const SensorSetUpDriver& driver, const CanFrame& frame) {
  const SetUpAnswer answer = driver.take(frame);
  FUZZ_CHECK(answer.channel < sensor_channels_max);
  const auto order = driver.order_of(frame);
  if (!order) return;
  FUZZ_CHECK(order->channel < sensor_channels_max);
  const auto again = driver.order_of(driver.command(*order));
  FUZZ_CHECK(again && *again == *order);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Numbers input(data, size);
  const Device& device = *all_devices()[input.next<std::uint8_t>() % all_devices().size()];
  const std::uint8_t options = input.next<std::uint8_t>();
  const ModuleOptions module_options{.swaps_cell_frames = (options & 0x01U) != 0,
                                     .idle_as_others = (options & 0x02U) != 0};
  const InverterOptions inverter_options{.is_discharge_positive = (options & 0x01U) != 0,
                                         .has_short_frames = (options & 0x02U) != 0};
  std::array<ChargerReport, charger_units_max> charger_reports{};
  MonitorReport monitor_report;
  InverterReport inverter_report;
  BatteryReport battery_report;
  for (int count = 0; count < 64 && !input.is_empty(); ++count) {
    const CanFrame frame = next_frame(input, *device.catalogue);
    if (device.charger != nullptr) check_charger(*device.charger, frame, charger_reports);
    if (device.current != nullptr) check_current(*device.current, frame);
    if (device.insulation != nullptr) check_monitor(*device.insulation, frame, monitor_report);
    if (device.inverter != nullptr) check_inverter(*device.inverter, frame, inverter_report, battery_report);
    if (device.modules != nullptr) check_modules(*device.modules, frame, module_options);
    if (device.set_up != nullptr) check_set_up(*device.set_up, frame);
  }
  if (device.inverter != nullptr) check_battery_frames(*device.inverter, battery_report, inverter_options);
  return 0;
}
