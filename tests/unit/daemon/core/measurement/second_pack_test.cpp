// Second pack received on a bus: the values that are used; during silence they are unknown, not zero.
#include "daemon/core/measurement/second_pack.hpp"

#include <initializer_list>
#include <string>
#include <vector>

#include "config/pack_config.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;

namespace {

constexpr TimePoint heard{10s};

CanFrame frame_of(std::uint32_t id, const std::vector<std::uint8_t>& bytes) {
  CanFrame frame = data_frame(id, static_cast<std::uint8_t>(bytes.size()));
  std::copy(bytes.begin(), bytes.end(), frame.data.begin());
  return frame;
}

SecondPack listening(VehicleDialect dialect = VehicleDialect::iha) {
  SecondPack pack;
  pack.init({.base_id = 0x640, .dialect = dialect}, heard);
  return pack;
}

const std::vector<std::uint8_t> charge_of_72_percent{0x48, 0x00, 0x1C, 0x00, 0x64, 0xFF, 0x62};

}  // namespace

TEST_CASE("a second pack's messages are taken, each as its row says", "[unit][second_pack][BMS_F.8]") {
  SecondPack pack = listening();
  CHECK(pack.observe(frame_of(0x640, {'I', 'H', 'A', ' ', 'B', 'M', 'S', '2'}), heard));
  CHECK(pack.observe(frame_of(0x642, {0x02, 0x0E, 0x8D, 0x04, 0, 0}), heard));
  CHECK(pack.observe(frame_of(0x643, {0x01, 0x3C, 0x20, 0x07, 0x22, 0x17}), heard));
  CHECK(pack.observe(frame_of(0x644, {0xFF, 0xE0, 0x00, 0x28, 0x00, 0xC8}), heard));
  CHECK(pack.observe(frame_of(0x646, charge_of_72_percent), heard));
  CHECK(pack.observe(frame_of(0x647, {0x15, 0xFB, 0x12, 0x03, 0x19, 0x29}), heard));
  const SecondPack::Values& values = pack.values();
  CHECK(std::string(values.name.begin(), values.name.end()) == "IHA BMS2");
  CHECK(values.state.value == 2);
  CHECK(values.pack_voltage_mV.value == 316'000);
  CHECK(values.cell_voltage_min_uV.value == 3'200'000);
  CHECK(values.cell_voltage_max_uV.value == 3'400'000);
  CHECK(values.current_mA.value == -32'000);
  CHECK(values.charge_limit_mA.value == 40'000);
  CHECK(values.discharge_limit_mA.value == 200'000);
  CHECK(values.soc_permille.value == 720);
  CHECK(values.soh_permille.value == 980);
  CHECK(values.cell_temperature_min_dC.value == 180);
  CHECK(values.cell_temperature_max_dC.value == 250);
  CHECK(pack.frames_taken() == 6);
  CHECK(pack.frames_refused() == 0);
}

TEST_CASE("a second pack that falls silent is not known, and does not become empty", "[unit][second_pack][BMS_F.8]") {
  SecondPack pack = listening();
  CHECK(pack.soc_permille(heard) == std::nullopt);
  CHECK_FALSE(pack.is_silent(heard + SecondPack::age_max));
  CHECK(pack.is_silent(heard + SecondPack::age_max + 1ms));
  REQUIRE(pack.observe(frame_of(0x646, charge_of_72_percent), heard + 1s));
  CHECK(pack.soc_permille(heard + 1s + SecondPack::age_max) == 720);
  CHECK(pack.soc_permille(heard + 1s + SecondPack::age_max + 1ms) == std::nullopt);
  CHECK_FALSE(pack.is_silent(heard + 1s + SecondPack::age_max));
  CHECK(pack.is_silent(heard + 1s + SecondPack::age_max + 1ms));
  // It still sends, but no longer its SOC.
  REQUIRE(pack.observe(frame_of(0x644, {0, 0, 0, 0, 0, 0}), heard + 6s));
  CHECK(pack.soc_permille(heard + 6s) == std::nullopt);
  CHECK_FALSE(pack.is_silent(heard + 6s));
  pack.forget_values(heard + 6s);
  CHECK_FALSE(pack.values().current_mA.is_valid());
}

TEST_CASE("what a second pack says it does not know, or cannot be, is no number", "[unit][second_pack]") {
  SecondPack pack = listening();
  std::vector<std::uint8_t> charge = charge_of_72_percent;
  for (const auto& [byte, validity] : {std::pair<std::uint8_t, Validity>{0xFF, Validity::unknown},
                                       {101, Validity::out_of_range},
                                       {100, Validity::valid}}) {
    charge[0] = byte;
    REQUIRE(pack.observe(frame_of(0x646, charge), heard));
    CHECK(pack.values().soc_permille.validity == validity);
    CHECK(pack.soc_permille(heard).has_value() == (validity == Validity::valid));
  }
}

TEST_CASE("states and percentages of a second pack that there are not are counted, and are no values",
          "[unit][second_pack]") {
  SecondPack iha = listening();
  const auto says = [](SecondPack& pack, std::uint8_t state) {
    REQUIRE(pack.observe(frame_of(0x642, {state, 0, 0, 0, 0, 0}), heard));
    return pack.values().state.validity;
  };
  CHECK(says(iha, 4) == Validity::valid);
  CHECK(says(iha, 5) == Validity::out_of_range);
  CHECK_FALSE(iha.values().state.is_valid());
  CHECK(iha.values_out_of_range() == 1);
  std::vector<std::uint8_t> charge = charge_of_72_percent;
  charge[0] = 101;  // state of charge
  charge[6] = 101;  // state of health
  REQUIRE(iha.observe(frame_of(0x646, charge), heard));
  CHECK(iha.values().soh_permille.validity == Validity::out_of_range);
  CHECK(iha.values_out_of_range() == 3);
  charge[0] = charge[6] = 0xFF;  // unknown, which is not an error
  REQUIRE(iha.observe(frame_of(0x646, charge), heard));
  CHECK(iha.values_out_of_range() == 3);
  CHECK(iha.frames_refused() == 0);

  SecondPack original = listening(VehicleDialect::original);
  for (const std::uint8_t reserved : std::initializer_list<std::uint8_t>{5, 6, 7, 14, 15, 16, 255}) {
    CHECK(says(original, reserved) == Validity::out_of_range);
  }
  for (const std::uint8_t state : std::initializer_list<std::uint8_t>{0, 4, 8, 13})
    CHECK(says(original, state) == Validity::valid);
  CHECK(original.values_out_of_range() == 7);
  SecondPack elithion = listening(VehicleDialect::elithion);  // bit fields
  CHECK(says(elithion, 0x1F) == Validity::valid);
}

TEST_CASE("a frame that is not whole changes nothing and is counted", "[unit][second_pack]") {
  SecondPack pack = listening();
  REQUIRE(pack.observe(frame_of(0x646, charge_of_72_percent), heard));
  std::vector<CanFrame> bad;
  bad.push_back(frame_of(0x646, {0x10, 0, 0, 0, 0}));
  bad.push_back(frame_of(0x646, {0x10, 0, 0, 0, 0, 0, 0, 0}));
  bad.push_back(frame_of(0x643, {0, 0, 0, 0, 0, 0, 0}));
  bad.push_back(frame_of(0x646, charge_of_72_percent));
  bad.back().is_remote = true;
  bad.push_back(frame_of(0x640, {'B', 'M', 0x00, 'D', ' ', ' ', ' ', ' '}));
  bad.push_back(frame_of(0x640, {'B', 'M', 0x7F, 'D', ' ', ' ', ' ', ' '}));
  for (const CanFrame& frame : bad) CHECK(pack.observe(frame, heard + 1s));
  CHECK(pack.frames_refused() == bad.size());
  CHECK(pack.values().soc_permille.value == 720);
  CHECK(pack.values().soc_permille.taken_at == heard);
  CHECK(pack.values().name[0] == '\0');
  CHECK(pack.heard_at() == heard);

  CanFrame extended = frame_of(0x646, charge_of_72_percent);
  extended.is_extended = true;
  CanFrame error = extended;
  error.is_extended = false;
  error.is_error = true;
  for (const CanFrame& frame : {extended, error, data_frame(0x63F, 8), data_frame(0x649, 6)}) {
    CHECK_FALSE(pack.observe(frame, heard));
  }
  SecondPack none;
  none.init({}, heard);
  CHECK_FALSE(none.observe(data_frame(0, 8), heard));
  CHECK_FALSE(none.is_silent(heard + 1h));
}

TEST_CASE("622h and 626h of six bytes are taken, the health they do not tell is not known", "[unit][second_pack]") {
  SecondPack pack = listening(VehicleDialect::elithion);
  CHECK(pack.observe(frame_of(0x642, {0x0A, 0x0E, 0x8D, 0x0A, 0, 0}), heard));
  CHECK(pack.observe(frame_of(0x646, {0x48, 0, 0x1C, 0, 0x64, 0x62}), heard));
  CHECK(pack.values().state.value == 0x0A);
  CHECK(pack.values().soc_permille.value == 720);
  CHECK(pack.values().soh_permille.validity == Validity::unknown);
  CHECK(pack.observe(frame_of(0x642, {0x0B, 0x0E, 0x8D, 0x0A, 0, 0, 1}), heard));
  CHECK(pack.values().state.value == 0x0B);
}

TEST_CASE("the core tells a second pack's charge as SOC2, and its silence as unknown",
          "[unit][core][second_pack][BMS_F.8]") {
  CoreConfig config = test::small_pack();
  config.second_pack.base_id = 0x640;
  test::CoreBench bench(config);
  bool talks = true;
  TimePoint next{};
  bench.each_ms = [&] {
    if (!talks || bench.now() < next) return;
    next = bench.now() + 1s;
    bench.observe(FrameReceived{Port::vehicle, frame_of(0x646, charge_of_72_percent)});
  };
  const auto soc_2 = [&bench] {
    unsigned last = 0;
    for (const OutgoingFrame& sent : bench.sent()) {
      if (sent.port == Port::vehicle && sent.frame.id == 0x626) last = sent.frame.data[5];
    }
    return last;
  };
  REQUIRE(bench.close());
  bench.run(3s);
  CHECK(soc_2() == 72);
  CHECK_FALSE(bench.is_active(FaultId::second_pack_silent));
  CHECK_FALSE(bench.is_active(FaultId::foreign_reporter));
  talks = false;
  bench.run(5s);
  CHECK(soc_2() == 0xFF);
  CHECK(bench.is_active(FaultId::second_pack_silent));
  CHECK(bench.core().sequence().phase == Phase::closed);  // no reason to open this pack
  talks = true;
  bench.run(3s);
  CHECK(soc_2() == 72);
  CHECK_FALSE(bench.is_active(FaultId::second_pack_silent));
}

TEST_CASE("a second pack is heard on its own bus alone", "[unit][core][second_pack]") {
  CoreConfig config = test::small_pack();
  config.second_pack.base_id = 0x620;  // same as this pack's, but on another bus
  config.served_by[static_cast<std::size_t>(Port::second_pack)] = Port::second_pack;
  test::CoreBench bench(config);
  bench.run(1s);
  bench.observe(FrameReceived{Port::second_pack, frame_of(0x626, charge_of_72_percent)});
  bench.run(100ms);
  CHECK(bench.core().second_pack().soc_permille(bench.now()) == 720);
  CHECK_FALSE(bench.is_active(FaultId::foreign_reporter));
  bench.observe(FrameReceived{Port::vehicle, frame_of(0x626, {0x10, 0, 0, 0, 0, 0, 0})});
  bench.run(100ms);
  CHECK(bench.core().second_pack().soc_permille(bench.now()) == 720);
  CHECK(bench.is_active(FaultId::foreign_reporter));
}

TEST_CASE("buses of one name are one, and the first tells their frames", "[unit][core][ports]") {
  struct Names {
    std::string internal;
    std::string vehicle;
    std::string charger;
    std::string second_pack;
    std::string inverter;
    [[nodiscard]] const std::string& name(Port port) const {
      if (port == Port::charger) return charger;
      if (port == Port::inverter) return inverter;
      return port == Port::internal ? internal : port == Port::vehicle ? vehicle : second_pack;
    }
  };
  using enum Port;
  CHECK(served_by(Names{"a", "b", "c", "d", "e"}) == ServedBy{internal, vehicle, charger, second_pack, inverter});
  CHECK(served_by(Names{"a", "a", "c", "d", "d"}) == ServedBy{internal, internal, charger, second_pack, second_pack});
  CHECK(served_by(Names{"a", "b", "b", "a", "b"}) == ServedBy{internal, vehicle, vehicle, internal, vehicle});
  CHECK(served_by(Names{"a", "b", "c", "c", "a"}) == ServedBy{internal, vehicle, charger, charger, internal});
  CHECK(served_by(Names{"a", "a", "a", "a", "a"}) == ServedBy{internal, internal, internal, internal, internal});
  CHECK(served_by(Names{"a", "", "", "", ""}) == ServedBy{internal, vehicle, charger, second_pack, inverter});
  for (const Port port : all_ports) CHECK(port_of_text(to_text(port)) == port);
  CHECK(port_of_text("motor") == std::nullopt);
}

TEST_CASE("a bus that the command line leaves out goes with the one that it is in the pack file",
          "[unit][core][ports]") {
  const auto names = [](const BusNames& file, const BusNames& given) {
    const BusNames all = file.with(given);
    std::vector<std::string> found;
    for (const Port port : all_ports) found.push_back(all.name(port));
    return found;
  };
  using Found = std::vector<std::string>;
  const BusNames one{.internal = "a", .vehicle = "a", .charger = "a", .second_pack = "a", .inverter = "b"};
  CHECK(names(one, {}) == Found{"a", "a", "a", "a", "b"});
  CHECK(names(one, {.internal = "x"}) == Found{"x", "x", "x", "x", "b"});
  CHECK(names(one, {.internal = "x", .charger = "c"}) == Found{"x", "x", "c", "x", "b"});
  const BusNames three{.internal = "a", .vehicle = "b", .charger = "c", .second_pack = "b"};
  CHECK(names(three, {.internal = "x", .vehicle = "y"}) == Found{"x", "y", "c", "y", "y"});
  CHECK(names(three, {.charger = "a"}) == Found{"a", "b", "a", "b", "b"});
}
