// Writes a candump log with every message of bmud's tables, from several nodes, with every value of its selector: each
// signal at its limits, at its special codes, at its named values and at some between. Every frame passes its receive
// check. The log is the same each time.
//
//   make_every_frame DIALECT > FILE                   dialect of the vehicle messages: iha, original or elithion
//   make_every_frame --device NAME > FILE             of a third-party device
//   make_every_frame --device NAME little > FILE      of one that is configured for little-endian values
//   make_every_frame --device charger > FILE          of every supported charger
#include <array>
#include <cstdio>
#include <map>
#include <set>
#include <string_view>
#include <vector>

#include "devices/device_list.hpp"
#include "protocol/candump.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "protocol/tables/vehicle_bus.hpp"
#include "protocol/tables/vehicle_bus_elithion.hpp"
#include "protocol/tables/vehicle_bus_original.hpp"

namespace {

using namespace bmu;

constexpr std::uint8_t nodes[] = {1, 2, 63};
constexpr int frames_each = 60;

/// Gives the same numbers with every standard library, unlike its distributions.
class Random {
 public:
  std::uint64_t next() {
    state_ = state_ * 6'364'136'223'846'793'005U + 1'442'695'040'888'963'407U;
    return (state_ >> 11U) ^ (state_ << 40U);
  }

 private:
  std::uint64_t state_ = 20'260'102;
};

class LogMaker {
 public:
  void run(const Catalogue& vehicle) {
    // Answers come before the requests: then no answer can be late.
    for (const bool is_question : {false, true}) {
      for (const MessageSpec* message : internal_bus::catalogue.messages()) {
        const bool asks = message == &internal_bus::poll || message == &internal_bus::command;
        if (asks == is_question) every_node(*message);
      }
    }
    run_alone(vehicle);
  }
  void run_alone(const Catalogue& catalogue) {
    for (const MessageSpec* message : catalogue.messages()) every_node(*message);
  }
  /// From all its nodes, as in its DBC.
  void run_device(const Device& device, bool is_little_endian) {
    const Catalogue& catalogue = is_little_endian ? *device.little_endian : *device.catalogue;
    for (const MessageSpec* message : catalogue.messages()) {
      for (unsigned node = message->node_min; node <= message->node_max; ++node) {
        every_selector(*message, static_cast<std::uint8_t>(node));
      }
    }
  }

 private:
  void every_node(const MessageSpec& message) {
    if (message.node_min == 0) every_selector(message, 0);
    if (!message.has_node()) return;
    for (const std::uint8_t node : nodes) {
      if (node >= message.node_min && node <= message.node_max) every_selector(message, node);
    }
  }

  void every_selector(const MessageSpec& message, std::uint8_t node) {
    std::set<std::int64_t> selectors;
    for (const SignalSpec& signal : message.signals) {
      for (int turn = 0; signal.selected_by >= 0 && turn < signal.selected_count; ++turn) {
        selectors.insert(signal.selected_by + turn * signal.selected_step);
      }
    }
    if (selectors.empty()) return some_frames(message, node, -1);
    for (const std::int64_t selector : selectors) some_frames(message, node, selector);
  }

  void some_frames(const MessageSpec& message, std::uint8_t node, std::int64_t selector) {
    for (int count = 0; count < frames_each; ++count) {
      CanFrame frame = make_frame(message, node);
      if (message.length_min > 0 && count % 2 == 1) frame.length = message.length_min;
      for (const SignalSpec& signal : message.signals) {
        const bool is_selector = selector >= 0 && &signal == message.signals.data();
        if (!is_selected(signal, selector)) continue;
        const std::int64_t raw = is_selector ? selector : raw_for_turn(signal, count);
        insert_bits(frame.data, signal.first_bit, signal.bit_count, static_cast<std::uint64_t>(raw), signal.order);
      }
      print(message, frame);
    }
  }

  std::int64_t raw_for_turn(const SignalSpec& signal, int turn) {
    std::vector<std::int64_t> chosen{raw_range(signal).min, raw_range(signal).max};
    for (const SpecialCode& code : signal.special) chosen.push_back(code.raw);
    for (const RawName& name : signal.names) chosen.push_back(name.raw);
    const auto index = static_cast<std::size_t>(turn);
    return index < chosen.size() ? chosen[index] : static_cast<std::int64_t>(random_.next());
  }

  void print(const MessageSpec& message, CanFrame& frame) {
    seal(message, ++counters_[frame.id], frame);
    std::array<char, log_line_length_max> text{};
    time_us_ += 1'000;
    const LogLine line{.kind = LogLineKind::frame, .time_us = time_us_, .bus = "vcan0", .frame = frame};
    const std::size_t length = print_log_line(line, text);
    text[length] = '\n';
    std::fwrite(text.data(), 1, length + 1, stdout);
  }

  std::int64_t time_us_ = 1'700'000'000'000'000;
  std::map<std::uint32_t, std::uint8_t> counters_;
  Random random_;
};

/// False: no device has that name, or that byte order.
bool run_devices(std::string_view name, bool is_little_endian) {
  LogMaker maker;
  bool has_any = false;
  for (const Device* device : all_devices()) {
    const bool is_meant = name == "charger" ? device->kind == DeviceKind::charger : device->name == name;
    if (!is_meant || (is_little_endian && device->little_endian == nullptr)) continue;
    maker.run_device(*device, is_little_endian);
    has_any = true;
  }
  return has_any;
}

}  // namespace

// NOLINTNEXTLINE(bugprone-exception-escape): running out of memory may end it
int main(int argc, char** argv) {
  const std::string_view first = argc > 1 ? argv[1] : "";
  if (first == "--device") {
    const bool is_little_endian = argc > 3 && std::string_view(argv[3]) == "little";
    if (argc < 3 || !run_devices(argv[2], is_little_endian)) return 2;
    return std::fflush(stdout) == 0 ? 0 : 1;
  }
  const std::map<std::string_view, const Catalogue*> dialects{{"iha", &vehicle_bus::catalogue},
                                                              {"original", &vehicle_bus_original::catalogue},
                                                              {"elithion", &vehicle_bus_elithion::catalogue}};
  const auto dialect = dialects.find(first);
  if (dialect == dialects.end()) return 2;
  LogMaker().run(*dialect->second);
  return std::fflush(stdout) == 0 ? 0 : 1;
}
