// Lines from the bytes of a serial port, and the replies to them.
#include "daemon/shell/serial/serial_lines.hpp"

#include <string>
#include <string_view>
#include <vector>

#include "daemon/shell/serial/serial_commands.hpp"
#include "tests/support/catch.hpp"

namespace bmu {
namespace {

using Kind = SerialLine::Kind;

std::vector<std::string> texts(SerialLines& lines, std::string_view bytes) {
  std::vector<std::string> all;
  for (const char byte : bytes) {
    const auto line = lines.take(byte);
    if (!line) continue;
    const bool is_good = line->kind == Kind::good;
    all.push_back(is_good ? line->text : line->kind == Kind::too_long ? "<too long>" : "<unprintable>");
    if (!is_good) CHECK(line->text.empty());
  }
  return all;
}
std::vector<std::string> texts(std::string_view bytes) {
  SerialLines lines;
  return texts(lines, bytes);
}

using Texts = std::vector<std::string>;

/// Accepts any number of cells and stores the last.
struct Taker {
  std::size_t wanted = 0;
  bool is_in_force = false;
  std::string refusal;

  std::string ask(const std::string& line) {
    const SetCellCount set = [this](std::size_t count) -> Result<CellCountSet, std::string> {
      wanted = count;
      if (!refusal.empty()) return failure(refusal);
      return CellCountSet{.is_in_force = is_in_force};
    };
    return answer_serial({.text = line}, set).text;
  }
};

SerialReply reply_to(const SerialLine& line) {
  return answer_serial(line, [](std::size_t) -> Result<CellCountSet, std::string> { return CellCountSet{}; });
}

}  // namespace

TEST_CASE("a line ends with CR, LF or both, and empty ones are none", "[unit][serial][BMS_NF.5]") {
  CHECK(texts("Help\rLogReq\nCellC:06\r\nHelp\n\r") == Texts{"Help", "LogReq", "CellC:06", "Help"});
  CHECK(texts("\r\n\r\r\n\n").empty());
  CHECK(texts("half").empty());
  CHECK(texts(" a b ~\n") == Texts{" a b ~"});
}

TEST_CASE("a line that is too long is dropped whole and told once, however long it goes on",
          "[unit][serial][BMS_NF.5]") {
  const std::string longest(SerialLines::line_max, 'x');
  CHECK(texts(longest + "\nHelp\n") == Texts{longest, "Help"});
  CHECK(texts(longest + "x\nHelp\n") == Texts{"<too long>", "Help"});
  const std::string endless(1'000'000, 'H');
  CHECK(texts(endless + "\nHelp\n") == Texts{"<too long>", "Help"});
  // The end of a line that is too long is not a command.
  CHECK(texts(longest + "LogReq\r\n") == Texts{"<too long>"});
  CHECK(texts(std::string(1'000'000, 'H')).empty());
}

TEST_CASE("a byte that no keyboard sends drops its line, wherever it stands", "[unit][serial][BMS_NF.5]") {
  for (int value = 0; value < 256; ++value) {
    const char byte = static_cast<char>(value);
    if (byte == '\r' || byte == '\n' || (byte >= ' ' && byte <= '~')) continue;
    CAPTURE(value);
    CHECK(texts(std::string("Log") + byte + "Req\nHelp\n") == Texts{"<unprintable>", "Help"});
    CHECK(texts(std::string(1, byte) + "\n") == Texts{"<unprintable>"});
  }
}

TEST_CASE("what somebody began who hung up is not completed by the next one", "[unit][serial][BMS_NF.5]") {
  SerialLines lines;
  CHECK(texts(lines, "CellC:1").empty());
  lines.forget();
  CHECK(texts(lines, "2\nHelp\n") == Texts{"2", "Help"});
  CHECK(texts(lines, std::string(100, 'x')).empty());
  lines.forget();
  CHECK(texts(lines, "Help\r") == Texts{"Help"});
  lines.forget();
  CHECK(texts(lines, "\nHelp\n") == Texts{"Help"});
}

TEST_CASE("Service switches the measured values on and off, and nothing else does", "[unit][serial][BMS_NF.5b]") {
  const SerialReply on = reply_to({.text = "Service:on"});
  CHECK(on.service == true);
  CHECK(on.is_order);
  CHECK(on.text == "Service on: measured values once per second\r\n");
  const SerialReply off = reply_to({.text = "Service:off"});
  CHECK(off.service == false);
  CHECK(off.text == "Service off\r\n");
  const SerialReply neither = reply_to({.text = "Service:On"});
  CHECK_FALSE(neither.service.has_value());
  CHECK(neither.text == "Refused: found \"On\", expected on or off, e.g. Service:on\r\n");
  for (const char* line : {"Service", "service:on", "Help", "LogReq", "CellC:06"}) {
    CAPTURE(line);
    CHECK_FALSE(reply_to({.text = line}).service.has_value());
  }
  CHECK(reply_to({.text = "Help"}).text.find("Service:on") != std::string::npos);
}

TEST_CASE("CellC is acknowledged in the words of the requirement, and says when it is in force",
          "[unit][serial][BMS_NF.5]") {
  Taker taker{.is_in_force = true};
  CHECK(taker.ask("CellC:12") == "New Cell Count:12\r\n");
  CHECK(taker.wanted == 12);
  CHECK(taker.ask("CellC:6") == "New Cell Count:06\r\n");
  CHECK(taker.ask("CellC:06") == "New Cell Count:06\r\n");
  CHECK(taker.ask("CellC:756") == "New Cell Count:756\r\n");
  taker.is_in_force = false;
  CHECK(taker.ask("CellC:08") == "New Cell Count:08\r\nEffective after a restart of bmud.\r\n");
  taker.refusal = "the contactors are closed";
  CHECK(taker.ask("CellC:08") == "Refused: the contactors are closed\r\n");
}

TEST_CASE("a CellC without a number of cells is refused, and nobody is asked", "[unit][serial][BMS_NF.5]") {
  Taker taker;
  for (const char* argument :
       {"", "0", "00", "757", "999", "0012", "-1", "+6", " 6", "6 ", "6x", "0x6", "6.0", "six"}) {
    CAPTURE(argument);
    CHECK(taker.ask(std::string("CellC:") + argument) ==
          "Refused: found \"" + std::string(argument) + "\", expected a cell count from 1 to 756, e.g. CellC:06\r\n");
  }
  CHECK(taker.wanted == 0);
}

TEST_CASE("Help names every command, and what is none is said to be none", "[unit][serial][BMS_NF.5]") {
  const std::string help = reply_to({.text = "Help"}).text;
  for (const char* name : {"CellC:xx", "LogReq", "Help"}) CHECK(help.find(name) != std::string::npos);
  CHECK(reply_to({.text = "LogReq"}).dumps_log);
  CHECK(reply_to({.text = "LogReq"}).text.empty());
  for (const char* line : {"help", "HELP", "Help ", " Help", "Helpx", "LogReq:", "CellC", "cellc:6", "x"}) {
    CAPTURE(line);
    const SerialReply reply = reply_to({.text = line});
    CHECK(reply.text == "Unknown command \"" + std::string(line) + "\" (Help lists the commands)\r\n");
    CHECK_FALSE(reply.dumps_log);
    CHECK_FALSE(reply.is_order);
  }
  CHECK(reply_to({.kind = Kind::too_long}).text ==
        "Too long: a line has at most 64 characters (Help lists the commands)\r\n");
  CHECK(reply_to({.kind = Kind::unprintable}).text.starts_with("Unreadable characters: "));
}

}  // namespace bmu
