// Images of a core with modifications: each is refused, or the core then has exactly this image, and continues with it,
// commanding no more than it has decided.
//
// Input: the session that the image is from (1), then changes of 12 bytes: position (3), width (1), value (8).
// Positions index the bytes that are in use, or all bytes if the highest bit is set: most of an image are zeros.
#include "daemon/core/core_image.hpp"

#include <memory>
#include <optional>

#include "daemon/core/contactors/output_gate.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/support/living_pack.hpp"

using namespace bmu;

namespace {

struct Step {
  std::optional<Observation> observation;  // none: a decision
  TimePoint decided_at{};
};

struct Life {
  CoreConfig config;
  std::vector<std::uint8_t> image;
  std::vector<std::size_t> in_use;  // positions in it
  std::vector<Step> next;           // following observations and decisions
};

std::vector<std::size_t> places_in_use(const std::vector<std::uint8_t>& image) {
  constexpr std::size_t number_bytes = 8;
  std::vector<std::size_t> places;
  std::size_t used_until = 0;
  for (std::size_t at = 0; at < image.size(); ++at) {
    if (image[at] != 0) used_until = at + number_bytes;
    if (at < used_until) places.push_back(at);
  }
  return places;
}

Life life_of(const CoreConfig& config, test::CoreBench& bench) {
  Life life{.config = config, .image = std::vector<std::uint8_t>(core_image_size(bench.core()))};
  write_core_image(bench.core(), life.image);
  life.in_use = places_in_use(life.image);
  bench.on_observe = [&](const Observation& observation) { life.next.push_back({.observation = observation}); };
  bench.on_decide = [&](TimePoint at) { life.next.push_back({.decided_at = at}); };
  bench.run(100ms);
  bench.on_observe = nullptr;
  bench.on_decide = nullptr;
  return life;
}

Life make_driving() {
  CoreConfig config = test::small_pack();
  config.dynamics = test::sloped_cell();
  config.balancing.is_enabled = true;
  config.balancing.requires_closed = false;
  config.balancing.without_board_sensor = true;
  test::LivingPack pack(config, 0.6);
  pack.run(3s);
  FUZZ_CHECK(pack.bench().close());
  pack.current_A = 10.0;
  pack.run(5s);
  return life_of(config, pack.bench());
}

Life make_opening() {
  const CoreConfig config = test::small_pack();
  test::CoreBench bench(config);
  FUZZ_CHECK(bench.close());
  bench.modules[1].talks = false;
  bench.run(50ms);
  return life_of(config, bench);
}

const Life& life(std::uint8_t which) {
  static const Life driving = make_driving();
  static const Life opening = make_opening();
  return which % 2 == 0 ? driving : opening;
}

std::vector<std::uint8_t> changed(const Life& life, fuzz::Numbers& input) {
  std::vector<std::uint8_t> image = life.image;
  while (!input.is_empty()) {
    const std::size_t low = input.next<std::uint16_t>();
    const auto high = input.next<std::uint8_t>();
    const std::size_t width = std::size_t{1} << (input.next<std::uint8_t>() % 4);
    const auto value = input.next<std::uint64_t>();
    const std::size_t number = low + (std::size_t{high & 0x7FU} << 16U);
    const std::size_t place = high >= 0x80 ? number % image.size() : life.in_use[number % life.in_use.size()];
    for (std::size_t byte = 0; byte < width && place + byte < image.size(); ++byte) {
      image[place + byte] = static_cast<std::uint8_t>(value >> (8 * byte));
    }
  }
  return image;
}

bool closes_more(const ContactorOutputs& commanded, const ContactorOutputs& decided) {
  return (commanded.main_positive && !decided.main_positive) || (commanded.main_negative && !decided.main_negative) ||
         (commanded.precharge && !decided.precharge) || (commanded.charge && !decided.charge);
}

void check_decisions(const Decisions& decisions) {
  for (const OutgoingFrame& sent : decisions.frames) {
    const bool is_command = sent.port == Port::internal && sent.frame.id == internal_bus::contactor_command.base_id;
    if (is_command) FUZZ_CHECK(!closes_more(outputs_of(sent.frame), decisions.outputs));
  }
  for (const Event& event : decisions.events) FUZZ_CHECK(!to_text(event).empty());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Numbers input(data, size);
  const Life& before = life(input.next<std::uint8_t>());
  const std::vector<std::uint8_t> image = changed(before, input);
  const auto core = std::make_unique<Core>(before.config, TimePoint{});
  if (read_core_image(image, *core)) {
    FUZZ_CHECK(image != before.image);
    return 0;
  }
  std::vector<std::uint8_t> written(core_image_size(*core));
  write_core_image(*core, written);
  FUZZ_CHECK(written == image);
  for (const Step& step : before.next) {
    if (step.observation) {
      static_cast<void>(core->observe(*step.observation));
    } else {
      check_decisions(core->decide(step.decided_at));
    }
  }
  return 0;
}
