// A core restored from an image taken in the middle of a session continues exactly like the original.
#include "daemon/core/core_image.hpp"

#include <memory>
#include <vector>

#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"
#include "tests/support/living_pack.hpp"

using namespace bmu;
using test::CoreBench;

namespace {

std::vector<std::uint8_t> image_of(const Core& core) {
  std::vector<std::uint8_t> bytes(core_image_size(core));
  write_core_image(core, bytes);
  return bytes;
}

/// Second core that receives the same observations as the first one.
class Twin {
 public:
  Twin(const CoreConfig& config, CoreBench& bench) : core_(std::make_unique<Core>(config, TimePoint{})) {
    const std::vector<std::uint8_t> bytes = image_of(bench.core());
    REQUIRE_FALSE(read_core_image(bytes, *core_));
    CHECK(image_of(*core_) == bytes);
    bench.on_observe = [this](const Observation& observation) { static_cast<void>(core_->observe(observation)); };
    bench.on_decide = [this](TimePoint at) {
      for (const OutgoingFrame& frame : core_->decide(at).frames) sent_.push_back(frame);
    };
    sent_before_ = bench.sent().size();
    bench_ = &bench;
  }
  ~Twin() {
    bench_->on_observe = nullptr;
    bench_->on_decide = nullptr;
  }
  Twin(const Twin&) = delete;
  Twin& operator=(const Twin&) = delete;

  void check() const {
    const std::vector<OutgoingFrame>& first = bench_->sent();
    REQUIRE(first.size() - sent_before_ == sent_.size());
    CHECK_FALSE(sent_.empty());
    for (std::size_t index = 0; index < sent_.size(); ++index) {
      const CanFrame& one = first[sent_before_ + index].frame;
      REQUIRE(one.id == sent_[index].frame.id);
      REQUIRE(one.data == sent_[index].frame.data);
    }
    CHECK(image_of(*core_) == image_of(bench_->core()));
  }

 private:
  std::unique_ptr<Core> core_;
  CoreBench* bench_ = nullptr;
  std::vector<OutgoingFrame> sent_;
  std::size_t sent_before_ = 0;
};

}  // namespace

TEST_CASE("a core read from its image decides as the first does, whenever it was written", "[unit][core][image]") {
  const CoreConfig config = test::small_pack();
  CoreBench bench(config);
  const auto go_on = [&](Duration duration) {
    Twin twin(config, bench);
    bench.run(duration);
    twin.check();
  };
  go_on(500ms);  // before anything is complete
  go_on(2s);
  bench.inputs.vehicle_on = true;
  go_on(200ms);  // in the middle of closing
  go_on(2s);
  REQUIRE(bench.core().sequence().phase == Phase::closed);
  bench.current_mA = 40'000;
  go_on(5s);
  bench.modules[1].talks = false;
  go_on(100ms);  // while a fault is pending
  go_on(2s);
  REQUIRE(bench.core().sequence().phase == Phase::open);
  bench.modules[1].talks = true;
  bench.give(Command::clear_faults);
  go_on(20s);
  bench.give(Command::shut_down);
  go_on(1s);
}

TEST_CASE("the estimates of cells go on from an image, too", "[unit][core][image]") {
  CoreConfig config = test::small_pack();
  config.dynamics = test::sloped_cell();
  config.cell.capacity_uAs = std::llround(config.dynamics->capacity_As * 1e6);
  test::LivingPack pack(config, 0.6);
  pack.run(3s);
  REQUIRE(pack.bench().close());
  pack.current_A = 10.0;
  pack.run(60s);
  REQUIRE(pack.estimate().pack().is_known);
  Twin twin(config, pack.bench());
  for (int turn = 0; turn < 6; ++turn) {
    pack.current_A = turn % 2 == 0 ? 20.0 : 0.0;
    pack.run(10s);
  }
  twin.check();
}

TEST_CASE("an image of a parked pack knows at which pace it is asked", "[unit][core][image]") {
  CoreConfig config = test::small_pack();
  config.poll.parked_period = 5s;
  CoreBench bench(config);
  bench.run(60s);
  REQUIRE(bench.core().config().ages.cell_voltage != config.ages.cell_voltage);
  Twin twin(config, bench);
  bench.run(200ms);
  twin.check();
  bench.run(20s);
  twin.check();
}

TEST_CASE("an image that ends too soon is refused wherever it ends", "[unit][core][image]") {
  const CoreConfig config = test::small_pack();
  const CoreBench bench(config);
  const std::vector<std::uint8_t> bytes = image_of(bench.core());
  const auto other = std::make_unique<Core>(config, TimePoint{});
  for (std::size_t size = 0; size < bytes.size(); size += 9'973) {
    const std::span<const std::uint8_t> part(bytes.data(), size);
    CHECK(read_core_image(part, *other) == ImageProblem::too_short);
  }
}

TEST_CASE("an image of a pack with other modules is refused", "[unit][core][image]") {
  const CoreBench bench(test::pack_of(3));
  const std::vector<std::uint8_t> bytes = image_of(bench.core());
  const auto other = std::make_unique<Core>(test::pack_of(2), TimePoint{});
  CHECK(read_core_image(bytes, *other) == ImageProblem::no_state);
}
