// 620h to 628h of a pack that is driven and charged, byte by byte: each field against the emulated pack's own values,
// by arithmetic that shares nothing with the tables of the protocol.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numeric>
#include <string>
#include <vector>

#include "config/pack_config.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/wired_pack.hpp"

using namespace bmu;

namespace {

constexpr std::size_t modules = 4;
constexpr std::size_t cells_per_module = 12;
constexpr std::size_t sensors_per_module = 4;
constexpr std::size_t cells = modules * cells_per_module;
constexpr double cell_Ah = 30.0;

// Cells by number through the pack, from 1, and the two sensors that measure the hottest and the coldest cells.
constexpr int emptiest = 17;  // module 2, cell 5
constexpr int fullest = 45;   // module 4, cell 9
constexpr int most_resistive = 11;
constexpr int least_resistive = 39;  // module 4, cell 3
constexpr int hottest_sensor = 3;    // module 1, sensor 3: cells 7 to 9
constexpr int coldest_sensor = 10;   // module 3, sensor 2: cells 4 to 6

/// The last frame of each identifier that the core has sent on the vehicle's bus.
class LastFrames {
 public:
  void note(const Decisions& decisions) {
    for (const OutgoingFrame& outgoing : decisions.frames) {
      if (outgoing.port == Port::vehicle) frames_[outgoing.frame.id] = outgoing.frame;
    }
  }
  void forget() { frames_.clear(); }
  [[nodiscard]] bool has_all() const { return frames_.size() == 9; }
  [[nodiscard]] int byte(std::uint32_t id, std::size_t index) const {
    const CanFrame& frame = frames_.at(id);
    REQUIRE(index < frame.length);
    return frame.data[index];
  }
  [[nodiscard]] int word(std::uint32_t id, std::size_t index) const {
    return byte(id, index) * 256 + byte(id, index + 1);
  }
  [[nodiscard]] int signed_word(std::uint32_t id, std::size_t index) const {
    return static_cast<std::int16_t>(static_cast<std::uint16_t>(word(id, index)));
  }
  [[nodiscard]] int signed_byte(std::uint32_t id, std::size_t index) const {
    return static_cast<std::int8_t>(static_cast<std::uint8_t>(byte(id, index)));
  }
  [[nodiscard]] double long_word(std::uint32_t id, std::size_t index) const {
    return word(id, index) * 65'536.0 + word(id, index + 2);
  }
  [[nodiscard]] std::string text(std::uint32_t id) const {
    const CanFrame& frame = frames_.at(id);
    return {frame.data.begin(), frame.data.begin() + frame.length};
  }

 private:
  std::map<std::uint32_t, CanFrame> frames_;
};

/// A pack, and the energy that it has really delivered and received, counted by the test.
class Journey {
 public:
  Journey(const Journey&) = delete;
  Journey& operator=(const Journey&) = delete;
  Journey() : run_(pack()) {
    // Energy totals are kept with a persistent state, so it starts with one.
    run_.cut_power();
    run_.boot(PersistentState{}, 0);
    began_at_ = run_.now();
    run_.on_decided = [this](const Decisions& decisions, const test::WiredPack&) { frames.note(decisions); };
    for (const char* event :
         {"pack soc_permille 600", "cell 2.5 soc_permille 520", "cell 4.9 soc_permille 680",
          "cell 1.11 resistance_mOhm 3", "cell 4.3 resistance_mOhm 1", "cell 1.8 temperature_dC 380",
          "cell 3.4 temperature_dC 150", "cell 3.5 temperature_dC 150", "cell 3.6 temperature_dC 150",
          "link capacitance_uF 2000"}) {
      apply(event);
    }
  }

  void apply(const std::string& event) { run_.apply(event); }
  void run(double seconds) {
    const TimePoint end = run_.now() + std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds));
    while (run_.now() < end) {
      run_.run(Plant::step_length);
      const double energy_Wh = plant().pack_V() * plant().current_A() * 1e-3 / 3'600.0;
      (energy_Wh > 0.0 ? out_Wh : in_Wh) += std::abs(energy_Wh);
    }
  }
  /// Whole new frames of one second.
  void renew_frames() {
    frames.forget();
    run(1.2);
    REQUIRE(frames.has_all());
  }
  [[nodiscard]] const Plant& plant() const { return run_.simulator().plant(); }
  [[nodiscard]] const Core& core() const { return run_.core(); }
  [[nodiscard]] double uptime_s() const { return std::chrono::duration<double>(run_.now() - began_at_).count(); }
  [[nodiscard]] double cell_V(int number) const { return plant().cell(static_cast<std::size_t>(number) - 1).voltage_V; }
  [[nodiscard]] std::array<double, cells> voltages_V() const {
    std::array<double, cells> found{};
    for (std::size_t cell = 0; cell < cells; ++cell) found[cell] = plant().cell(cell).voltage_V;
    return found;
  }
  /// Temperature at each sensor: that of the warmest of the three cells around it.
  [[nodiscard]] std::vector<double> felt_C() const {
    std::vector<double> felt;
    constexpr std::size_t around = cells_per_module / sensors_per_module;
    for (std::size_t first = 0; first < cells; first += around) {
      double warmest_C = -300.0;
      for (std::size_t cell = first; cell < first + around; ++cell) {
        warmest_C = std::max(warmest_C, plant().cell(cell).temperature_C);
      }
      felt.push_back(warmest_C);
    }
    return felt;
  }
  /// Charge of the pack, in Ah, until the first cell is empty when discharged, and until the first is full when
  /// charged.
  [[nodiscard]] double left_Ah() const {
    double least = 1.0;
    for (std::size_t cell = 0; cell < cells; ++cell) least = std::min(least, plant().cell(cell).soc);
    return least * cell_Ah;
  }
  [[nodiscard]] double missing_Ah() const {
    double least = 1.0;
    for (std::size_t cell = 0; cell < cells; ++cell) least = std::min(least, 1.0 - plant().cell(cell).soc);
    return least * cell_Ah;
  }

  LastFrames frames;
  double out_Wh = 0.0;
  double in_Wh = 0.0;

 private:
  static CoreConfig pack() {
    const auto read = load_pack_config(test::in_source("config/packs/demo-48s.json"));
    REQUIRE(read);
    return read->core;
  }
  test::WiredPack run_;
  TimePoint began_at_;
};

/// Everything but state and resistances, while current and voltages are steady.
void check_values(const Journey& journey) {
  const LastFrames& frames = journey.frames;
  CHECK(std::abs(frames.word(0x622, 1) - journey.uptime_s()) <= 1.5);
  CHECK(frames.byte(0x622, 4) == 0);  // no cell is poor, nor the pack, and it is not too cold to charge
  CHECK(frames.byte(0x622, 5) == 0);

  CHECK(std::abs(frames.word(0x623, 0) - journey.plant().pack_V()) <= 1.0);
  CHECK(std::abs(frames.byte(0x623, 2) * 0.1 - journey.cell_V(emptiest)) <= 0.06);
  CHECK(frames.byte(0x623, 3) == emptiest);
  CHECK(std::abs(frames.byte(0x623, 4) * 0.1 - journey.cell_V(fullest)) <= 0.06);
  CHECK(frames.byte(0x623, 5) == fullest);
  CHECK(frames.byte(0x623, 2) < frames.byte(0x623, 4));

  CHECK(std::abs(frames.signed_word(0x624, 0) - journey.plant().current_A()) <= 0.7);

  // The pack file's 25 A (warning of the charge current) and 80 A (peak of 10 s) are reduced only by the spread of
  // temperatures: not up to 15 K, to zero at 30 K.
  const std::vector<double> felt_C = journey.felt_C();
  const auto [coldest_C, warmest_C] = std::minmax_element(felt_C.begin(), felt_C.end());
  const double allowed = (30.0 - (*warmest_C - *coldest_C)) / (30.0 - 15.0);
  REQUIRE(allowed < 0.6);
  CHECK(std::abs(frames.word(0x624, 2) + 0.5 - 25.0 * allowed) <= 1.0);
  CHECK(std::abs(frames.word(0x624, 4) + 0.5 - 80.0 * allowed) <= 1.0);

  CHECK(std::abs(frames.long_word(0x625, 0) - journey.in_Wh) <= 0.01 * journey.in_Wh + 1.0);
  CHECK(std::abs(frames.long_word(0x625, 4) - journey.out_Wh) <= 0.01 * journey.out_Wh + 1.0);

  const double capacity_Ah = journey.left_Ah() + journey.missing_Ah();
  CHECK(std::abs(frames.byte(0x626, 0) - 100.0 * journey.left_Ah() / capacity_Ah) <= 4.0);
  CHECK(std::abs(frames.word(0x626, 1) - journey.missing_Ah()) <= 1.5);
  CHECK(frames.word(0x626, 3) == cell_Ah);
  CHECK(frames.byte(0x626, 5) == 0xFF);  // there is no second pack
  CHECK(frames.byte(0x626, 6) == 0xFF);  // no capacity has been measured

  double sum_C = 0.0;
  for (const double each_C : felt_C) sum_C += each_C;
  CHECK(std::abs(frames.signed_byte(0x627, 0) - sum_C / static_cast<double>(felt_C.size())) <= 1.0);
  CHECK(frames.byte(0x627, 1) == 0x80);  // there is no sensor of the air
  CHECK(std::abs(frames.signed_byte(0x627, 2) - 15.0) <= 1.0);
  CHECK(frames.byte(0x627, 3) == coldest_sensor);
  CHECK(std::abs(frames.signed_byte(0x627, 4) - 38.0) <= 1.0);
  CHECK(frames.byte(0x627, 5) == hottest_sensor);
}

/// 628h against each cell's resistance, as shown by the first step of the current.
void check_resistances(const LastFrames& frames, const std::array<double, cells>& step_Ohm) {
  const double least_Ohm = step_Ohm[least_resistive - 1];
  const double most_Ohm = step_Ohm[most_resistive - 1];
  INFO(least_Ohm << " " << most_Ohm);
  CHECK(std::abs(frames.byte(0x628, 2) * 1e-4 - least_Ohm) <= 0.3 * least_Ohm + 1e-4);
  CHECK(frames.byte(0x628, 3) == least_resistive);
  CHECK(std::abs(frames.byte(0x628, 4) * 1e-4 - most_Ohm) <= 0.3 * most_Ohm);
  CHECK(frames.byte(0x628, 5) == most_resistive);
  const double sum_Ohm = std::accumulate(step_Ohm.begin(), step_Ohm.end(), 0.0);
  CHECK(std::abs(frames.word(0x628, 0) * 1e-3 - sum_Ohm) <= 0.3 * sum_Ohm);
}

}  // namespace

TEST_CASE("every field of 620h to 628h is the pack's own value, in a drive and in a charge",
          "[scenario][vehicle][BMS_F.8][BMU_10][RR_6]") {
  Journey journey;
  const LastFrames& frames = journey.frames;
  journey.run(3.0);
  journey.renew_frames();
  CHECK(frames.text(0x620) == "BMUD    ");
  CHECK(frames.text(0x621) == "SW: 0.10");
  CHECK(frames.byte(0x622, 0) == 4);  // vehicle off, open
  CHECK(frames.byte(0x622, 3) == 0);
  CHECK(frames.word(0x628, 0) == 0xFFFF);  // no current has shown a resistance

  // A drive in steps, which show each cell's resistance; the test takes it from the first of them.
  journey.apply("vehicle on");
  journey.run(8.0);
  const auto before_V = journey.voltages_V();
  const double before_A = journey.plant().current_A();
  journey.apply("load current_A 25");
  journey.run(0.1);
  const auto after_V = journey.voltages_V();
  const double step_A = journey.plant().current_A() - before_A;
  for (int turn = 0; turn < 12; ++turn) {
    journey.run(5.0);
    journey.apply(turn % 2 == 0 ? "load current_A 2" : "load current_A 25");
  }
  journey.run(30.0);
  journey.renew_frames();
  CHECK(frames.byte(0x622, 0) == 2);  // vehicle on, closed
  CHECK(frames.byte(0x622, 3) == 0x04);
  check_values(journey);

  std::array<double, cells> step_Ohm{};
  for (std::size_t cell = 0; cell < cells; ++cell) step_Ohm[cell] = (before_V[cell] - after_V[cell]) / step_A;
  check_resistances(frames, step_Ohm);

  // And a charge.
  journey.apply("load current_A 0");
  journey.apply("vehicle off");
  journey.run(12.0);
  journey.renew_frames();
  CHECK(frames.byte(0x622, 0) == 4);
  CHECK(frames.byte(0x622, 3) == 0);
  journey.apply("charger current_A 10");
  journey.apply("charger connected");
  journey.run(60.0);
  journey.renew_frames();
  CHECK(frames.byte(0x622, 0) == 1);  // charger connected, closed
  CHECK(frames.byte(0x622, 3) == 0x02);
  CHECK(frames.signed_word(0x624, 0) < 0);
  check_values(journey);
  check_resistances(frames, step_Ohm);
}
