// The serial console: any input is split into bounded lines, and each gets an answer that a terminal can show.
//
// Input: bytes as received. A number of cells is accepted if the first of them is even.
#include <algorithm>

#include "daemon/shell/serial/serial_commands.hpp"
#include "tests/fuzz/fuzz.hpp"

using namespace bmu;

namespace {

bool is_printable(char letter) {
  return letter >= ' ' && letter <= '~';
}

void check_text(const std::string& text) {
  FUZZ_CHECK(text.ends_with("\r\n"));
  for (const std::string_view line : fuzz::pieces_of(text, "\r\n")) {
    FUZZ_CHECK(!line.empty() && std::all_of(line.begin(), line.end(), is_printable));
  }
}

void check_answer(const SerialLine& line, bool is_taken) {
  FUZZ_CHECK(line.text.size() <= SerialLines::line_max && (line.kind == SerialLine::Kind::good || line.text.empty()));
  FUZZ_CHECK(std::all_of(line.text.begin(), line.text.end(), is_printable));
  int calls = 0;
  const SerialReply reply = answer_serial(line, [&](std::size_t count) -> Result<CellCountSet, std::string> {
    ++calls;
    FUZZ_CHECK(count >= 1 && count <= 756);
    FUZZ_CHECK(line.text.starts_with("CellC:") && std::stoul(line.text.substr(6)) == count);
    if (!is_taken) return failure(std::string("the contactors are closed"));
    return CellCountSet{.is_in_force = count % 2 == 0};
  });
  FUZZ_CHECK(calls <= 1 && (calls == 0 || reply.is_order));
  FUZZ_CHECK(reply.dumps_log == (line.text == "LogReq"));
  if (!reply.dumps_log) check_text(reply.text);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  SerialLines lines;
  for (const char byte : fuzz::text_of(data, size)) {
    const auto line = lines.take(byte);
    if (line) check_answer(*line, data[0] % 2 == 0);
  }
  lines.forget();
  FUZZ_CHECK(!lines.take('\n'));
  return 0;
}
