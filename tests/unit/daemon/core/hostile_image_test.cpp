// Constructed images of a core: of the right length and with the right checksum, but with values that no core has. Each
// is rejected, or the core decides without any error that a sanitizer or an assertion would detect.
//
// Cases run in a separate process, so that one that crashes is a failed check with its seed.
//   BMUD_SEED=n      runs case n alone
//   BMUD_ROUNDS=n    runs n cases of each session instead of a few
#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include "daemon/core/core_image.hpp"
#include "daemon/core/records/event.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"
#include "tests/support/living_pack.hpp"

using namespace bmu;
using test::Chance;
using test::CoreBench;

namespace {

// --- position of each member in an image ----------------------------------------------------------------------------

enum class Kind : std::uint8_t { whole, floating };

struct Place {
  std::size_t at = 0;
  std::size_t size = 0;
  Kind kind = Kind::whole;
};

/// Positions of each member, for all items of an array together.
using Places = std::map<std::uint64_t, std::vector<Place>>;

class Walk {
 public:
  explicit Walk(Places& places) : places_(places) {}

  template <class T>
  void of(const T& value, std::uint64_t path) {
    if constexpr (is_skipped<T>) {
    } else if constexpr (image::is_optional<T>) {
      of(value.has_value(), path);
      if (value.has_value()) of(*value, inner(path, 1));
    } else if constexpr (image::is_variant<T>) {
      of(std::uint8_t{0}, path);
      std::visit([&](const auto& held) { of(held, inner(path, 1)); }, value);
    } else if constexpr (image::is_array<T>) {
      for (const auto& item : value) of(item, inner(path, 1));
    } else if constexpr (image::is_fixed_vector<T>) {
      of(std::uint64_t{0}, path);
      for (const auto& item : value) of(item, inner(path, 1));
    } else if constexpr (std::is_class_v<T> && !image::is_duration<T> && !image::is_time_point<T>) {
      std::uint64_t number = 0;
      take_fields(value, [&](const auto&... fields) { (of(fields, inner(path, ++number)), ...); });
    } else {
      const std::size_t size = image_size(value);
      places_[path].push_back(
          {.at = at_, .size = size, .kind = std::is_floating_point_v<T> ? Kind::floating : Kind::whole});
      at_ += size;
    }
  }
  [[nodiscard]] std::size_t end() const { return at_; }

 private:
  static std::uint64_t inner(std::uint64_t path, std::uint64_t number) { return (path ^ number) * 0x100000001b3ULL; }

  Places& places_;
  std::size_t at_ = 0;
};

// --- a session and its continuation ---------------------------------------------------------------------------------

/// Either an observation or the time of a decision.
struct Step {
  std::optional<Observation> observation;
  TimePoint decided_at{};
};

struct Life {
  CoreConfig config;
  std::vector<std::uint8_t> image;
  Places places;
  std::vector<Step> next;

  /// Image of the core as it is now, and its observations while `go_on` runs.
  Life(const CoreConfig& the_config, CoreBench& bench, const std::function<void()>& go_on)
      : config(the_config), image(core_image_size(bench.core())) {
    write_core_image(bench.core(), image);
    Walk walk(places);
    walk.of(bench.core(), 1);
    REQUIRE(walk.end() == image.size());
    bench.on_observe = [this](const Observation& observation) { next.push_back({.observation = observation}); };
    bench.on_decide = [this](TimePoint at) { next.push_back({.decided_at = at}); };
    go_on();
    bench.on_observe = nullptr;
    bench.on_decide = nullptr;
  }
};

/// Whether the image is accepted. The core then decides on the recorded steps, and all its events are rendered as text.
bool runs(const Life& life, const std::vector<std::uint8_t>& image) {
  const auto core = std::make_unique<Core>(life.config, TimePoint{});
  if (read_core_image(image, *core)) return false;
  std::size_t told = 0;
  for (const Step& step : life.next) {
    if (step.observation) {
      static_cast<void>(core->observe(*step.observation));
      continue;
    }
    for (const Event& event : core->decide(step.decided_at).events) told += to_text(event).size();
  }
  std::vector<std::uint8_t> after(core_image_size(*core));
  write_core_image(*core, after);
  return told < after.size();
}

// --- constructed values ---------------------------------------------------------------------------------------------

class Forger {
 public:
  explicit Forger(std::uint64_t seed) : chance_(seed) {}

  [[nodiscard]] std::vector<std::uint8_t> forged(const Life& life) {
    std::vector<std::uint8_t> image = life.image;
    const std::size_t changes = 1 + below(3);
    for (std::size_t change = 0; change < changes; ++change) {
      if (below(8) == 0) {
        image[below(image.size())] ^= static_cast<std::uint8_t>(1U << below(8));
      } else {
        put_value(image, place_in(life.places));
      }
    }
    return image;
  }

 private:
  std::size_t below(std::size_t end) { return static_cast<std::size_t>(chance_.even() * static_cast<double>(end)); }

  /// Selects each member equally often; of arrays mostly the first items, which the pack uses.
  const Place& place_in(const Places& places) {
    auto member = places.begin();
    std::advance(member, static_cast<std::ptrdiff_t>(below(places.size())));
    const std::vector<Place>& of_member = member->second;
    const std::size_t first = std::min<std::size_t>(of_member.size(), 8);
    return of_member[below(below(3) == 0 ? of_member.size() : first)];
  }

  void put_value(std::vector<std::uint8_t>& image, const Place& place) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, image.data() + place.at, place.size);
    bits = place.kind == Kind::floating ? floating(bits) : whole(bits, place.size * 8);
    std::memcpy(image.data() + place.at, &bits, place.size);
  }

  std::uint64_t any() { return (std::uint64_t{below(1ULL << 32)} << 32) | below(1ULL << 32); }

  std::uint64_t whole(std::uint64_t before, std::size_t width) {
    const std::uint64_t top = std::uint64_t{1} << (width - 1);
    switch (below(10)) {
      case 0: return 0;
      case 1: return 1;
      case 2: return ~std::uint64_t{0};
      case 3: return top;
      case 4: return top - 1;
      case 5: return before ^ (std::uint64_t{1} << below(width));
      case 6: return before + 1;
      case 7: return ~before;
      case 8: return std::uint64_t{1} << below(width);
      default: return any();
    }
  }
  std::uint64_t floating(std::uint64_t before) {
    double number = 0.0;
    std::memcpy(&number, &before, sizeof(number));
    switch (below(12)) {
      case 0: number = 0.0; break;
      case 1: number = -1.0; break;
      case 2: number = 1e-300; break;
      case 3: number = -1e15; break;
      case 4: number = 1e15; break;
      case 5: number = 1e300; break;
      case 6: number = std::numeric_limits<double>::infinity(); break;
      case 7: number = std::numeric_limits<double>::quiet_NaN(); break;
      case 8: number = -number; break;
      case 9: number *= 1e6; break;
      case 10: number = number * 1e-9 - 1e-9; break;
      default: return any();
    }
    std::memcpy(&before, &number, sizeof(number));
    return before;
  }

  Chance chance_;
};

struct Failed {
  std::uint64_t number = 0;
  int code = 0;  // exit code of its process, or 128 and the signal
};

struct Outcome {
  std::uint64_t taken = 0;
  std::vector<Failed> failed;
};

/// Runs cases in a separate process; if one crashes, the others continue in the next process.
class Apart {
 public:
  /// The image of case `number`.
  using Forge = std::function<std::vector<std::uint8_t>(std::uint64_t number)>;

  Apart() : shared_(::mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0)) {
    REQUIRE(shared_ != MAP_FAILED);
  }
  Apart(const Apart&) = delete;
  Apart& operator=(const Apart&) = delete;
  ~Apart() { ::munmap(shared_, sizeof(Shared)); }

  [[nodiscard]] Outcome run(const Life& life, std::uint64_t first, std::uint64_t end, const Forge& forge) {
    Outcome outcome;
    now() = {.number = first};
    while (now().number < end) {
      const int code = run_some(life, end, forge);
      if (now().number < end) outcome.failed.push_back({now().number++, code});
    }
    outcome.taken = now().taken;
    return outcome;
  }

 private:
  struct Shared {
    std::uint64_t number = 0;  // the running case
    std::uint64_t taken = 0;
  };
  static constexpr unsigned longest_s = 60;  // a case that does not end has failed, too

  [[nodiscard]] Shared& now() { return *static_cast<Shared*>(shared_); }

  int run_some(const Life& life, std::uint64_t end, const Forge& forge) {
    const pid_t child = ::fork();
    if (child == 0) {
      for (; now().number < end; ++now().number) {
        ::alarm(longest_s);
        if (runs(life, forge(now().number))) ++now().taken;
      }
      ::_exit(0);
    }
    REQUIRE(child > 0);
    int status = 0;
    while (::waitpid(child, &status, 0) < 0) REQUIRE(errno == EINTR);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

  void* shared_;
};

std::uint64_t number_of(const char* name, std::uint64_t otherwise) {
  const char* const text = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): one thread
  return text == nullptr ? otherwise : std::strtoull(text, nullptr, 10);
}

void check_forged(const Life& life) {
  REQUIRE(runs(life, life.image));  // unchanged
  const std::uint64_t wanted = number_of("BMUD_SEED", 0);
  const std::uint64_t first = wanted == 0 ? 1 : wanted;
  const std::uint64_t rounds = wanted == 0 ? number_of("BMUD_ROUNDS", 60) : 1;
  const Outcome outcome =
      Apart().run(life, first, first + rounds, [&](std::uint64_t seed) { return Forger(seed).forged(life); });
  for (const Failed& failed : outcome.failed) {
    FAIL_CHECK("seed " << failed.number << " ended with " << failed.code);
  }
  // A check that rejects every image would detect nothing.
  if (wanted == 0) CHECK(outcome.taken > rounds / 10);
}

/// Overwrites every member in turn, at its first position in the image.
void check_each_member(const Life& life, std::uint8_t byte) {
  std::vector<Place> places;
  for (const auto& [path, of_member] : life.places) places.push_back(of_member.front());
  const Outcome outcome = Apart().run(life, 0, places.size(), [&](std::uint64_t number) {
    std::vector<std::uint8_t> image = life.image;
    const Place& place = places[number];
    std::fill_n(image.begin() + static_cast<std::ptrdiff_t>(place.at), place.size, byte);
    return image;
  });
  for (const Failed& failed : outcome.failed) {
    const Place& place = places[failed.number];
    FAIL_CHECK(place.size << " bytes from " << place.at << " of " << int{byte} << " ended with " << failed.code);
  }
  CHECK(outcome.taken > places.size() / 10);
}

CoreConfig pack_with_tables() {
  CoreConfig config = test::small_pack();
  config.dynamics = test::sloped_cell();
  config.cell.capacity_uAs = std::llround(config.dynamics->capacity_As * 1e6);
  return config;
}

}  // namespace

TEST_CASE("made-up images of a pack that drives do no harm", "[unit][core][image][recording]") {
  const CoreConfig config = pack_with_tables();
  test::LivingPack pack(config, 0.6);
  pack.run(3s);
  REQUIRE(pack.bench().close());
  pack.current_A = 10.0;
  pack.run(30s);
  REQUIRE(pack.estimate().pack().is_known);
  const Life life(config, pack.bench(), [&] {
    pack.current_A = 20.0;
    pack.run(2s);
  });
  check_forged(life);
}

TEST_CASE("made-up images of a pack that opens do no harm", "[unit][core][image][recording]") {
  const CoreConfig config = test::small_pack();
  CoreBench bench(config);
  REQUIRE(bench.close());
  bench.modules[1].talks = false;
  bench.run(50ms);
  const Life life(config, bench, [&] {
    bench.run(1s);
    bench.modules[1].talks = true;
    bench.give(Command::clear_faults);
    bench.run(1s);
  });
  check_forged(life);
}

TEST_CASE("made-up images of a pack that rests do no harm", "[unit][core][image][recording]") {
  CoreConfig config = pack_with_tables();
  config.balancing.is_enabled = true;
  config.balancing.method = BalancingMethod::charge;
  config.balancing.requires_closed = false;
  config.balancing.without_board_sensor = true;
  config.soc.rest = 10s;
  test::LivingPack pack(config, 0.6);
  pack.run(60s);
  REQUIRE(pack.core().cell_charges().known_cells() == 8);
  const Life life(config, pack.bench(), [&] { pack.run(3s); });
  check_forged(life);
}

TEST_CASE("made-up images of a pack that balances do no harm", "[unit][core][image][recording]") {
  CoreConfig config = test::small_pack();
  config.balancing.is_enabled = true;
  config.balancing.requires_closed = false;
  config.balancing.without_board_sensor = true;
  CoreBench bench(config);
  bench.modules[0].cell_voltage_uV[2] = known(3'900'000);
  REQUIRE(bench.run_until([&] { return bench.core().balancing().cells_told() > 0; }, 2min));
  const Life life(config, bench, [&] { bench.run(3s); });
  check_forged(life);
}

TEST_CASE("no member that somebody makes up does harm, whichever it is", "[unit][core][image][recording][slow]") {
  CoreConfig config = pack_with_tables();
  config.balancing.is_enabled = true;
  config.balancing.requires_closed = false;
  config.balancing.without_board_sensor = true;
  test::LivingPack pack(config, 0.6);
  pack.run(3s);
  REQUIRE(pack.bench().close());
  pack.current_A = 5.0;
  pack.run(30s);
  const Life life(config, pack.bench(), [&] {
    pack.run(1s);
    pack.bench().modules[1].talks = false;
    pack.run(500ms);
  });
  CHECK(life.places.size() > 500);
  for (const int byte : {0xff, 0x21, 0x00}) check_each_member(life, static_cast<std::uint8_t>(byte));
}
