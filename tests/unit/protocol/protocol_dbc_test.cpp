// The DBC file, read back by a small reader that shares nothing with the writer: it walks the bits one by one as the
// DBC format numbers them, and must obtain the values that the rows decode.
#include <algorithm>
#include <map>
#include <optional>
#include <regex>
#include <set>
#include <sstream>

#include "protocol/dbc.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/worked_frames.hpp"

namespace {

using namespace bmu;
using namespace bmu::test;

struct DbcSignal {
  std::string name, multiplexing, unit;
  unsigned start = 0, length = 0;
  bool is_big_endian = false, is_signed = false;
  double factor = 0, min = 0, max = 0;
  std::map<std::int64_t, std::string> value_names;

  [[nodiscard]] std::int64_t raw(const FrameBytes& bytes) const {
    std::uint64_t value = 0;
    unsigned at = start;
    for (unsigned count = 0; count < length; ++count) {
      const std::uint64_t bit = (bytes.at(at / 8) >> (at % 8)) & 1U;
      value = is_big_endian ? (value << 1) | bit : value | (bit << count);
      at = !is_big_endian ? at + 1 : at % 8 == 0 ? at + 15 : at - 1;
    }
    const bool is_negative = is_signed && ((value >> (length - 1)) & 1U) != 0;
    return static_cast<std::int64_t>(value) - (is_negative ? std::int64_t{1} << length : 0);
  }
};

struct DbcMessage {
  std::string name, sender;
  unsigned length = 0;
  std::vector<DbcSignal> signals;

  [[nodiscard]] DbcSignal* find(std::string_view signal) {
    const auto found =
        std::find_if(signals.begin(), signals.end(), [&](const DbcSignal& s) { return s.name == signal; });
    return found == signals.end() ? nullptr : &*found;
  }
};

struct Dbc {
  std::map<unsigned, DbcMessage> messages;
  std::set<std::string> senders;
  std::map<unsigned, unsigned> cycle_ms;
};

Dbc read_dbc(const std::string& text) {
  static const std::regex message_line(R"(BO_ (\d+) (\w+): (\d) (\w+))");
  static const std::regex signal_line(
      R"( SG_ (\w+)( M| m\d+)? : (\d+)\|(\d+)@([01])([+-]) \(([^,]+),0\) \[([^|]+)\|([^\]]+)\] "([^"]*)\" Vector__XXX)");
  static const std::regex cycle_line(R"(BA_ "GenMsgCycleTime" BO_ (\d+) (\d+);)");
  static const std::regex values_line(R"(VAL_ (\d+) (\w+)(.*) ;)");
  static const std::regex one_value(R"( (-?\d+) "([^"]*)\")");
  Dbc dbc;
  std::istringstream lines(text);
  unsigned id = 0;
  for (std::string line; std::getline(lines, line);) {
    std::smatch part;
    if (std::regex_match(line, part, message_line)) {
      id = static_cast<unsigned>(std::stoul(part[1]));
      REQUIRE(dbc.messages.count(id) == 0);
      dbc.messages[id] = {part[2], part[4], static_cast<unsigned>(std::stoul(part[3])), {}};
    } else if (std::regex_match(line, part, signal_line)) {
      dbc.messages.at(id).signals.push_back({part[1],
                                             part[2],
                                             part[10],
                                             static_cast<unsigned>(std::stoul(part[3])),
                                             static_cast<unsigned>(std::stoul(part[4])),
                                             part[5] == "0",
                                             part[6] == "-",
                                             std::stod(part[7]),
                                             std::stod(part[8]),
                                             std::stod(part[9]),
                                             {}});
    } else if (std::regex_match(line, part, cycle_line)) {
      dbc.cycle_ms[static_cast<unsigned>(std::stoul(part[1]))] = static_cast<unsigned>(std::stoul(part[2]));
    } else if (std::regex_match(line, part, values_line)) {
      DbcSignal* const signal = dbc.messages.at(static_cast<unsigned>(std::stoul(part[1]))).find(part[2].str());
      REQUIRE(signal != nullptr);
      const std::string values = part[3];
      for (std::sregex_iterator at(values.begin(), values.end(), one_value), end; at != end; ++at) {
        signal->value_names[std::stoll((*at)[1])] = (*at)[2];
      }
    } else if (line.rfind("BU_:", 0) == 0) {
      std::istringstream names(line.substr(4));
      for (std::string name; names >> name;) dbc.senders.insert(name);
    } else {
      REQUIRE(line.find("SG_ ") != 1);  // a signal line this reader does not understand
      REQUIRE(line.rfind("BO_ ", 0) != 0);
    }
  }
  return dbc;
}

const std::vector<std::uint8_t> some_nodes{1, 2, 3, 63};

double shown(const SignalSpec& signal, std::int64_t value) {
  const UnitSpec& unit = spec_of(signal.unit);
  double number = static_cast<double>(value) / static_cast<double>(unit.divisor);
  for (int decimal = 0; decimal < unit.decimals; ++decimal) number /= 10;
  return number;
}

void check_worked_frame(const WorkedFrame& worked, Dbc& dbc) {
  const CanFrame frame = worked.frame();
  REQUIRE(dbc.messages.count(frame.id) == 1);
  DbcMessage& message = dbc.messages.at(frame.id);
  CHECK(message.length == frame.length);
  for (const SignalSpec& signal : worked.message->signals) {
    if (!worked.has(signal) || signal.unit == Unit::text) continue;
    INFO(message.name << " " << signal.name);
    DbcSignal* const found = message.find(name_without_unit(signal));
    REQUIRE(found != nullptr);
    CHECK(found->unit == spec_of(signal.unit).symbol);
    const std::int64_t raw = found->raw(frame.data);
    const SignalValue value = worked.value_of(signal);
    if (value.is_valid()) {
      CHECK(static_cast<double>(raw) * found->factor == Approx(shown(signal, value.value)));
      CHECK(static_cast<double>(raw) * found->factor <= found->max * (1 + 1e-12));
      CHECK(static_cast<double>(raw) * found->factor >= found->min * (1 + 1e-12));
    } else {
      CHECK(found->value_names.at(raw) == to_text(value.validity));
    }
  }
}

}  // namespace

TEST_CASE("an independent reader of the DBC decodes every worked frame alike", "[unit][protocol][dbc]") {
  Dbc internal = read_dbc(dbc_text(internal_bus::catalogue, some_nodes));
  for (const WorkedFrame& worked : internal_worked_frames()) check_worked_frame(worked, internal);
  Dbc vehicle = read_dbc(dbc_text(vehicle_bus::catalogue, some_nodes));
  for (const WorkedFrame& worked : vehicle_worked_frames()) check_worked_frame(worked, vehicle);
  Dbc elithion = read_dbc(dbc_text(vehicle_bus_elithion::catalogue, some_nodes));
  for (const WorkedFrame& worked : elithion_worked_frames()) check_worked_frame(worked, elithion);
}

TEST_CASE("the DBC has each message once for every node asked for", "[unit][protocol][dbc]") {
  const Dbc dbc = read_dbc(dbc_text(internal_bus::catalogue, some_nodes));
  CHECK(dbc.messages.at(0x143).name == "CELLS_1_N03");
  CHECK(dbc.messages.at(0x143).sender == "MMU_N03");
  CHECK(dbc.messages.at(0x17F).name == "CELLS_1_N63");
  CHECK(dbc.messages.count(0x144) == 0);
  CHECK(dbc.messages.at(0x340).name == "COMMAND_ALL");
  CHECK(dbc.messages.at(0x343).name == "COMMAND_N03");
  CHECK(dbc.messages.at(0x040).name == "CONTACTOR_COMMAND");
  CHECK(dbc.cycle_ms.at(0x040) == 50);
  CHECK(dbc.cycle_ms.count(0x143) == 0);
  for (const auto& [id, message] : dbc.messages) CHECK(dbc.senders.count(message.sender) == 1);
}

TEST_CASE("arguments of a command are multiplexed by its operation", "[unit][protocol][dbc]") {
  Dbc dbc = read_dbc(dbc_text(internal_bus::catalogue, some_nodes));
  DbcMessage& command = dbc.messages.at(0x343);
  CHECK(command.find("operation")->multiplexing == " M");
  CHECK(command.find("undervoltage_limit")->multiplexing == " m2");
  CHECK(command.find("balancing_time_12")->multiplexing == " m3");
  CHECK(command.find("counter")->multiplexing.empty());
  CHECK(command.find("crc")->start == 63);
}

TEST_CASE("names fit what DBC tools allow and are unique in their message", "[unit][protocol][dbc]") {
  for (const Catalogue* catalogue :
       {&internal_bus::catalogue, &vehicle_bus::catalogue, &vehicle_bus_elithion::catalogue}) {
    for (const auto& [id, message] : read_dbc(dbc_text(*catalogue, some_nodes)).messages) {
      std::set<std::string> names;
      CHECK(message.name.size() <= 32);
      for (const DbcSignal& signal : message.signals) {
        CHECK(signal.name.size() <= 32);
        CHECK(names.insert(signal.name).second);
      }
    }
  }
}

TEST_CASE("a little-endian sensor is little-endian in the DBC", "[unit][protocol][dbc]") {
  CanFrame frame = make_frame(internal_bus::sensor_current_le);
  write<internal_bus::sensor_current_le, "pack_current_mA">(frame, -123'456);
  Dbc dbc = read_dbc(dbc_text(internal_bus::catalogue_little_endian_sensor, some_nodes));
  DbcSignal* const current = dbc.messages.at(0x521).find("pack_current");
  CHECK_FALSE(current->is_big_endian);
  CHECK(static_cast<double>(current->raw(frame.data)) * current->factor == Approx(-123.456));
}
