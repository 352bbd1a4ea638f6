// Acceptance test of BMS_NF.2 (24 V competition pack). Procedure of the authors: reference voltages, temperatures and
// currents are compared with the values on the serial line. Their figures: cells at 4.5, 3.5 and 3.0 V within 4 mV;
// -10, 0, 30 and 60 C within 3 C; 1, 5, 20 and 50 A out of the pack, and 1, 5 and 14.5 A into it, within 100 mA (they
// read 1.074, 5.107, 20.093 and 50.156 less 0.07 A, and 0.929, 4.937 and 14.456 more 0.07 A). The reference is the
// setting of the emulated pack, and the value is read from the text of the service mode.
#include <cstdlib>
#include <optional>
#include <string>

#include "daemon/shell/serial/service_values.hpp"
#include "mmu/scenario/simulator.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/line_values.hpp"
#include "tests/support/patched_pack.hpp"
#include "tools/common/virtual_run.hpp"

using namespace bmu;

namespace {

constexpr std::size_t cell_sensors = 2;
constexpr double voltage_margin_V = 0.004;
constexpr double temperature_margin_C = 3.0;
constexpr double current_margin_A = 0.1;

/// The pack with a reader of its serial line in service mode.
class ReadPack {
 public:
  ReadPack() { run_.set_tap(&values_); }

  void apply(const std::string& event) { REQUIRE(run_.simulator().apply(event)); }
  void run(Duration duration) {
    for (const TimePoint end = run_.now() + duration; run_.now() < end;) run_.step();
  }
  [[nodiscard]] bool is_closed() const { return run_.core().sequence().phase == Phase::closed; }
  /// The line of a whole second that starts after the pack has followed `event`.
  [[nodiscard]] std::string line_after(const std::string& event) {
    apply(event);
    run(3s);
    values_.set_wanted(true);
    std::optional<std::string> line;
    for (const TimePoint end = run_.now() + 3s; run_.now() < end && !line;) {
      run_.step();
      line = values_.take_line();
    }
    values_.set_wanted(false);
    REQUIRE(line);
    return *line;
  }

 private:
  const CoreConfig config_ = test::patched_pack("{}", "lipo-6s-24v.json");
  VirtualRun run_{config_, simulator_config(config_),
                  *parse_scenario("0 pack soc_permille 700\n0 charger obeys nobody\n")};
  ServiceValues values_{run_.core()};
};

double number_of(const std::string& text) {
  char* end = nullptr;
  const double number = std::strtod(text.c_str(), &end);
  INFO(text);
  REQUIRE(end != text.c_str());
  return number;
}

void check_current(ReadPack& pack, const std::string& event, double expected_A) {
  CAPTURE(event);
  const std::string line = pack.line_after(event);
  CHECK(number_of(test::values_of(line, "I").at(0)) == Approx(expected_A).margin(current_margin_A).epsilon(0.0));
}

}  // namespace

TEST_CASE("the serial line has the reference voltages within 4 mV", "[scenario][accept][BMS_NF.2]") {
  ReadPack pack;
  pack.run(1s);
  for (const double reference_V : {4.5, 3.5, 3.0}) {
    for (std::size_t cell = 1; cell <= 6; ++cell) {
      CAPTURE(reference_V, cell);
      const std::string target = "cell 1." + std::to_string(cell) + " voltage_mV ";
      const std::string line = pack.line_after(target + std::to_string(static_cast<int>(reference_V * 1e3)));
      const auto cells = test::values_of(line, "C");
      REQUIRE(cells.size() == 6);
      CHECK(number_of(cells[cell - 1]) == Approx(reference_V).margin(voltage_margin_V).epsilon(0.0));
      pack.apply(target + "auto");
    }
  }
}

TEST_CASE("the serial line has the reference temperatures within 3 C", "[scenario][accept][BMS_NF.2]") {
  ReadPack pack;
  pack.run(1s);
  for (const int reference_C : {-10, 0, 30, 60}) {
    CAPTURE(reference_C);
    const std::string line = pack.line_after("pack temperature_dC " + std::to_string(reference_C * 10));
    const auto sensors = test::values_of(line, "T");
    REQUIRE(sensors.size() > cell_sensors);  // after them those of the board
    for (std::size_t sensor = 0; sensor < cell_sensors; ++sensor) {
      CHECK(number_of(sensors[sensor]) == Approx(reference_C).margin(temperature_margin_C).epsilon(0.0));
    }
  }
}

TEST_CASE("the serial line has the reference currents, out of the pack and into it, within 100 mA",
          "[scenario][accept][BMS_NF.2]") {
  ReadPack pack;
  pack.run(1s);
  pack.apply("vehicle on");
  pack.run(5s);
  REQUIRE(pack.is_closed());
  check_current(pack, "load current_A 1", 1.0);
  check_current(pack, "load current_A 5", 5.0);
  check_current(pack, "load current_A 20", 20.0);
  check_current(pack, "load current_A 50", 50.0);
  pack.apply("load current_A 0");
  pack.apply("charger connected");
  check_current(pack, "charger current_A 1", -1.0);
  check_current(pack, "charger current_A 5", -5.0);
  check_current(pack, "charger current_A 14.5", -14.5);
  CHECK(pack.is_closed());
}
