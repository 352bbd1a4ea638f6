// All inverter drivers: round trip of each frame, the worked frames, and unknown values that are not sent.
#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "devices/device_list.hpp"
#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

std::vector<const InverterDriver*> drivers() {
  std::vector<const InverterDriver*> all;
  for (const Device* device : all_devices()) {
    if (device->inverter != nullptr) all.push_back(device->inverter);
  }
  return all;
}

const InverterDriver& driver_of(std::string_view name) {
  return *find_device(name)->inverter;
}

/// Battery of the worked frames.
BatteryReport worked() {
  return {.charge_voltage_limit_mV = 56'000,
          .discharge_voltage_limit_mV = 44'800,
          .charge_limit_mA = 50'000,
          .discharge_limit_mA = 100'000,
          .may_charge = true,
          .may_discharge = true,
          .soc_permille = known(720),
          .soh_permille = known(980),
          .voltage_mV = known(52'760),
          .current_mA = known(10'000),
          .temperature_dC = known(250),
          .cell_voltage_min_uV = known(3'300'000),
          .cell_voltage_max_uV = known(3'420'000),
          .cell_temperature_min_dC = known(170),
          .cell_temperature_max_dC = known(250),
          .module_count = 12,
          .capacity_uAs = 200LL * 3'600 * 1'000'000};
}

std::vector<CanFrame> round_of(const InverterDriver& driver, const BatteryReport& report,
                               const InverterOptions& options = {}) {
  std::vector<CanFrame> frames;
  for (std::size_t index = 0; index < driver.frame_count; ++index) {
    if (const auto frame = driver.frame(index, report, options)) frames.push_back(*frame);
  }
  return frames;
}

std::optional<CanFrame> find(const std::vector<CanFrame>& frames, std::uint32_t id) {
  const auto found = std::find_if(frames.begin(), frames.end(), [id](const CanFrame& one) { return one.id == id; });
  return found == frames.end() ? std::nullopt : std::optional(*found);
}

std::vector<int> bytes_of(const CanFrame& frame) {
  return {frame.data.begin(), frame.data.begin() + frame.length};
}

std::vector<int> bytes(std::string_view name, const BatteryReport& report, std::uint32_t id,
                       const InverterOptions& options = {}) {
  const auto frame = find(round_of(driver_of(name), report, options), id);
  REQUIRE(frame);
  return bytes_of(*frame);
}

}  // namespace

TEST_CASE("every inverter has a driver, and says how it must be told", "[unit][devices][inverter]") {
  for (const Device* device : all_devices()) {
    INFO(device->name);
    CHECK((device->kind == DeviceKind::inverter) == (device->inverter != nullptr));
  }
  REQUIRE(drivers().size() == 5);
  for (const InverterDriver* driver : drivers()) {
    INFO(driver->name);
    CHECK(find_device(driver->name)->inverter == driver);
    CHECK(driver->default_name.size() <= 8);
    CHECK(driver->urgent_count >= 1);
    CHECK(driver->urgent_count <= driver->frame_count);
    CHECK(driver->frame_count <= inverter_frames_max);
    CHECK(driver->period_min >= 200ms);
    CHECK(driver->battery_life >= 5s);
    CHECK(driver->keep_alive_period == 1s);
  }
}

TEST_CASE("a round has each frame of the language that a battery sends, once", "[unit][devices][inverter]") {
  for (const InverterDriver* driver : drivers()) {
    INFO(driver->name);
    const std::vector<CanFrame> frames = round_of(*driver, worked());
    for (const MessageSpec* message : find_device(driver->name)->catalogue->messages()) {
      INFO(message->name);
      const bool is_told = message->sender == Sender::bmu && message->base_id != 0x00F;
      const auto count =
          std::count_if(frames.begin(), frames.end(), [&](const CanFrame& one) { return one.id == message->base_id; });
      CHECK(count == (is_told ? 1 : 0));
    }
    CHECK(frames.front().id == 0x351);
    BatteryReport heard;
    for (const CanFrame& frame : frames) CHECK(frame.length == 8);
    CHECK(driver->hear(frames.front(), heard) == BatteryWord::limits);
  }
}

TEST_CASE("the frames are the worked ones", "[unit][devices][inverter]") {
  using Bytes = std::vector<int>;
  const BatteryReport report = worked();
  for (const char* name : {"sma", "victron", "discover", "orion"}) {
    CHECK(bytes(name, report, 0x351) == Bytes{0x30, 0x02, 0xF4, 0x01, 0xE8, 0x03, 0xC0, 0x01});
  }
  CHECK(bytes("discover", report, 0x355) == Bytes{0x48, 0x00, 0x62, 0x00, 0x00, 0x00, 0x00, 0x00});
  CHECK(bytes("orion", report, 0x355) == Bytes{0x48, 0x00, 0x62, 0x00, 0xD0, 0x02, 0x00, 0x00});
  for (const char* name : {"discover", "orion"}) {  // 527.6 tenths of a volt, to the nearest
    CHECK(bytes(name, report, 0x356) == Bytes{0x10, 0x02, 0x9C, 0xFF, 0xFA, 0x00, 0x00, 0x00});
  }
  for (const char* name : {"sma", "victron"}) {
    CHECK(bytes(name, report, 0x355) == Bytes{0x48, 0x00, 0x62, 0x00, 0x20, 0x1C, 0x00, 0x00});
  }
  for (const char* name : {"sma", "victron", "pylontech"}) {
    CHECK(bytes(name, report, 0x356) == Bytes{0x9C, 0x14, 0x9C, 0xFF, 0xFA, 0x00, 0x00, 0x00});
  }
  const InverterOptions brief{.has_short_frames = true};
  CHECK(bytes("pylontech", report, 0x351, brief) == Bytes{0x30, 0x02, 0xF4, 0x01, 0xE8, 0x03});
  CHECK(bytes("pylontech", report, 0x355, brief) == Bytes{0x48, 0x00, 0x62, 0x00});
  CHECK(bytes("pylontech", report, 0x35C, brief) == Bytes{0xC0});
  CHECK(bytes("pylontech", report, 0x35E) == Bytes{'P', 'Y', 'L', 'O', 'N', ' ', ' ', ' '});
  CHECK(bytes("victron", report, 0x35E) == Bytes{'B', 'M', 'U', 'D', ' ', ' ', ' ', ' '});
  CHECK(bytes("victron", report, 0x370) == Bytes{'B', 'M', 'U', 'D', ' ', ' ', ' ', ' '});
  CHECK(bytes("victron", report, 0x372, brief) == Bytes{0x0C, 0x00});
  CHECK(bytes("victron", report, 0x373) == Bytes{0xE4, 0x0C, 0x5C, 0x0D, 0x22, 0x01, 0x2A, 0x01});
  CHECK(bytes("victron", report, 0x379) == Bytes{0xC8, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00});
  CHECK(bytes("sma", report, 0x35F) == Bytes{0xFF, 0xFF, 0xFF, 0xFF, 0xC8, 0x00, 0xFF, 0xFF});
  BatteryReport named = report;
  named.name = {'H', 'O', 'M', 'E', ' ', ' ', ' ', ' '};
  CHECK(bytes("sma", named, 0x35E) == Bytes{'H', 'O', 'M', 'E', ' ', ' ', ' ', ' '});
}

TEST_CASE("alarms and warnings are told as the form has them", "[unit][devices][inverter]") {
  using Bytes = std::vector<int>;
  BatteryReport report = worked();
  report.alarms = bit_of(BatteryAlarm::high_voltage);
  report.warnings = bit_of(BatteryAlarm::low_voltage);
  // 01 is raised, 10 is cleared: every supported item has one of them.
  for (const char* name : {"sma", "victron", "discover", "orion"}) {
    CHECK(bytes(name, report, 0x35A) == Bytes{0xA6, 0xAA, 0xAA, 0x02, 0x9A, 0xAA, 0xAA, 0x02});
  }
  report.alarms = bit_of(BatteryAlarm::hot);
  report.module_count = 1;
  const InverterOptions brief{.has_short_frames = true};
  CHECK(bytes("pylontech", report, 0x359, brief) == Bytes{0x08, 0x00, 0x04, 0x00, 0x01, 0x50, 0x4E});
  report.alarms = bit_of(BatteryAlarm::high_current) | bit_of(BatteryAlarm::high_charge_current) |
                  bit_of(BatteryAlarm::communication);
  CHECK(bytes("pylontech", report, 0x359, brief) == Bytes{0x80, 0x09, 0x04, 0x00, 0x01, 0x50, 0x4E});
  // A protocol without an alarm for a failed bus sends it as an internal error.
  report.warnings = 0;
  report.alarms = bit_of(BatteryAlarm::communication);
  CHECK(bytes("victron", report, 0x35A) == Bytes{0xAA, 0xAA, 0x6A, 0x02, 0xAA, 0xAA, 0xAA, 0x02});
}

TEST_CASE("each alarm shows in each form, and goes away again", "[unit][devices][inverter]") {
  for (const InverterDriver* driver : drivers()) {
    const std::uint32_t id = driver->name == "pylontech" ? 0x359 : 0x35A;
    const CanFrame none = *find(round_of(*driver, worked()), id);
    for (std::size_t number = 0; number < battery_alarm_count; ++number) {
      INFO(driver->name << ", alarm " << number);
      BatteryReport report = worked();
      report.alarms = bit_of(static_cast<BatteryAlarm>(number));
      const CanFrame alarm = *find(round_of(*driver, report), id);
      report.warnings = std::exchange(report.alarms, std::uint16_t{0});
      const CanFrame warning = *find(round_of(*driver, report), id);
      CHECK(alarm.data != none.data);
      CHECK(warning.data != none.data);
      CHECK(alarm.data != warning.data);
    }
  }
}

TEST_CASE("limits are rounded to the safe side, and come out as they went in", "[unit][devices][inverter]") {
  for (const InverterDriver* driver : drivers()) {
    INFO(driver->name);
    BatteryReport report = worked();
    report.charge_voltage_limit_mV = 56'099;
    report.charge_limit_mA = 50'099;
    report.discharge_limit_mA = 100'099;
    report.discharge_voltage_limit_mV = 44'801;
    BatteryReport heard{.discharge_voltage_limit_mV = 44'900};
    for (const CanFrame& frame : round_of(*driver, report)) CHECK(driver->hear(frame, heard) != BatteryWord::none);
    CHECK(heard.charge_voltage_limit_mV == 56'000);
    CHECK(heard.charge_limit_mA == 50'000);
    CHECK(heard.discharge_limit_mA == 100'000);
    CHECK(heard.discharge_voltage_limit_mV == 44'900);
    CHECK(heard.may_charge);
    CHECK(heard.may_discharge);
    report.charge_limit_mA = report.discharge_limit_mA = 0;
    report.may_charge = report.may_discharge = false;
    for (const CanFrame& frame : round_of(*driver, report)) CHECK(driver->hear(frame, heard) != BatteryWord::none);
    CHECK(heard.charge_limit_mA == 0);
    CHECK(heard.discharge_limit_mA == 0);
    CHECK_FALSE(heard.may_charge);
    CHECK_FALSE(heard.may_discharge);
    report.charge_limit_mA = INT32_MAX;
    for (const CanFrame& frame : round_of(*driver, report)) CHECK(driver->hear(frame, heard) != BatteryWord::none);
    CHECK(heard.charge_limit_mA == 3'276'700);
  }
}

TEST_CASE("a field of the limits that is not used allows nothing", "[unit][devices][inverter]") {
  BatteryReport heard = worked();
  CanFrame frame = *driver_of("sma").frame(0, worked(), {});
  frame.data = {0xFF, 0xFF, 0x00, 0x80, 0x00, 0x80, 0xFF, 0xFF};
  REQUIRE(driver_of("sma").hear(frame, heard) == BatteryWord::limits);
  CHECK(heard.charge_voltage_limit_mV == 0);
  CHECK(heard.charge_limit_mA == 0);
  CHECK(heard.discharge_limit_mA == 0);
  CHECK_FALSE(heard.may_charge);
}

TEST_CASE("requests are told where the form has a word for them", "[unit][devices][inverter]") {
  const InverterDriver& pylon = driver_of("pylontech");
  for (const auto& [forced, full, byte] :
       {std::tuple{true, false, 0xF0}, std::tuple{false, true, 0xC8}, std::tuple{true, true, 0xF8}}) {
    BatteryReport report = worked();
    report.asks_for_charge = forced;
    report.asks_for_full_charge = full;
    const CanFrame frame = *find(round_of(pylon, report), 0x35C);
    CHECK(int{frame.data[0]} == byte);
    BatteryReport heard;
    REQUIRE(pylon.hear(frame, heard) == BatteryWord::requests);
    CHECK(heard.asks_for_charge == forced);
    CHECK(heard.asks_for_full_charge == full);
  }
}

TEST_CASE("what is above 100 % in 355h is out of range, whatever the form", "[unit][devices][inverter]") {
  for (const InverterDriver* driver : drivers()) {
    const MessageSpec& row = *find_device(driver->name)->catalogue->find(0x355).message;
    // 513 % and 1027 %, and then 100.01 % or 1000.1 %.
    const FrameBytes beyond{0x01, 0x02, 0x03, 0x04, 0x11, 0x27};
    const FrameBytes full{100, 0, 100, 0};
    for (const SignalSpec& signal : row.signals) {
      INFO(driver->name << " " << signal.name);
      CHECK(decode_signal(signal, beyond).validity == Validity::out_of_range);
    }
    for (std::size_t index = 0; index < 2; ++index) CHECK(decode_signal(row.signals[index], full) == known(1'000));
  }
}

TEST_CASE("359h has bits with Pylontech's mark alone", "[unit][devices][inverter]") {
  const MessageSpec& row = *find_device("pylontech")->catalogue->find(0x359).message;
  const auto bits_in = [&row](const FrameBytes& data) {
    return signals_with(row, raw_of(row.signals.front(), data)) - signals_with(row, -1);
  };
  CHECK(bits_in({0x08, 0, 0x04, 0, 1, 'P', 'N', 0}) == 15);
  CHECK(bits_in({0x08, 0, 0x04, 0, 1, 0, 0, 0}) == 0);  // LG's alarm word
  CHECK(bits_in({0x08, 0, 0x04, 0, 1, 'P', 'M', 0}) == 0);
}

TEST_CASE("a fine state of charge of 0 is not filled, and 0.01 % is the least that is sent",
          "[unit][devices][inverter]") {
  const auto fine_of = [](const char* name, const FrameBytes& data) {
    const MessageSpec& row = *find_device(name)->catalogue->find(0x355).message;
    return decode_signal(row.signals[2], data);
  };
  for (const char* name : {"sma", "victron"}) {
    CHECK(fine_of(name, {0x48, 0, 0x62, 0, 0, 0}).validity == Validity::not_fitted);  // of BYD, Discover and LG
    CHECK(fine_of(name, {0x48, 0, 0x62, 0, 0x20, 0x1C}) == known(720'000));
    BatteryReport empty = worked();
    empty.soc_permille = known(0);
    CHECK(bytes(name, empty, 0x355)[4] == 1);
  }
  // Orion has tenths of a percent there, and Discover nothing.
  CHECK(fine_of("orion", {0x48, 0, 0x62, 0, 0xD0, 0x02}) == known(720));
  CHECK(bytes("orion", worked(), 0x355)[4] == 0xD0);
  CHECK(bytes("orion", worked(), 0x355)[5] == 0x02);
  CHECK(bytes("discover", worked(), 0x355)[4] == 0);
  CHECK(bytes("discover", worked(), 0x355)[5] == 0);
}

TEST_CASE("the voltage is in the step of the named form, and one that does not fit is not known",
          "[unit][devices][inverter]") {
  BatteryReport report = worked();
  for (const char* name : {"sma", "victron", "pylontech"}) {
    for (const auto& [voltage_mV, low, high] : {std::array{52'200, 0x64, 0x14}, std::array{292'500, 0x42, 0x72}}) {
      report.voltage_mV = known(voltage_mV);
      CHECK(bytes(name, report, 0x356)[0] == low);
      CHECK(bytes(name, report, 0x356)[1] == high);
    }
  }
  // The two protocols with tenths.
  for (const char* name : {"discover", "orion"}) {
    for (const auto& [voltage_mV, low, high] : {std::array{52'200, 0x0A, 0x02}, std::array{292'500, 0x6D, 0x0B}}) {
      report.voltage_mV = known(voltage_mV);
      CHECK(bytes(name, report, 0x356)[0] == low);
      CHECK(bytes(name, report, 0x356)[1] == high);
    }
  }
  report.voltage_mV = known(327'670);
  CHECK(bytes("pylontech", report, 0x356)[1] == 0x7F);
  report.voltage_mV = known(327'680);
  CHECK_FALSE(find(round_of(driver_of("pylontech"), report), 0x356));
  CHECK(bytes("sma", report, 0x356)[0] == 0x00);
  CHECK(bytes("sma", report, 0x356)[1] == 0x80);
}

TEST_CASE("an Orion's own messages, of which vehicles have different layouts, stay unknown",
          "[unit][devices][inverter]") {
  // Some of them, 036h among them, end in a checksum. In the messages that are read and sent every byte has another
  // use.
  const Catalogue& orion = *find_device("orion")->catalogue;
  for (const std::uint32_t id : {0x036U, 0x076U, 0x6B0U, 0x6B1U, 0x6B2U, 0x6B3U, 0x6B4U}) {
    CHECK(orion.find(id).message == nullptr);
  }
}

TEST_CASE("Pylontech's lowest voltage is decoded where a unit fills it, and never sent", "[unit][devices][inverter]") {
  const MessageSpec& limits = *find_device("pylontech")->catalogue->find(0x351).message;
  const auto lowest_of = [&limits](const FrameBytes& data) { return decode_signal(limits.signals[3], data); };
  CHECK(lowest_of({0x14, 0x02, 0xF4, 0x01, 0xE8, 0x03, 0xC2, 0x01}) == known(45'000));
  CHECK(lowest_of({0x14, 0x02, 0xF4, 0x01, 0xE8, 0x03}).validity == Validity::not_fitted);
  CHECK(bytes("pylontech", worked(), 0x351)[6] == 0);
  CHECK(bytes("pylontech", worked(), 0x351)[7] == 0);
}

TEST_CASE("pairs of 35Ah that are 10, 11 or 00 raise nothing", "[unit][devices][inverter]") {
  for (const char* name : {"sma", "victron"}) {
    const MessageSpec& items = *find_device(name)->catalogue->find(0x35A).message;
    for (const FrameBytes& data : {FrameBytes{0xAA, 0xAA, 0xAA, 0xAA, 0xAA, 0xAA, 0xAA, 0xAA},
                                   FrameBytes{0xEA, 0xAA, 0xFF, 0x0A, 0xA0, 0xAA, 0x00, 0xAA}}) {
      for (const SignalSpec& item : items.signals) {
        const std::int64_t raw = raw_of(item, data);
        const auto named =
            std::find_if(item.names.begin(), item.names.end(), [raw](const RawName& one) { return one.raw == raw; });
        REQUIRE(named != item.names.end());
        CHECK(named->name != "raised");
      }
    }
  }
}

TEST_CASE("a GX device is alive by 307h, too, and another device's 307h is no keep-alive",
          "[unit][devices][inverter]") {
  InverterReport heard;
  CanFrame gx = data_frame(0x307, 8);
  gx.data = {0x12, 0x34, 0x56, 0x78, 'V', 'I', 'C', 0};
  CHECK(driver_of("victron").take(gx, heard) == InverterWord::alive);
  gx.data[4] = 'X';
  CHECK(driver_of("victron").take(gx, heard) == InverterWord::refused);
  CHECK(driver_of("pylontech").take(gx, heard) == InverterWord::none);
}

TEST_CASE("what nobody knows is told by the code of the form, or its frame is left out", "[unit][devices][inverter]") {
  using Bytes = std::vector<int>;
  BatteryReport report = worked();
  report.soh_permille = not_known();
  CHECK(bytes("sma", report, 0x355) == Bytes{0x48, 0x00, 0xFF, 0xFF, 0x20, 0x1C, 0x00, 0x00});
  report.soc_permille = not_known();
  CHECK(bytes("sma", report, 0x355) == Bytes{0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0x00, 0x00});
  for (SignalValue BatteryReport::*value :
       {&BatteryReport::soc_permille, &BatteryReport::soh_permille, &BatteryReport::voltage_mV,
        &BatteryReport::current_mA, &BatteryReport::temperature_dC, &BatteryReport::cell_voltage_min_uV,
        &BatteryReport::cell_voltage_max_uV, &BatteryReport::cell_temperature_min_dC,
        &BatteryReport::cell_temperature_max_dC}) {
    BatteryReport holed = worked();
    holed.*value = not_known();
    CHECK(round_of(driver_of("sma"), holed).size() == 6);
    CHECK(round_of(driver_of("victron"), holed).size() == 8);
    CHECK(round_of(driver_of("pylontech"), holed).size() <= 6);
  }
  BatteryReport unmeasured = worked();
  unmeasured.current_mA = unmeasured.temperature_dC = not_known();
  CHECK(bytes("sma", unmeasured, 0x356) == Bytes{0x9C, 0x14, 0x00, 0x80, 0x00, 0x80, 0x00, 0x00});
  CHECK_FALSE(find(round_of(driver_of("pylontech"), unmeasured), 0x356));
}

TEST_CASE("the sign of the current is the pack file's choice", "[unit][devices][inverter]") {
  const InverterOptions other{.is_discharge_positive = true};
  for (const char* name : {"sma", "victron", "pylontech"}) {
    CHECK(bytes(name, worked(), 0x356)[2] == 0x9C);
    CHECK(bytes(name, worked(), 0x356, other)[2] == 0x64);
  }
}

TEST_CASE("an inverter's words come out as they went in, and others are none of its", "[unit][devices][inverter]") {
  for (const InverterDriver* driver : drivers()) {
    INFO(driver->name);
    InverterReport heard;
    bool is_alive = false;
    const InverterReport said{.voltage_mV = known(53'200), .current_mA = known(-20'000), .temperature_dC = known(230)};
    for (const CanFrame& frame : driver->words(said)) {
      const InverterWord word = driver->take(frame, heard);
      CHECK((word == InverterWord::alive || word == InverterWord::other));
      is_alive = is_alive || word == InverterWord::alive;
      BatteryReport ignored;
      CHECK(driver->hear(frame, ignored) == BatteryWord::none);
      CanFrame brief = frame;
      brief.length = 3;
      CHECK(driver->take(brief, heard) == InverterWord::refused);
      CanFrame remote = frame;
      remote.is_remote = true;
      CHECK(driver->take(remote, heard) == InverterWord::refused);
      CanFrame extended = frame;
      extended.is_extended = true;
      CHECK(driver->take(extended, heard) == InverterWord::none);
    }
    CHECK(is_alive);
    for (const CanFrame& frame : round_of(*driver, worked())) {
      CHECK(driver->take(frame, heard) == InverterWord::none);
      BatteryReport ignored;
      CanFrame remote = frame;
      remote.is_remote = true;
      CHECK(driver->hear(remote, ignored) == BatteryWord::refused);
    }
    CHECK(driver->take(data_frame(0x620, 8), heard) == InverterWord::none);
  }
}

TEST_CASE("SMA says what it measures, and when it has failed", "[unit][devices][inverter]") {
  const InverterDriver& sma = driver_of("sma");
  for (const auto& [failed, warning] : {std::pair{false, false}, std::pair{true, false}, std::pair{false, true}}) {
    InverterReport heard;
    const InverterReport said{.voltage_mV = known(53'200),
                              .current_mA = known(-20'000),
                              .temperature_dC = known(230),
                              .has_failed = failed,
                              .has_warning = warning,
                              .error_number = 952};
    for (const CanFrame& frame : sma.words(said)) static_cast<void>(sma.take(frame, heard));
    CHECK(heard == said);
  }
}
