// GPIO lines on an emulated chip, with failing calls, busy lines and disappearing chips; the test of the same class on
// a chip of the kernel is tests/rig/gpio/gpio_on_chip_test.cpp.
#include "daemon/shell/gpio/gpio_lines.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "tests/support/catch.hpp"
#include "tests/support/fake_chip.hpp"

namespace bmu {
namespace {

// --- a pack's lines -------------------------------------------------------------------------------------------------

constexpr std::uint32_t positive_line = 3;  // active low
constexpr std::uint32_t negative_line = 4;
constexpr std::uint32_t precharge_line = 5;
constexpr std::uint32_t watchdog_line = 2;
constexpr std::uint32_t positive_contact_line = 13;  // active low
constexpr std::uint32_t estop_line = 7;              // active low
constexpr std::uint32_t key_line = 9;

[[nodiscard]] std::size_t number_of(GpioOutput output) {
  return static_cast<std::size_t>(output);
}

[[nodiscard]] GpioConfig pack_lines() {
  GpioConfig config{.chip = "/dev/gpiochip0", .outputs = {}, .feedback = {}, .inputs = {}};
  config.outputs.at(number_of(GpioOutput::main_positive)) = {.line = positive_line, .active_low = true};
  config.outputs.at(number_of(GpioOutput::main_negative)) = {.line = negative_line};
  config.outputs.at(number_of(GpioOutput::precharge)) = {.line = precharge_line};
  config.outputs.at(number_of(GpioOutput::watchdog)) = {.line = watchdog_line};
  config.feedback.at(number_of(GpioOutput::main_positive)) = {.at = {.line = positive_contact_line, .active_low = true},
                                                              .debounce = 5ms};
  config.inputs = {{.name = "cockpit",
                    .kind = GpioInputKind::estop,
                    .at = {.line = estop_line, .active_low = true},
                    .debounce = 20ms},
                   {.name = "key", .kind = GpioInputKind::vehicle_on, .at = {.line = key_line}, .debounce = 5ms}};
  return config;
}

constexpr std::uint32_t pulse_line = 11;

[[nodiscard]] GpioConfig with_pulses(bool is_active_low = false) {
  GpioConfig config = pack_lines();
  config.insulation_pulses = {.line = pulse_line, .active_low = is_active_low};
  return config;
}

constexpr ContactorOutputs all_open{};
constexpr ContactorOutputs driving{.main_positive = true, .main_negative = true};

/// Opened, and driven once with all contactors open.
struct Ready {
  FakeChip chip;
  GpioLines lines{pack_lines(), chip};

  Ready() {
    const auto opened = lines.open();
    INFO((opened ? "" : to_text(opened.error())));
    REQUIRE(opened);
    REQUIRE(lines.drive(all_open));
  }
};

[[nodiscard]] bool is_closed_on(const FakeChip& chip) {
  return !chip.wires[positive_line].is_high || chip.wires[negative_line].is_high || chip.wires[precharge_line].is_high;
}

[[nodiscard]] bool is_readable(const GpioLines& lines) {
  pollfd entry{.fd = lines.fd(), .events = POLLIN, .revents = 0};
  return ::poll(&entry, 1, 0) == 1;
}

[[nodiscard]] GpioLevel level_of(GpioLines& lines, std::string_view name) {
  const auto levels = lines.read();
  INFO((levels ? "" : to_text(levels.error())));
  REQUIRE(levels);
  const auto found =
      std::find_if(levels->begin(), levels->end(), [&](const auto& level) { return level.name == name; });
  REQUIRE(found != levels->end());
  return *found;
}

void check_text(const OsError& error, int code, const std::vector<std::string>& words) {
  INFO(to_text(error));
  CHECK(error.code == code);
  for (const std::string& word : words) {
    CAPTURE(word);
    CHECK(to_text(error).find(word) != std::string::npos);
  }
}

// --- requests -------------------------------------------------------------------------------------------------------

TEST_CASE("all outputs are one request that makes them open before they are outputs", "[integration][gpio]") {
  FakeChip chip;
  GpioLines lines(pack_lines(), chip);
  REQUIRE(lines.open());
  REQUIRE(chip.asked.size() == 2);
  const gpio_v2_line_request& request = chip.asked[0];
  CHECK(std::string(request.consumer) == "bmud");
  REQUIRE(request.num_lines == 4);
  CHECK(std::vector<std::uint32_t>(request.offsets, request.offsets + 4) ==
        std::vector<std::uint32_t>{positive_line, negative_line, precharge_line, watchdog_line});
  CHECK(request.config.flags == GPIO_V2_LINE_FLAG_OUTPUT);
  REQUIRE(request.config.num_attrs == 2);
  CHECK(request.config.attrs[0].attr.id == GPIO_V2_LINE_ATTR_ID_FLAGS);
  CHECK(request.config.attrs[0].attr.flags == (GPIO_V2_LINE_FLAG_OUTPUT | GPIO_V2_LINE_FLAG_ACTIVE_LOW));
  CHECK(request.config.attrs[0].mask == 0b0001);
  CHECK(request.config.attrs[1].attr.id == GPIO_V2_LINE_ATTR_ID_OUTPUT_VALUES);
  CHECK(request.config.attrs[1].attr.values == 0);
  CHECK(request.config.attrs[1].mask == 0b1111);
  // One level each, the inactive one, so that there is no glitch.
  CHECK(chip.wires[positive_line].was_driven == std::vector<bool>{true});
  CHECK(chip.wires[negative_line].was_driven == std::vector<bool>{false});
  CHECK(chip.wires[precharge_line].was_driven == std::vector<bool>{false});
  CHECK(chip.set_calls == 0);
}

TEST_CASE("all lines that are read are one request with both edges and each its debounce time", "[integration][gpio]") {
  FakeChip chip;
  GpioLines lines(pack_lines(), chip);
  REQUIRE(lines.open());
  REQUIRE(chip.asked.size() == 2);
  const gpio_v2_line_request& request = chip.asked[1];
  constexpr std::uint64_t both_edges =
      GPIO_V2_LINE_FLAG_INPUT | GPIO_V2_LINE_FLAG_EDGE_RISING | GPIO_V2_LINE_FLAG_EDGE_FALLING;
  REQUIRE(request.num_lines == 3);
  CHECK(std::vector<std::uint32_t>(request.offsets, request.offsets + 3) ==
        std::vector<std::uint32_t>{positive_contact_line, estop_line, key_line});
  CHECK(request.config.flags == both_edges);
  REQUIRE(request.config.num_attrs == 3);
  CHECK(request.config.attrs[0].attr.flags == (both_edges | GPIO_V2_LINE_FLAG_ACTIVE_LOW));
  CHECK(request.config.attrs[0].mask == 0b011);
  CHECK(request.config.attrs[1].attr.id == GPIO_V2_LINE_ATTR_ID_DEBOUNCE);
  CHECK(request.config.attrs[1].attr.debounce_period_us == 5'000);
  CHECK(request.config.attrs[1].mask == 0b101);
  CHECK(request.config.attrs[2].attr.debounce_period_us == 20'000);
  CHECK(request.config.attrs[2].mask == 0b010);
}

TEST_CASE("a debounce time of 0 asks for none", "[integration][gpio]") {
  GpioConfig config = pack_lines();
  config.feedback = {};
  for (GpioInput& input : config.inputs) input.debounce = 0ms;
  FakeChip chip;
  chip.debounces = false;
  GpioLines lines(config, chip);
  REQUIRE(lines.open());
  CHECK(chip.asked[1].config.num_attrs == 1);
}

TEST_CASE("inputs alone, and outputs alone, make one request", "[integration][gpio]") {
  GpioConfig inputs = pack_lines();
  inputs.outputs = {};
  inputs.feedback = {};
  FakeChip chip;
  {
    GpioLines lines(inputs, chip);
    REQUIRE(lines.open());
    CHECK(lines.drive(driving));
    CHECK(lines.read()->size() == 2);
    CHECK(chip.set_calls == 0);
  }
  GpioConfig outputs = pack_lines();
  outputs.feedback = {};
  outputs.inputs = {};
  GpioLines lines(outputs, chip);
  REQUIRE(lines.open());
  CHECK(lines.read()->empty());
  CHECK(chip.asked.size() == 2);
}

// --- outputs --------------------------------------------------------------------------------------------------------

TEST_CASE("outputs have their levels, each with its polarity, by one call and one for the watchdog",
          "[integration][gpio][RR_3]") {
  Ready pack;
  const int calls = pack.chip.set_calls;
  REQUIRE(pack.lines.drive({.main_positive = true, .precharge = true, .fan = true}));
  CHECK(pack.chip.set_calls == calls + 2);
  CHECK_FALSE(pack.chip.wires[positive_line].is_high);
  CHECK_FALSE(pack.chip.wires[negative_line].is_high);
  CHECK(pack.chip.wires[precharge_line].is_high);
  REQUIRE(pack.lines.drive({.main_negative = true}));
  CHECK(pack.chip.wires[positive_line].is_high);
  CHECK(pack.chip.wires[negative_line].is_high);
  CHECK_FALSE(pack.chip.wires[precharge_line].is_high);
}

TEST_CASE("every output of the core has the line of its own name", "[integration][gpio]") {
  constexpr std::array<ContactorOutputs, gpio_feedback_count> one_each{{{.main_positive = true},
                                                                        {.main_negative = true},
                                                                        {.precharge = true},
                                                                        {.charge = true},
                                                                        {.auxiliary = true},
                                                                        {.fan = true},
                                                                        {.heater = true}}};
  GpioConfig config{.chip = "/dev/gpiochip0", .outputs = {}, .feedback = {}, .inputs = {}};
  for (std::uint32_t i = 0; i < gpio_output_count; ++i) config.outputs.at(i) = {.line = i};
  FakeChip chip;
  GpioLines lines(config, chip);
  REQUIRE(lines.open());
  REQUIRE(lines.drive(all_open));
  for (std::size_t i = 0; i < one_each.size(); ++i) {
    REQUIRE(lines.drive(one_each.at(i)));
    for (std::size_t line = 0; line < one_each.size(); ++line) CHECK(chip.wires.at(line).is_high == (line == i));
  }
}

TEST_CASE("the watchdog changes with every drive, whatever is driven", "[integration][gpio][BMS_F.3]") {
  Ready pack;
  auto& driven = pack.chip.wires[watchdog_line].was_driven;
  driven.clear();
  bool last = pack.chip.wires[watchdog_line].is_high;
  for (int i = 0; i < 10; ++i) {
    REQUIRE(pack.lines.drive(i % 3 == 0 ? all_open : driving));
    REQUIRE(pack.chip.wires[watchdog_line].is_high != last);
    last = pack.chip.wires[watchdog_line].is_high;
  }
  CHECK(driven.size() == 10);
}

TEST_CASE("the watchdog changes behind all contactors, though its line has the lowest number", "[integration][gpio]") {
  Ready pack;
  pack.chip.driven_lines.clear();
  REQUIRE(pack.lines.drive(driving));
  CHECK(pack.chip.driven_lines ==
        std::vector<std::uint32_t>{positive_line, negative_line, precharge_line, watchdog_line});
}

TEST_CASE("a watchdog that cannot be set opens the contactors that could", "[integration][gpio]") {
  Ready pack;
  pack.chip.fail_call(1, EIO);
  CHECK_FALSE(pack.lines.drive(driving));
  CHECK_FALSE(pack.chip.is_failure_pending());
  CHECK(pack.lines.state() == GpioState::failed);
  CHECK_FALSE(is_closed_on(pack.chip));
}

TEST_CASE("contactors stay open until they have been wanted open once", "[integration][gpio]") {
  FakeChip chip;
  GpioLines lines(pack_lines(), chip);
  REQUIRE(lines.open());
  CHECK(lines.state() == GpioState::held_open);
  REQUIRE(lines.drive(driving));
  CHECK(lines.state() == GpioState::held_open);
  CHECK_FALSE(is_closed_on(chip));
  REQUIRE(lines.drive({.fan = true}));
  CHECK(lines.state() == GpioState::driving);
  REQUIRE(lines.drive(driving));
  CHECK(is_closed_on(chip));
}

TEST_CASE("lines that are given back are open", "[integration][gpio]") {
  FakeChip chip;
  {
    GpioLines lines(pack_lines(), chip);
    REQUIRE(lines.open());
    REQUIRE(lines.drive(all_open));
    REQUIRE(lines.drive(driving));
    REQUIRE(is_closed_on(chip));
    chip.wires[watchdog_line].was_driven.clear();
  }
  CHECK_FALSE(is_closed_on(chip));
  CHECK(chip.wires[watchdog_line].was_driven.empty());
  CHECK(chip.open_descriptors() == 0);
}

// --- inputs ---------------------------------------------------------------------------------------------------------

TEST_CASE("levels come with names, feedbacks first, active as the polarity says", "[integration][gpio][RR_3]") {
  Ready pack;
  pack.chip.set_wire(positive_contact_line, true);
  pack.chip.set_wire(key_line, true);
  const auto levels = pack.lines.read();
  REQUIRE(levels);
  REQUIRE(levels->size() == 3);
  CHECK((*levels)[0].name == "main_positive");
  CHECK((*levels)[0].feedback_of == GpioOutput::main_positive);
  CHECK_FALSE((*levels)[0].is_active);
  CHECK((*levels)[1].name == "cockpit");
  CHECK_FALSE((*levels)[1].feedback_of);
  CHECK((*levels)[1].kind == GpioInputKind::estop);
  CHECK((*levels)[1].is_active);  // 0 V, active low
  CHECK((*levels)[2].kind == GpioInputKind::vehicle_on);
  CHECK((*levels)[2].is_active);
}

TEST_CASE("an edge makes the descriptor readable, and reading takes it", "[integration][gpio]") {
  Ready pack;
  CHECK_FALSE(is_readable(pack.lines));
  pack.chip.set_wire(estop_line, true);
  CHECK(is_readable(pack.lines));
  CHECK_FALSE(level_of(pack.lines, "cockpit").is_active);
  CHECK_FALSE(is_readable(pack.lines));
}

TEST_CASE("a stop that was let go again is still told, once", "[integration][gpio]") {
  Ready pack;
  CHECK_FALSE(level_of(pack.lines, "cockpit").was_inactive);
  pack.chip.set_wire(estop_line, true);
  pack.chip.set_wire(estop_line, false);
  GpioLevel stop = level_of(pack.lines, "cockpit");
  CHECK(stop.is_active);
  CHECK(stop.was_inactive);
  stop = level_of(pack.lines, "cockpit");
  CHECK(stop.is_active);
  CHECK_FALSE(stop.was_inactive);
  pack.chip.set_wire(estop_line, true);
  CHECK(level_of(pack.lines, "cockpit").was_inactive);
  CHECK(level_of(pack.lines, "cockpit").was_inactive);  // it stays so while the line is inactive
  pack.chip.set_wire(estop_line, false);
  CHECK_FALSE(level_of(pack.lines, "cockpit").was_inactive);  // its state before the last read is old
}

TEST_CASE("more edges than one read takes are all taken", "[integration][gpio]") {
  Ready pack;
  for (int i = 0; i < 100; ++i) pack.chip.set_wire(key_line, i % 2 == 0);
  pack.chip.set_wire(estop_line, true);
  pack.chip.set_wire(estop_line, false);
  CHECK(level_of(pack.lines, "cockpit").was_inactive);
  CHECK_FALSE(is_readable(pack.lines));
}

// --- pulses ---------------------------------------------------------------------------------------------------------

/// An insulation monitor on a line with captured edges.
struct Captured {
  FakeChip chip;
  GpioLines lines;
  bool is_active_low;

  explicit Captured(bool is_inverted = false) : lines(with_pulses(is_inverted), chip), is_active_low(is_inverted) {
    chip.monotonic_ns = 1'000'000'000'000;
    chip.wires[pulse_line].is_high = is_inverted;
    REQUIRE(lines.open());
  }
  [[nodiscard]] TimePoint now() const { return TimePoint{Duration{static_cast<std::int64_t>(chip.monotonic_ns)}}; }
  void wait(Duration duration) { chip.monotonic_ns += static_cast<std::uint64_t>(duration.count()); }
  void set(bool is_active) { chip.set_wire(pulse_line, is_active != is_active_low); }
  void period(Duration high, Duration whole) {
    set(true);
    wait(high);
    set(false);
    wait(whole - high);
  }
  [[nodiscard]] std::optional<ir155::Pwm> look() {
    REQUIRE(lines.read());
    return lines.pulses(now());
  }
};

TEST_CASE("pulses are a request of their own: both edges, no debouncing, and nobody is woken",
          "[integration][gpio][FS_3]") {
  Captured monitor;
  REQUIRE(monitor.chip.asked.size() == 3);
  const gpio_v2_line_request& request = monitor.chip.asked[2];
  REQUIRE(request.num_lines == 1);
  CHECK(request.offsets[0] == pulse_line);
  CHECK(request.config.flags ==
        (GPIO_V2_LINE_FLAG_INPUT | GPIO_V2_LINE_FLAG_EDGE_RISING | GPIO_V2_LINE_FLAG_EDGE_FALLING));
  CHECK(request.config.num_attrs == 0);
  CHECK(request.event_buffer_size == 64);
  monitor.period(10ms, 100ms);
  CHECK_FALSE(is_readable(monitor.lines));
}

TEST_CASE("pulses are told when there was an edge, and once at the start", "[integration][gpio][FS_3]") {
  const bool is_inverted = GENERATE(false, true);
  Captured monitor(is_inverted);
  const auto first = monitor.look();
  REQUIRE(first);
  CHECK(first->frequency_mHz == 0);
  CHECK_FALSE(first->is_high);
  CHECK_FALSE(monitor.look());
  for (int count = 0; count < 3; ++count) monitor.period(25ms, 100ms);
  monitor.set(true);
  monitor.wait(4ms);
  const auto pwm = monitor.look();
  REQUIRE(pwm);
  CHECK(pwm->frequency_mHz == 10'000);
  CHECK(pwm->duty_permille == 250);
  CHECK(pwm->since_edge == 4ms);
  CHECK(pwm->is_high);
  CHECK_FALSE(monitor.look());
  monitor.wait(21ms);
  monitor.set(false);
  CHECK(monitor.look());
}

TEST_CASE("a line that stands high from the start is told as high", "[integration][gpio]") {
  FakeChip chip;
  chip.wires[pulse_line].is_high = true;
  GpioLines lines(with_pulses(), chip);
  REQUIRE(lines.open());
  REQUIRE(lines.read());
  CHECK(lines.pulses(TimePoint{1s})->is_high);
}

TEST_CASE("edges that the kernel had no room for make no period longer", "[integration][gpio]") {
  Captured monitor;
  for (int count = 0; count < 3; ++count) monitor.period(25ms, 100ms);
  monitor.set(true);
  REQUIRE(monitor.look()->duty_permille == 250);
  monitor.chip.edges_to_lose = 2;  // a falling edge and the next rising edge
  monitor.wait(5ms);
  monitor.set(false);
  monitor.wait(5ms);
  monitor.set(true);
  monitor.wait(60ms);
  monitor.set(false);
  monitor.wait(30ms);
  monitor.set(true);
  CHECK(monitor.look()->duty_permille == 250);  // not 70 ms of 100
  CHECK(monitor.lines.read());
}

TEST_CASE("an output that chatters takes no room from a stop, and is read to its end", "[integration][gpio]") {
  Captured monitor;
  for (int count = 0; count < 500; ++count) monitor.period(50us, 100us);
  monitor.chip.set_wire(estop_line, true);
  monitor.chip.set_wire(estop_line, false);
  CHECK(level_of(monitor.lines, "cockpit").was_inactive);
  const auto pwm = monitor.lines.pulses(monitor.now());
  REQUIRE(pwm);
  CHECK(ir155::decode(*pwm).state == ir155::State::undefined);
}

TEST_CASE("lines that were lost begin their capture anew", "[integration][gpio]") {
  Captured monitor;
  for (int count = 0; count < 3; ++count) monitor.period(25ms, 100ms);
  monitor.set(true);
  REQUIRE(monitor.look()->frequency_mHz == 10'000);
  monitor.chip.fail_call(0, EIO);
  const auto failed = monitor.lines.read();
  REQUIRE_FALSE(failed);
  check_text(failed.error(), EIO, {"/dev/gpiochip0 line 11 (insulation_pulses)", "cannot be read"});
  CHECK(monitor.chip.open_descriptors() == 0);
  CHECK_FALSE(monitor.lines.pulses(monitor.now()));
  monitor.lines.maintain();
  const auto pwm = monitor.look();
  REQUIRE(pwm);
  CHECK(pwm->frequency_mHz == 0);
  CHECK(pwm->is_high);
}

TEST_CASE("a pulse line alone is enough, and one that cannot interrupt is named", "[integration][gpio]") {
  GpioConfig config{.chip = "/dev/gpiochip0", .outputs = {}, .feedback = {}, .inputs = {}};
  config.insulation_pulses = {.line = pulse_line};
  FakeChip chip;
  GpioLines lines(config, chip);
  REQUIRE(lines.open());
  CHECK(lines.read()->empty());
  CHECK(lines.pulses(TimePoint{1s}));
  chip.is_there = false;
  CHECK_FALSE(lines.read());
  chip.is_there = true;
  chip.interrupts = false;
  const auto opened = lines.open();
  REQUIRE_FALSE(opened);
  check_text(opened.error(), ENXIO, {"11 (insulation_pulses)", "edges refused", "a line that can interrupt"});
  chip.interrupts = true;
  chip.wires[pulse_line].owner = "pps";
  const auto busy = lines.open();
  REQUIRE_FALSE(busy);
  check_text(busy.error(), EBUSY, {"11 (insulation_pulses)", "\"pps\""});
}

// --- refused lines --------------------------------------------------------------------------------------------------

TEST_CASE("a busy line is named, and its owner", "[integration][gpio]") {
  FakeChip chip;
  chip.wires[precharge_line].owner = "spi0 CS1";
  GpioLines lines(pack_lines(), chip);
  const auto opened = lines.open();
  REQUIRE_FALSE(opened);
  check_text(opened.error(), EBUSY,
             {"/dev/gpiochip0 line 5 (precharge)", "in use by \"spi0 CS1\", expected a free line", "busy"});
  CHECK(lines.state() == GpioState::failed);
  CHECK(lines.last_error() == to_text(opened.error()));
  CHECK(chip.open_descriptors() == 0);
}

TEST_CASE("a busy input gives the outputs back, open", "[integration][gpio]") {
  FakeChip chip;
  chip.wires[estop_line].owner = "gpio-keys";
  GpioLines lines(pack_lines(), chip);
  const auto opened = lines.open();
  REQUIRE_FALSE(opened);
  check_text(opened.error(), EBUSY, {"line 7 (cockpit)", "\"gpio-keys\""});
  CHECK_FALSE(is_closed_on(chip));
  CHECK(chip.open_descriptors() == 0);
}

TEST_CASE("a line the chip does not have is named", "[integration][gpio]") {
  GpioConfig config = pack_lines();
  config.outputs.at(number_of(GpioOutput::fan)) = {.line = 32};
  FakeChip chip;
  GpioLines lines(config, chip);
  const auto opened = lines.open();
  REQUIRE_FALSE(opened);
  check_text(opened.error(), 0, {"/dev/gpiochip0 line 32 (fan)", "chip has 32 lines, fake"});
}

TEST_CASE("what a driver cannot do with its lines is named: debouncing, edges", "[integration][gpio]") {
  FakeChip chip;
  chip.debounces = false;
  GpioLines lines(pack_lines(), chip);
  auto opened = lines.open();
  REQUIRE_FALSE(opened);
  check_text(opened.error(), 524, {"13 (feedback of main_positive)", "7 (cockpit)", "debouncing refused"});
  chip.interrupts = false;
  opened = lines.open();
  REQUIRE_FALSE(opened);
  check_text(opened.error(), ENXIO, {"edges refused", "a line that can interrupt"});
  CHECK(chip.open_descriptors() == 0);
}

TEST_CASE("a chip that is not there is waited for", "[integration][gpio]") {
  FakeChip chip;
  chip.is_there = false;
  GpioLines lines(pack_lines(), chip);
  const auto opened = lines.open();
  REQUIRE_FALSE(opened);
  check_text(opened.error(), ENOENT, {"/dev/gpiochip0", "expected a GPIO chip"});
  CHECK_FALSE(lines.drive(all_open));
  CHECK_FALSE(lines.read());
  lines.maintain();
  CHECK(lines.state() == GpioState::failed);
  chip.is_there = true;
  lines.maintain();
  CHECK(lines.state() == GpioState::held_open);
}

TEST_CASE("a file that is no chip is called one", "[integration][gpio]") {
  FakeChip chip;
  chip.fail_call(1, ENOTTY);
  GpioLines lines(pack_lines(), chip);
  const auto opened = lines.open();
  REQUIRE_FALSE(opened);
  check_text(opened.error(), ENOTTY, {"not a GPIO chip, expected one listed by gpiodetect"});
}

// --- later failures -------------------------------------------------------------------------------------------------

TEST_CASE("a set that fails opens what it can, and stops the watchdog until all was wanted open",
          "[integration][gpio][BMS_F.3]") {
  Ready pack;
  REQUIRE(pack.lines.drive(driving));
  pack.chip.wires[watchdog_line].was_driven.clear();
  pack.chip.fail_call(0, EIO);
  const auto driven = pack.lines.drive(driving);
  REQUIRE_FALSE(driven);
  check_text(driven.error(), EIO,
             {"/dev/gpiochip0 lines 3 (main_positive)", "cannot be set",
              "these driven and the others open: main_positive, main_negative"});
  CHECK(pack.lines.state() == GpioState::failed);
  CHECK_FALSE(is_closed_on(pack.chip));
  CHECK(pack.chip.open_descriptors() == 0);
  const int calls = pack.chip.set_calls;
  CHECK_FALSE(pack.lines.drive(driving));
  CHECK(pack.chip.set_calls == calls);
  CHECK(pack.chip.wires[watchdog_line].was_driven.empty());

  pack.lines.maintain();
  CHECK(pack.lines.state() == GpioState::held_open);
  REQUIRE(pack.lines.drive(driving));
  CHECK_FALSE(is_closed_on(pack.chip));
  REQUIRE(pack.lines.drive(all_open));
  REQUIRE(pack.lines.drive(driving));
  CHECK(is_closed_on(pack.chip));
}

TEST_CASE("outputs that cannot even be opened are said to be so", "[integration][gpio]") {
  Ready pack;
  REQUIRE(pack.lines.drive(driving));
  pack.chip.set_error = EIO;
  const auto driven = pack.lines.drive(all_open);
  REQUIRE_FALSE(driven);
  check_text(driven.error(), EIO, {"expected all open", "and the outputs cannot be opened"});
}

TEST_CASE("levels that cannot be read open the contactors", "[integration][gpio]") {
  for (const int call : {0, 1}) {  // the edges, the levels
    Ready pack;
    REQUIRE(pack.lines.drive(driving));
    pack.chip.fail_call(call, EIO);
    const auto levels = pack.lines.read();
    REQUIRE_FALSE(levels);
    check_text(levels.error(), EIO, {"7 (cockpit)", "cannot be read"});
    CHECK(pack.lines.state() == GpioState::failed);
    CHECK_FALSE(is_closed_on(pack.chip));
  }
}

TEST_CASE("a chip that vanishes is told by the next call, and found again", "[integration][gpio]") {
  Ready pack;
  const int fd = pack.lines.fd();
  REQUIRE(pack.lines.drive(driving));
  pack.chip.is_there = false;
  const auto levels = pack.lines.read();
  REQUIRE_FALSE(levels);
  CHECK(levels.error().code == ENODEV);
  CHECK(pack.lines.state() == GpioState::failed);
  CHECK(pack.chip.open_descriptors() == 0);
  pack.lines.maintain();
  CHECK(pack.lines.state() == GpioState::failed);
  pack.chip.is_there = true;
  pack.lines.maintain();
  CHECK(pack.lines.state() == GpioState::held_open);
  CHECK_FALSE(is_closed_on(pack.chip));
  CHECK(pack.lines.fd() == fd);
  pack.chip.set_wire(estop_line, true);
  CHECK(is_readable(pack.lines));
  CHECK_FALSE(level_of(pack.lines, "cockpit").is_active);
}

TEST_CASE("whichever call fails, no contactor stays closed, nothing leaks, and it works again", "[integration][gpio]") {
  const bool has_pulses = GENERATE(false, true);
  for (int call = 0;; ++call) {
    CAPTURE(has_pulses, call);
    FakeChip chip;
    GpioLines lines(has_pulses ? with_pulses() : pack_lines(), chip);
    chip.fail_call(call, EIO);
    bool has_failed = !lines.open();
    for (const ContactorOutputs& outputs : {all_open, driving}) {
      if (has_failed) break;
      has_failed = !lines.read() || !lines.drive(outputs);
    }
    const bool was_reached = !chip.is_failure_pending();
    CHECK(has_failed == was_reached);
    if (!was_reached) break;
    CHECK(lines.state() == GpioState::failed);
    CHECK(chip.open_descriptors() == 0);
    CHECK((chip.wires[positive_line].was_driven.empty() || !is_closed_on(chip)));
    lines.maintain();
    CHECK(lines.state() == GpioState::held_open);
    CHECK(lines.drive(all_open));
    CHECK(lines.read());
    REQUIRE(call < 30);
  }
}

// --- opening without a daemon ---------------------------------------------------------------------------------------

TEST_CASE("all outputs are driven open where a daemon left them closed", "[integration][gpio]") {
  FakeChip chip;
  chip.wires[negative_line].is_high = true;
  chip.wires[positive_line].is_high = false;
  REQUIRE(is_closed_on(chip));
  CHECK(open_gpio_outputs(pack_lines(), chip).empty());
  CHECK_FALSE(is_closed_on(chip));
  CHECK(chip.asked.size() == 1);  // the inputs are not requested here
  CHECK(chip.open_descriptors() == 0);
}

TEST_CASE("a busy line is told, and the others are opened nevertheless", "[integration][gpio]") {
  FakeChip chip;
  chip.wires[positive_line].is_high = false;
  chip.wires[precharge_line].is_high = true;
  chip.wires[negative_line].owner = "bmud";
  const auto errors = open_gpio_outputs(pack_lines(), chip);
  REQUIRE(errors.size() == 1);
  check_text(errors[0], EBUSY, {"/dev/gpiochip0 line 4 (main_negative)", "in use by \"bmud\""});
  CHECK(chip.wires[positive_line].is_high);
  CHECK_FALSE(chip.wires[precharge_line].is_high);
  CHECK(chip.open_descriptors() == 0);
}

TEST_CASE("a chip that is not there opens nothing, and says so", "[integration][gpio]") {
  FakeChip chip;
  chip.is_there = false;
  REQUIRE(open_gpio_outputs(pack_lines(), chip).size() == 1);
  GpioConfig inputs_only = pack_lines();
  inputs_only.outputs = {};
  CHECK(open_gpio_outputs(inputs_only, chip).empty());
}

}  // namespace
}  // namespace bmu
