// Cost of one frame at each step: parsing a log line, the receive check, decoding, encoding, and its text.
#include <array>
#include <string_view>
#include <vector>

#include <benchmark/benchmark.h>
#include <fcntl.h>

#include "protocol/candump.hpp"
#include "protocol/receive_check.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "tools/bmudump/frame_text.hpp"

namespace {

using namespace bmu;

constexpr std::string_view cells_line = "(1700000000.123456) vcan0 143#8EA08E928EB22AB2";

CanFrame sealed_cells(std::uint8_t counter) {
  CanFrame frame = make_frame(internal_bus::cells_1, 3);
  write<internal_bus::cells_1, "cell_voltage_1_uV">(frame, 3'651'200);
  write<internal_bus::cells_1, "cell_voltage_2_uV">(frame, 3'649'800);
  write<internal_bus::cells_1, "cell_voltage_3_uV">(frame, 3'653'000);
  seal(internal_bus::cells_1, counter, frame);
  return frame;
}

void encode_frame(benchmark::State& state) {
  std::uint8_t counter = 0;
  for ([[maybe_unused]] auto _ : state) benchmark::DoNotOptimize(sealed_cells(++counter));
}
BENCHMARK(encode_frame);

void decode_frame(benchmark::State& state) {
  CanFrame frame = sealed_cells(1);
  for ([[maybe_unused]] auto _ : state) {
    benchmark::DoNotOptimize(frame);
    for (const SignalSpec& signal : internal_bus::cells_1.signals) {
      benchmark::DoNotOptimize(decode_signal(signal, frame.data));
    }
  }
}
BENCHMARK(decode_frame);

void check_frame(benchmark::State& state) {
  ReceiveCheck check(internal_bus::catalogue, ReceiveCheck::Role::listener);
  const std::array<CanFrame, 2> frames{sealed_cells(1), sealed_cells(2)};
  std::size_t turn = 0;
  for ([[maybe_unused]] auto _ : state) benchmark::DoNotOptimize(check.check(frames[turn ^= 1]));
}
BENCHMARK(check_frame);

void parse_line(benchmark::State& state) {
  for ([[maybe_unused]] auto _ : state) benchmark::DoNotOptimize(parse_log_line(cells_line));
}
BENCHMARK(parse_line);

/// Prints one frame in each form of output, which is discarded.
template <void (*Print)(dump::FrameText&, const dump::SeenFrame&, dump::TextWriter&)>
void print_line(benchmark::State& state) {
  const dump::DumpCatalogue catalogue({});
  dump::LineStart start({});
  dump::FrameText format(catalogue, {}, start);
  dump::TextWriter out(::open("/dev/null", O_WRONLY | O_CLOEXEC));
  const auto line = parse_log_line(cells_line);
  ReceiveCheck check(catalogue.all(), ReceiveCheck::Role::listener);
  const CheckedFrame verdict = check.check(line->frame);
  for ([[maybe_unused]] auto _ : state) Print(format, {*line, verdict}, out);
}
void as_text(dump::FrameText& format, const dump::SeenFrame& seen, dump::TextWriter& out) {
  format.print_text(seen, out);
}
void as_json(dump::FrameText& format, const dump::SeenFrame& seen, dump::TextWriter& out) {
  format.print_json(seen, out);
}
BENCHMARK(print_line<as_text>)->Name("print_text");
BENCHMARK(print_line<as_json>)->Name("print_json");

}  // namespace
