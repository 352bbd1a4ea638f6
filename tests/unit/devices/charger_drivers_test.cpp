// All charger drivers: round trip of commands and reports, worked frames, and rejected frames.
#include <array>
#include <bit>
#include <string>
#include <vector>

#include "devices/device_list.hpp"
#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

std::vector<const ChargerDriver*> drivers() {
  std::vector<const ChargerDriver*> all;
  for (const Device* device : all_devices()) {
    if (device->charger != nullptr) all.push_back(device->charger);
  }
  return all;
}

std::vector<int> bytes_of(const CanFrame& frame) {
  return {frame.data.begin(), frame.data.begin() + frame.length};
}

using Reports = std::array<ChargerReport, charger_units_max>;

}  // namespace

TEST_CASE("every charger has a driver, and says what it must be told by", "[unit][devices][charger][BMU_11]") {
  for (const Device* device : all_devices()) {
    INFO(device->name);
    CHECK((device->kind == DeviceKind::charger) == (device->charger != nullptr));
  }
  for (const ChargerDriver* driver : drivers()) {
    INFO(driver->name);
    CHECK(find_device(driver->name)->charger == driver);
    CHECK(driver->unit_count_max >= 1);
    CHECK(driver->unit_count_max <= charger_units_max);
    CHECK(driver->command_period * 2 < driver->command_life);
    CHECK(driver->report_period > 0s);
    CHECK(driver->settle >= driver->report_period);
  }
}

TEST_CASE("an order comes out of its command as it went in, for each unit", "[unit][devices][charger][BMU_11]") {
  for (const ChargerDriver* driver : drivers()) {
    for (std::uint8_t unit = 0; unit < driver->unit_count_max; ++unit) {
      INFO(driver->name << ", unit " << int{unit});
      for (const ChargerOrder& order :
           {ChargerOrder{.is_enabled = true, .voltage_mV = 400'000, .current_mA = 8'000, .mains_current_mA = 16'000},
            ChargerOrder{.is_enabled = true, .voltage_mV = 0, .current_mA = 0},
            ChargerOrder{.voltage_mV = 98'000, .mains_current_mA = 10'000},
            ChargerOrder{.voltage_mV = 98'000, .requests_mains = true}}) {
        const CanFrame frame = driver->command(unit, order);
        const auto seen = driver->order_of(frame);
        REQUIRE(seen);
        CHECK(seen->unit == unit);
        CHECK(seen->order.is_enabled == order.is_enabled);
        CHECK(seen->order.voltage_mV == order.voltage_mV);
        CHECK(seen->order.current_mA == (order.is_enabled ? order.current_mA : 0));
        CHECK(seen->order.requests_mains == (driver->can_request_mains && order.requests_mains));
        if (driver->is_told_mains_current) CHECK(seen->order.mains_current_mA == order.mains_current_mA);
        Reports reports{};
        CHECK(driver->take(frame, reports).word == ChargerWord::none);  // a command is no report
      }
    }
  }
}

TEST_CASE("steps are rounded down, and what the field cannot carry is its most", "[unit][devices][charger]") {
  for (const ChargerDriver* driver : drivers()) {
    INFO(driver->name);
    const auto through = [&](const ChargerOrder& order) { return driver->order_of(driver->command(0, order))->order; };
    const ChargerOrder told = through({.is_enabled = true, .voltage_mV = 400'099, .current_mA = 8'099});
    CHECK(told.voltage_mV == 400'000);
    CHECK(told.current_mA == 8'000);
    const ChargerOrder most = through({.is_enabled = true, .voltage_mV = INT32_MAX, .current_mA = INT32_MAX});
    CHECK(most.voltage_mV <= driver->voltage_max_mV);
    CHECK(most.current_mA <= driver->current_max_mA);
    CHECK_FALSE(through({.is_enabled = false, .voltage_mV = 400'000, .current_mA = 8'000}).is_enabled);
  }
}

TEST_CASE("a report comes out of its frames as it went in, trouble by trouble", "[unit][devices][charger][BMU_11]") {
  for (const ChargerDriver* driver : drivers()) {
    for (std::uint8_t unit = 0; unit < driver->unit_count_max; ++unit) {
      INFO(driver->name << ", unit " << int{unit});
      Reports reports{};
      const ChargerReport said{.voltage_mV = known(301'000), .current_mA = known(10'000), .temperature_dC = known(350)};
      bool has_values = false;
      for (const CanFrame& frame : driver->reports(unit, said)) {
        const ChargerNews news = driver->take(frame, reports);
        CHECK(news.unit == unit);
        CHECK((news.word == ChargerWord::values || news.word == ChargerWord::troubles ||
               news.word == ChargerWord::other));
        has_values = has_values || news.word == ChargerWord::values;
        CHECK_FALSE(driver->order_of(frame));
      }
      CHECK(has_values);
      CHECK(reports.at(unit).voltage_mV == known(301'000));
      CHECK(reports.at(unit).current_mA == known(10'000));
      // Elcon's byte is a temperature on some units only.
      CHECK(reports.at(unit).temperature_dC.is_valid() == (driver->name != "elcon_tc"));
      CHECK(reports.at(unit).troubles == 0);
    }
  }
}

TEST_CASE("each trouble that a protocol has a word for is told, and goes away again", "[unit][devices][charger]") {
  for (const ChargerDriver* driver : drivers()) {
    INFO(driver->name);
    Reports reports{};
    for (std::size_t number = 0; number < charger_trouble_count; ++number) {
      const std::uint16_t bit = bit_of(static_cast<ChargerTrouble>(number));
      for (const CanFrame& frame : driver->reports(0, {.troubles = bit})) {
        static_cast<void>(driver->take(frame, reports));
      }
      CHECK(reports[0].troubles == (driver->reported_troubles & bit));
      for (const CanFrame& frame : driver->reports(0, {})) static_cast<void>(driver->take(frame, reports));
      CHECK(reports[0].troubles == 0);
    }
    CHECK(std::popcount(driver->reported_troubles) >= 5);
    // Each set is a part of the one before.
    CHECK((driver->stopping_troubles & ~driver->reported_troubles) == 0);
    CHECK((driver->latched_troubles & ~driver->stopping_troubles) == 0);
    CHECK((driver->supply_troubles & ~driver->latched_troubles) == 0);
  }
}

TEST_CASE("an emulated Brusa's state says error where it gives nothing, and warning where it goes on",
          "[unit][devices][charger]") {
  const ChargerDriver& brusa = *find_device("brusa_nlg5")->charger;
  constexpr std::uint8_t error = 0x40;
  constexpr std::uint8_t warning = 0x20;
  const auto state_of = [&brusa](std::uint16_t troubles) {
    const CanFrame state = brusa.reports(0, {.troubles = troubles})[0];
    REQUIRE(state.id == 0x610);
    return state.data[0] & (error | warning);
  };
  CHECK(state_of(0) == 0);
  CHECK(state_of(bit_of(ChargerTrouble::too_hot)) == warning);
  CHECK(state_of(bit_of(ChargerTrouble::no_command)) == error);
  CHECK(state_of(bits_of_troubles(ChargerTrouble::hardware, ChargerTrouble::no_mains)) == (error | warning));
}

TEST_CASE("frames of chargers that are not whole change nothing", "[unit][devices][charger]") {
  for (const ChargerDriver* driver : drivers()) {
    INFO(driver->name);
    for (const CanFrame& frame : driver->reports(0, {.voltage_mV = known(301'000), .current_mA = known(10'000)})) {
      Reports reports{};
      CanFrame shorter = frame;
      --shorter.length;
      CanFrame remote = frame;
      remote.is_remote = true;
      for (const CanFrame& bad : {shorter, remote}) {
        CHECK(driver->take(bad, reports).word == ChargerWord::refused);
        CHECK(reports == Reports{});
      }
      CanFrame other = frame;
      other.is_extended = !other.is_extended;
      CanFrame error = frame;
      error.is_error = true;
      CanFrame elsewhere = frame;
      elsewhere.id = 0x123;
      for (const CanFrame& none : {other, error, elsewhere}) {
        CHECK(driver->take(none, reports).word == ChargerWord::none);
        CHECK(reports == Reports{});
      }
    }
    const CanFrame command = driver->command(0, {.is_enabled = true, .voltage_mV = 400'000, .current_mA = 8'000});
    CanFrame shorter = command;
    --shorter.length;
    CanFrame remote = command;
    remote.is_remote = true;
    CanFrame other = command;
    other.is_extended = !other.is_extended;
    for (const CanFrame& bad : {shorter, remote, other}) CHECK_FALSE(driver->order_of(bad));
  }
}

TEST_CASE("whose command a frame is goes by its identifier, whatever its length", "[unit][devices][charger][F98]") {
  for (const ChargerDriver* driver : drivers()) {
    INFO(driver->name);
    for (std::uint8_t unit = 0; unit < driver->unit_count_max; ++unit) {
      CanFrame command = driver->command(unit, {});
      for (std::uint8_t length = 0; length <= 8; ++length) {
        INFO("unit " << int{unit} << ", " << int{length} << " bytes");
        command.length = length;
        CHECK(driver->commanded_unit(command) == unit);
      }
      CanFrame remote = command;
      remote.is_remote = true;  // requests a command, and is none
      CanFrame other = command;
      other.is_extended = !other.is_extended;
      CanFrame error = command;
      error.is_error = true;
      for (const CanFrame& none : {remote, other, error}) CHECK_FALSE(driver->commanded_unit(none));
    }
    for (const CanFrame& report : driver->reports(0, {})) CHECK_FALSE(driver->commanded_unit(report));
  }
}

TEST_CASE("the worked frames of Elcon and Brusa are the drivers'", "[unit][devices][charger][BMU_11]") {
  const ChargerDriver& elcon = *find_device("elcon_tc")->charger;
  const CanFrame charge = elcon.command(0, {.is_enabled = true, .voltage_mV = 98'000, .current_mA = 16'000});
  CHECK(charge.id == 0x1806E5F4);
  CHECK(charge.is_extended);
  CHECK(bytes_of(charge) == std::vector<int>{0x03, 0xD4, 0x00, 0xA0, 0, 0, 0, 0});
  CHECK(bytes_of(elcon.command(0, {.voltage_mV = 98'000, .current_mA = 16'000})) ==
        std::vector<int>{0x03, 0xD4, 0x00, 0x00, 0x01, 0, 0, 0});
  CHECK(elcon.command(3, {}).id == 0x1806E9F4);
  Reports reports{};
  CanFrame status{.id = 0x18FF50E5, .is_extended = true, .length = 8, .data = {0x0B, 0xC2, 0x00, 0x64}};
  REQUIRE(elcon.take(status, reports).word == ChargerWord::values);
  CHECK(reports[0].voltage_mV == known(301'000));
  CHECK(reports[0].current_mA == known(10'000));
  status.data = {0, 0, 0, 0, 0x18};
  REQUIRE(elcon.take(status, reports).word == ChargerWord::values);
  CHECK(reports[0].troubles == (bit_of(ChargerTrouble::no_command) | bit_of(ChargerTrouble::no_battery)));

  // From a capture: charging, and b5, which some units use for a temperature, would be -23 C.
  status.data = {0x0B, 0xC2, 0x00, 0x64, 0x20, 0x4D, 0x01, 0x02};
  REQUIRE(elcon.take(status, reports).word == ChargerWord::values);
  CHECK(reports[0].troubles == 0);
  CHECK_FALSE(reports[0].temperature_dC.is_valid());
  // From a master with the address F5, which may heat.
  CanFrame other = charge;
  other.id = 0x1806E5F5;
  other.data[5] = 1;
  REQUIRE(elcon.order_of(other));
  CHECK(elcon.order_of(other)->unit == 0);
  CHECK(elcon.order_of(other)->order.current_mA == 16'000);
  CHECK(elcon.order_of(other)->order.master_address == MasterAddress::f5);
  CHECK(elcon.order_of(charge)->order.master_address == MasterAddress::f4);
  constexpr std::array<std::uint32_t, 4> ids_of_f5{0x1806E5F5, 0x1806E7F5, 0x1806E8F5, 0x1806E9F5};
  for (std::uint8_t unit = 0; unit < ids_of_f5.size(); ++unit) {
    const CanFrame frame = elcon.command(unit, {.master_address = MasterAddress::f5});
    CHECK(frame.id == ids_of_f5.at(unit));
    CHECK(find_device("elcon_tc")->catalogue->find(frame).message != nullptr);
    REQUIRE(elcon.order_of(frame));
    CHECK(elcon.order_of(frame)->unit == unit);
    CHECK(elcon.order_of(frame)->order.master_address == MasterAddress::f5);
  }

  const ChargerDriver& brusa = *find_device("brusa_nlg5")->charger;
  const ChargerOrder order{.is_enabled = true, .voltage_mV = 400'000, .current_mA = 8'000, .mains_current_mA = 16'000};
  CHECK(bytes_of(brusa.command(0, order)) == std::vector<int>{0x80, 0x00, 0xA0, 0x0F, 0xA0, 0x00, 0x50});
  ChargerOrder clearing = order;
  clearing.clears_errors = true;
  CHECK(brusa.command(0, clearing).data[0] == 0xC0);
  ChargerOrder asking = order;
  asking.requests_mains = true;
  CHECK(brusa.command(0, asking).data[0] == 0x90);
}

TEST_CASE("a voltage or current that no charger gives, and a temperature that none has, is no number",
          "[unit][devices][charger]") {
  const ChargerDriver& elcon = *find_device("elcon_tc")->charger;
  Reports reports{};
  CanFrame frame{.id = 0x18FF50E5, .is_extended = true, .length = 8, .data = {0x3A, 0x98, 0x3A, 0x98}};
  REQUIRE(elcon.take(frame, reports).word == ChargerWord::values);
  CHECK(reports[0].voltage_mV == known(1'500'000));
  CHECK(reports[0].current_mA == known(1'500'000));
  frame.data = {0x3A, 0x99, 0xFF, 0xFF};
  REQUIRE(elcon.take(frame, reports).word == ChargerWord::values);
  CHECK(reports[0].voltage_mV.validity == Validity::out_of_range);
  CHECK(reports[0].current_mA.validity == Validity::out_of_range);

  const ChargerDriver& brusa = *find_device("brusa_nlg5")->charger;
  CanFrame actual = data_frame(0x611, 8);
  actual.data = {0, 0, 0, 0, 0x3A, 0x99, 0x03, 0x20};
  REQUIRE(brusa.take(actual, reports).word == ChargerWord::values);
  CHECK(reports[0].voltage_mV.validity == Validity::out_of_range);
  CHECK(reports[0].current_mA == known(8'000));
  CanFrame heat = data_frame(0x613, 8);
  for (const auto& [high, low, wanted] : {std::tuple{0xFE, 0x0C, known(-500)}, std::tuple{0x07, 0xD0, known(2'000)},
                                          std::tuple{0x80, 0x00, not_known(Validity::out_of_range)},
                                          std::tuple{0x07, 0xD1, not_known(Validity::out_of_range)}}) {
    heat.data = {static_cast<std::uint8_t>(high), static_cast<std::uint8_t>(low)};
    REQUIRE(brusa.take(heat, reports).word == ChargerWord::other);
    CHECK(reports[0].temperature_dC == wanted);
  }
}

TEST_CASE("troubles have words of their own", "[unit][devices][charger]") {
  for (std::size_t number = 0; number < charger_trouble_count; ++number) {
    CHECK(to_text(static_cast<ChargerTrouble>(number)) != "?");
  }
  CHECK(to_text(static_cast<ChargerTrouble>(charger_trouble_count)) == "?");
}

TEST_CASE("what a charger lacks while nothing is asked of it is no trouble, and all else is",
          "[unit][devices][charger]") {
  constexpr std::uint16_t idle =
      bit_of(ChargerTrouble::no_command) | bit_of(ChargerTrouble::no_battery) | bit_of(ChargerTrouble::no_mains);
  constexpr std::uint16_t all = (1U << charger_trouble_count) - 1U;
  CHECK(troubles_among(all, true) == all);
  CHECK(troubles_among(all, false) == (all & ~idle));

  // Elcon b4 .3: battery not connected, or not started. Brusa b4 .7 and .6: mains and battery voltage low.
  Reports reports{};
  const CanFrame starting{.id = 0x18FF50E5, .is_extended = true, .length = 8, .data = {0, 0, 0, 0, 0x18}};
  REQUIRE(find_device("elcon_tc")->charger->take(starting, reports).word == ChargerWord::values);
  CHECK(troubles_among(reports[0].troubles, false) == 0);
  const auto brusa_reports = [&reports](const CanFrame& errors) {
    REQUIRE(find_device("brusa_nlg5")->charger->take(errors, reports).word == ChargerWord::troubles);
    return reports[0].troubles;
  };
  const std::uint16_t low = brusa_reports({.id = 0x614, .length = 5, .data = {0, 0, 0, 0, 0xC0}});
  CHECK(low == (bit_of(ChargerTrouble::no_battery) | bit_of(ChargerTrouble::no_mains)));
  CHECK(troubles_among(low, false) == 0);
  // Wrong polarity and mains overvoltage are a trouble at any time.
  const std::uint16_t wrong = brusa_reports({.id = 0x614, .length = 5, .data = {0x40, 0x80}});
  CHECK(wrong == (bit_of(ChargerTrouble::battery) | bit_of(ChargerTrouble::mains)));
  CHECK(troubles_among(wrong, false) == wrong);
}
