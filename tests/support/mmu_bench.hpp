// Frames of a master and devices that are fed by hand, for the tests of the emulated devices.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <limits>
#include <vector>

#include "mmu/devices/mmu.hpp"
#include "protocol/tables/internal_bus.hpp"

namespace bmu::test {

inline constexpr TimePoint power_up{100s};

/// POLL flags, as in b1.
enum PollFlag : std::uint8_t {
  want_status = 0x01,
  want_cells = 0x02,
  want_temp = 0x04,
  want_module = 0x08,
  want_ident = 0x10,
  want_sync = 0x80,
  want_all = 0x1F
};

[[nodiscard]] inline CanFrame poll_frame(std::uint8_t target, unsigned flags, std::uint8_t counter) {
  CanFrame frame = make_frame(internal_bus::poll);
  frame.data[0] = target;
  frame.data[1] = static_cast<std::uint8_t>(flags);
  seal(internal_bus::poll, counter, frame);
  return frame;
}

/// A COMMAND with these bytes from b0 on.
[[nodiscard]] inline CanFrame command_frame(std::uint8_t node, std::uint8_t counter,
                                            std::initializer_list<std::uint8_t> bytes) {
  CanFrame frame = make_frame(internal_bus::command, node);
  std::copy(bytes.begin(), bytes.end(), frame.data.begin());
  seal(internal_bus::command, counter, frame);
  return frame;
}

/// COMMAND balance: minutes of cell 1, 2, ...; 7, "leave as it is", for the others.
[[nodiscard]] inline CanFrame balance_frame(std::uint8_t node, std::uint8_t counter,
                                            std::initializer_list<std::uint8_t> minutes) {
  CanFrame frame = make_frame(internal_bus::command, node);
  frame.data[0] = 3;
  std::size_t cell = 0;
  for (; cell < minutes.size(); ++cell) {
    insert_bits(frame.data, static_cast<unsigned>(8 + 3 * cell), 3, *(minutes.begin() + cell));
  }
  for (; cell < 12; ++cell) insert_bits(frame.data, static_cast<unsigned>(8 + 3 * cell), 3, 7);
  seal(internal_bus::command, counter, frame);
  return frame;
}

struct TimedFrame {
  TimePoint at{};
  CanFrame frame;
};

[[nodiscard]] inline double thermistor_resistance_Ohm(ThermistorCurve curve, const SignalValue& temperature_dC) {
  if (temperature_dC.validity == Validity::open_circuit) return std::numeric_limits<double>::infinity();
  return temperature_dC.is_valid() ? thermistor_Ohm(curve, static_cast<double>(temperature_dC.value) / 10.0) : 0.0;
}

/// Signals at the front end's inputs, thermistors as temperatures; a value that is neither a temperature nor open is a
/// short circuit.
struct BenchInputs : FrontEndInputs {
  std::array<SignalValue, mmu_cell_temperatures> cell_temperature_dC{};
  std::array<SignalValue, mmu_board_temperatures> board_temperature_dC{};
  bool front_end_crc_ok = true;
};

/// A module, measurements that a test can set, and a clock that ticks it every millisecond.
class MmuBench {
 public:
  explicit MmuBench(const MmuConfig& config = {.node = 3, .serial_number = 1234567})
      : mmu(config, power_up), curve(config.thermistor_curve) {
    measured.cell_voltage_uV.fill(3'700'000);
    measured.module_mV = 3'700 * config.cell_count;
    measured.cell_temperature_dC.fill(known(250));
    measured.board_temperature_dC.fill(known(300));
  }

  Mmu mmu;
  ThermistorCurve curve;
  BenchInputs measured;
  std::function<void(FrontEndTransfer&)> on_transfer;  // alters it on its way
  TimePoint now = power_up;

  /// Ticks for `duration`; returns the frames sent in it.
  std::vector<TimedFrame> run(Duration duration) {
    std::vector<TimedFrame> sent;
    for (const TimePoint end = now + duration; now < end;) {
      now += 1ms;
      for (const CanFrame& frame : mmu.tick(now, transfer())) sent.push_back({now, frame});
    }
    return sent;
  }
  [[nodiscard]] FrontEndTransfer transfer() {
    for (std::size_t sensor = 0; sensor < mmu_cell_temperatures; ++sensor) {
      measured.cell_sensor_Ohm[sensor] = thermistor_resistance_Ohm(curve, measured.cell_temperature_dC[sensor]);
      measured.board_sensor_Ohm[sensor] = thermistor_resistance_Ohm(curve, measured.board_temperature_dC[sensor]);
    }
    FrontEndTransfer transfer = convert(measured, mmu.wants(now));
    if (!measured.front_end_crc_ok) {
      for (GroupBytes& group : transfer.groups) group[7] ^= 0x02;
    }
    if (on_transfer && transfer.contents != TransferWanted::nothing) on_transfer(transfer);
    return transfer;
  }
  /// Runs beyond the first average and the unsolicited IDENT: a module in normal operation.
  void settle() { run(800ms); }

  void poll(unsigned flags, std::uint8_t target = 0) { mmu.observe(poll_frame(target, flags, ++poll_counter), now); }
  /// POLLs and returns the answer of the next 10 ms.
  std::vector<TimedFrame> ask(unsigned flags, std::uint8_t target = 0) {
    poll(flags, target);
    return run(10ms);
  }
  CanFrame status() { return ask(want_status).at(0).frame; }
  /// Sends the command to the module itself and returns the result in its RESPONSE; -1 without one within 10 ms.
  std::int64_t command(const CanFrame& frame) {
    mmu.observe(frame, now);
    for (const TimedFrame& sent : run(10ms)) {
      if (sent.frame.id == internal_bus::response.base_id + std::uint32_t{mmu.node()}) {
        return read_raw<internal_bus::response, "result">(sent.frame);
      }
    }
    return -1;
  }
  std::uint8_t next_command() { return ++command_counter; }
  /// Runs with a POLL every 100 ms that requests nothing: a master is present.
  void run_polled(Duration duration) {
    for (const TimePoint end = now + duration; now < end;) {
      poll(0);
      run(std::min<Duration>(100ms, end - now));
    }
  }

  std::uint8_t poll_counter = 0;
  std::uint8_t command_counter = 0;
};

}  // namespace bmu::test
