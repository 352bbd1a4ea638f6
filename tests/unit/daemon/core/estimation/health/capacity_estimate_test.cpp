// Cell capacity from pairs of anchors: compared with results by hand, or with the cell that generated the pairs.
#include "daemon/core/estimation/health/capacity_estimate.hpp"

#include <cmath>
#include <limits>
#include <vector>

#include "daemon/core/cell/cell_dynamics.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/simulated_cell.hpp"

using namespace bmu;
using test::Chance;

namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr double rated_As = 36'000.0;

CapacityPrior prior_of(double sigma_share) {
  return {.capacity_As = rated_As,
          .sigma_share = sigma_share,
          .rated_As = rated_As,
          .common_share = 0.0,
          .loss_share_per_cycle = 0.0,
          .loss_share_per_year = 0.0};
}

CapacityEstimate estimate_of(const CapacityPrior& prior, const std::vector<CapacityPair>& pairs = {}) {
  CapacityEstimate estimate;
  estimate.begin(prior);
  for (const CapacityPair& pair : pairs) CHECK(estimate.take(pair));
  return estimate;
}

/// Measurement of the capacity over the full range, relative to the rated one.
CapacityPair measured(double share, double sigma_share) {
  return {.charge_As = share * rated_As,
          .charge_sigma_As = sigma_share * rated_As,
          .soc_change = 1.0,
          .soc_change_sigma = 0.0};
}

}  // namespace

TEST_CASE("before the first pair the capacity is the prior's, as unsure as that", "[unit][estimators][BMS_F.6]") {
  for (const double sigma_share : {0.002, 0.005, 0.012, 0.02, 0.05}) {
    const CapacityEstimate estimate = estimate_of(prior_of(sigma_share));
    INFO(sigma_share);
    CHECK(estimate.is_known());
    CHECK(estimate.pairs() == 0);
    CHECK(estimate.capacity_As() == Approx(rated_As).epsilon(1e-6));
    CHECK(estimate.sigma_As() == Approx(sigma_share * rated_As).epsilon(0.05));
  }
}

TEST_CASE("a prior that is none gives nothing, and pairs are passed over", "[unit][estimators][BMS_F.6]") {
  CapacityEstimate unborn;
  CHECK_FALSE(unborn.is_known());
  CHECK_FALSE(unborn.take(measured(1.0, 0.01)));
  CHECK(unborn.refused() == 0);
  CHECK(unborn.capacity_As() == 0.0);
  CHECK(unborn.sigma_As() == 0.0);
  const auto is_known = [](const CapacityPrior& prior) { return estimate_of(prior).is_known(); };
  CapacityPrior prior = prior_of(0.05);
  CHECK(is_known(prior));
  for (const double wrong : {0.0, -1.0, not_measured, infinite}) {
    CAPTURE(wrong);
    prior = prior_of(0.05);
    prior.rated_As = wrong;
    CHECK_FALSE(is_known(prior));
    prior = prior_of(0.05);
    prior.capacity_As = wrong;
    CHECK_FALSE(is_known(prior));
  }
  for (const double wrong : {0.0, -0.1, not_measured}) CHECK_FALSE(is_known(prior_of(wrong)));
  for (const double wrong : {-0.001, not_measured}) {
    prior = prior_of(0.05);
    prior.common_share = wrong;
    CHECK_FALSE(is_known(prior));
    prior = prior_of(0.05);
    prior.loss_share_per_cycle = wrong;
    CHECK_FALSE(is_known(prior));
    prior = prior_of(0.05);
    prior.loss_share_per_year = wrong;
    CHECK_FALSE(is_known(prior));
  }
  prior = prior_of(0.05);
  prior.capacity_As = 0.31 * rated_As;
  CHECK(is_known(prior));
  prior.capacity_As = 0.29 * rated_As;
  CHECK_FALSE(is_known(prior));
  prior.capacity_As = 1.29 * rated_As;
  CHECK(is_known(prior));
  prior.capacity_As = 1.31 * rated_As;
  CHECK_FALSE(is_known(prior));
}

TEST_CASE("pairs and prior are weighted by what they are sure of", "[unit][estimators][BMS_F.6]") {
  // Two normally distributed measurements: weights 1/4 and 1/1 of 2 % and 1 %.
  const CapacityEstimate estimate = estimate_of(prior_of(0.02), {measured(0.95, 0.01)});
  CHECK(estimate.pairs() == 1);
  CHECK(estimate.capacity_As() == Approx((1.0 / 4.0 * 1.0 + 1.0 * 0.95) / 1.25 * rated_As).epsilon(1e-4));
  CHECK(estimate.sigma_As() == Approx(0.01 / std::sqrt(1.25) * rated_As).epsilon(1e-3));
}

TEST_CASE("a pair of two anchors tells a capacity, charged or discharged, as sure as both errors allow",
          "[unit][estimators][BMS_F.6]") {
  for (const double sign : {1.0, -1.0}) {
    // 60 % of 32.4 kAs. The charge is uncertain by 1 %, which is 324 As of that capacity, the SOC change by 2 %.
    const CapacityPair pair{.charge_As = sign * 19'440.0,
                            .charge_sigma_As = 0.01 * 19'440.0,
                            .soc_change = sign * 0.6,
                            .soc_change_sigma = 0.02 * 0.6};
    const CapacityEstimate estimate = estimate_of(prior_of(10.0), {pair});
    CHECK(estimate.capacity_As() == Approx(32'400.0).epsilon(1e-3));
    CHECK(estimate.sigma_As() == Approx(32'400.0 * std::hypot(0.01, 0.02)).epsilon(0.03));
  }
}

TEST_CASE("errors of the state of charge do not bias the capacity, as they do in least squares",
          "[unit][estimators][BMS_F.6]") {
  constexpr std::uint64_t seed = 11;
  CAPTURE(seed);
  Chance chance(seed);
  constexpr double true_As = 0.6 * rated_As;
  CapacityEstimate estimate = estimate_of(prior_of(0.3));
  double xy = 0.0;
  double xx = 0.0;
  for (int k = 0; k < 4'000; ++k) {
    const double change = chance.between(0.25, 0.35);
    const double seen = change + 0.04 * chance.normal();
    const double charge_As = true_As * change + 100.0 * chance.normal();
    xy += seen * charge_As;
    xx += seen * seen;
    static_cast<void>(estimate.take(
        {.charge_As = charge_As, .charge_sigma_As = 100.0, .soc_change = seen, .soc_change_sigma = 0.04}));
  }
  CHECK(xy / xx < 0.985 * true_As);
  CHECK(estimate.capacity_As() == Approx(true_As).epsilon(0.006));
}

TEST_CASE("the truth is within two of the told sigmas about as often as it should be", "[unit][estimators][BMS_F.6]") {
  constexpr std::uint64_t seed = 12;
  CAPTURE(seed);
  Chance chance(seed);
  int inside = 0;
  constexpr int trials = 400;
  for (int trial = 0; trial < trials; ++trial) {
    const double share = 1.0 - 0.05 * chance.normal();
    CapacityEstimate estimate = estimate_of(prior_of(0.05));
    for (int k = 0; k < 6; ++k) {
      const double change = chance.between(-0.8, -0.3);
      static_cast<void>(estimate.take({.charge_As = share * rated_As * change + 200.0 * chance.normal(),
                                       .charge_sigma_As = 200.0,
                                       .soc_change = change + 0.015 * chance.normal(),
                                       .soc_change_sigma = 0.015}));
    }
    if (std::abs(estimate.capacity_As() - share * rated_As) <= 2.0 * estimate.sigma_As()) ++inside;
  }
  CHECK(inside > trials * 92 / 100);
  CHECK(inside < trials * 985 / 1000);
}

TEST_CASE("absurd pairs are refused, counted, and change nothing", "[unit][estimators][BMS_F.6]") {
  CapacityEstimate estimate = estimate_of(prior_of(0.05));
  const double sigma_As = estimate.sigma_As();
  const CapacityPair good{.charge_As = 18'000.0, .charge_sigma_As = 100.0, .soc_change = 0.5, .soc_change_sigma = 0.01};
  std::uint32_t refused = 0;
  const auto is_refused = [&](const CapacityPair& pair) {
    const bool was_taken = estimate.take(pair);
    ++refused;
    return !was_taken && estimate.refused() == refused && estimate.pairs() == 0 &&
           estimate.capacity_As() == Approx(rated_As) && estimate.sigma_As() == sigma_As;
  };
  for (const double wrong : {not_measured, infinite, -infinite}) {
    CAPTURE(wrong);
    for (double CapacityPair::*const member : {&CapacityPair::charge_As, &CapacityPair::charge_sigma_As,
                                               &CapacityPair::soc_change, &CapacityPair::soc_change_sigma}) {
      CapacityPair pair = good;
      pair.*member = wrong;
      CHECK(is_refused(pair));
    }
  }
  const auto with = [&good](double CapacityPair::*member, double value) {
    CapacityPair pair = good;
    pair.*member = value;
    return pair;
  };
  CHECK(is_refused(with(&CapacityPair::charge_sigma_As, 0.0)));
  CHECK(is_refused(with(&CapacityPair::charge_sigma_As, -1.0)));
  CHECK(is_refused(with(&CapacityPair::soc_change_sigma, -0.001)));
  CHECK(is_refused(with(&CapacityPair::charge_As, -18'000.0)));  // the cell was discharged, and its SOC rose
  CHECK(is_refused(with(&CapacityPair::soc_change, 0.0)));
  CHECK(is_refused({}));
  // SOC change too small, and larger than possible.
  CHECK(is_refused({.charge_As = 3'560.0, .charge_sigma_As = 1.0, .soc_change = 0.099, .soc_change_sigma = 0.0}));
  CHECK(is_refused({.charge_As = 36'400.0, .charge_sigma_As = 1.0, .soc_change = 1.01, .soc_change_sigma = 0.0}));
  // Capacity that no such cell has.
  CHECK(is_refused(measured(0.299, 0.01)));
  CHECK(is_refused(measured(1.301, 0.01)));
  CHECK(estimate.take({.charge_As = 3'600.0, .charge_sigma_As = 1.0, .soc_change = 0.1, .soc_change_sigma = 0.0}));
  CHECK(estimate.take(measured(0.301, 0.01)));
  CHECK(estimate.take(measured(1.299, 0.01)));
  CHECK(estimate.pairs() == 3);
}

TEST_CASE("a pair that contradicts many others hardly moves them, and leaves a doubt", "[unit][estimators][BMS_F.6]") {
  std::vector<CapacityPair> pairs(8, measured(0.9, 0.01));
  const double before_As = estimate_of(prior_of(0.1), pairs).sigma_As();
  pairs.push_back(measured(0.6, 0.01));
  const CapacityEstimate estimate = estimate_of(prior_of(0.1), pairs);
  // With the same weight as the others it would be 0.9 - 0.3 / 9.
  CHECK(estimate.capacity_As() < 0.8999 * rated_As);
  CHECK(estimate.capacity_As() > 0.895 * rated_As);
  CHECK(estimate.sigma_As() > 2.0 * before_As);
}

TEST_CASE("a pair counts in full up to two and a half sigmas of both, and less beyond", "[unit][estimators][BMS_F.6]") {
  // 1 % each: 1.414 % together. Both are equally certain, so beyond the edge the weights of both shift the middle
  // towards the prior.
  const auto share_with = [](double share) {
    return estimate_of(prior_of(0.01), {measured(share, 0.01)}).capacity_As() / rated_As;
  };
  const double edge = 2.5 * 0.01 * std::sqrt(2.0);
  CHECK(share_with(1.0 - 0.99 * edge) == Approx(1.0 - 0.99 * edge / 2.0).epsilon(1e-5));
  CHECK(share_with(1.0 + 0.99 * edge) == Approx(1.0 + 0.99 * edge / 2.0).epsilon(1e-5));
  // At twice the distance the outlier weight is 2: variances of 2 and 4.
  CHECK(share_with(1.0 - 2.0 * edge) == Approx(1.0 - 2.0 * edge / 3.0).epsilon(1e-4));
  CHECK(share_with(1.0 + 2.0 * edge) == Approx(1.0 + 2.0 * edge / 3.0).epsilon(1e-4));
}

TEST_CASE("a wrong belief gives way to the third pair that says so", "[unit][estimators][BMS_F.6]") {
  const std::vector<CapacityPair> pairs(3, measured(0.8, 0.01));
  const CapacityEstimate estimate = estimate_of(prior_of(0.01), pairs);
  CAPTURE(estimate.capacity_As(), estimate.sigma_As());
  CHECK(std::abs(estimate.capacity_As() - 0.8 * rated_As) < 2.0 * estimate.sigma_As());
}

TEST_CASE("a contradiction in which the state of charge is unsure is none", "[unit][estimators][BMS_F.6]") {
  // 0.36 of 36 kAs against 0.4, 10 % off; the sigma of the SOC change is 12.5 %. With full weight: sigmas of 1 % and
  // 12.5 %.
  const CapacityPair pair{
      .charge_As = 0.36 * rated_As, .charge_sigma_As = 1.0, .soc_change = 0.4, .soc_change_sigma = 0.05};
  const CapacityEstimate estimate = estimate_of(prior_of(0.01), {pair});
  CHECK(estimate.capacity_As() == Approx((1.0 - 0.1 / (1.0 + 12.5 * 12.5 * 0.9 * 0.9)) * rated_As).epsilon(5e-4));
  CHECK(estimate.capacity_As() < 0.9999 * rated_As);
}

TEST_CASE("what all pairs have in common does not average out", "[unit][estimators][BMS_F.6]") {
  CapacityPrior prior = prior_of(0.05);
  prior.common_share = 0.02;
  const CapacityEstimate estimate = estimate_of(prior, std::vector<CapacityPair>(400, measured(0.9, 0.02)));
  CHECK(estimate.capacity_As() == Approx(0.9 * rated_As).epsilon(1e-3));
  CHECK(estimate.sigma_As() == Approx(0.9 * rated_As * std::hypot(0.02, 0.001 / 0.9)).epsilon(0.02));
}

TEST_CASE("with use and time what was learned says less, and the next pair more", "[unit][estimators][BMS_F.6]") {
  CapacityPrior prior = prior_of(0.01);
  prior.loss_share_per_cycle = 0.001;
  prior.loss_share_per_year = 0.02;
  CapacityEstimate estimate = estimate_of(prior);
  const double fresh_As = estimate.sigma_As();
  constexpr double year_s = 31'557'600.0;
  estimate.pass(0.0, 2.0 * rated_As * 20.0);
  CHECK(estimate.sigma_As() == Approx(std::hypot(fresh_As, 0.02 * rated_As)).epsilon(1e-6));
  estimate.pass(0.5 * year_s, 0.0);
  CHECK(estimate.sigma_As() == Approx(std::hypot(fresh_As, 0.03 * rated_As)).epsilon(1e-6));
  CHECK(estimate.capacity_As() == Approx(rated_As));
  // Invalid and unbounded times or charges have no effect; one invalid value does not suppress the other.
  for (const double wrong : {-1.0, not_measured, infinite, -infinite}) {
    estimate.pass(wrong, wrong);
    CHECK(estimate.sigma_As() == Approx(std::hypot(fresh_As, 0.03 * rated_As)).epsilon(1e-6));
  }
  estimate.pass(not_measured, 2.0 * rated_As * 10.0);
  CHECK(estimate.sigma_As() == Approx(std::hypot(fresh_As, 0.04 * rated_As)).epsilon(1e-6));
  // 4.12 % against 2 %, both normally distributed.
  CHECK(estimate.take(measured(0.95, 0.02)));
  const double known = 1.0 / (0.01 * 0.01 + 0.04 * 0.04);
  const double seen = 1.0 / (0.02 * 0.02);
  CHECK(estimate.capacity_As() == Approx((known + 0.95 * seen) / (known + seen) * rated_As).epsilon(1e-3));
  CHECK(estimate.sigma_As() == Approx(rated_As / std::sqrt(known + seen)).epsilon(0.01));
  // After any time: nothing is known any more, but the values are finite.
  estimate.pass(1e9, 1e12);
  estimate.pass(1e9, 1e12);
  CHECK(estimate.sigma_As() < 1.01 * rated_As);
  CHECK(estimate.sigma_As() > 0.99 * rated_As);
  CHECK(estimate.take(measured(0.7, 0.01)));
  CHECK(estimate.capacity_As() == Approx(0.7 * rated_As).epsilon(2e-3));
}

TEST_CASE("a capacity at the bounds of what is looked for stays there", "[unit][estimators][BMS_F.6]") {
  const CapacityEstimate low = estimate_of(prior_of(1.0), std::vector<CapacityPair>(20, measured(0.301, 0.005)));
  CHECK(low.capacity_As() == Approx(0.301 * rated_As).epsilon(0.01));
  const CapacityEstimate high = estimate_of(prior_of(1.0), std::vector<CapacityPair>(20, measured(1.299, 0.005)));
  CHECK(high.capacity_As() == Approx(1.299 * rated_As).epsilon(0.005));
}

// --- anchors --------------------------------------------------------------------------------------------------------

namespace {

constexpr CurrentSensorError sensor{.gain = 0.01, .offset_A = 0.1, .unknown_current_A = 1.0};

}  // namespace

TEST_CASE("two anchors far enough apart make a pair, and the second waits for the next",
          "[unit][estimators][BMS_F.6]") {
  CapacityAnchors anchors;
  CHECK_FALSE(anchors.take({.soc = 0.9, .sigma = 0.03, .counted_As = 1'000.0, .at_s = 100.0}, sensor, rated_As));
  const auto pair =
      anchors.take({.soc = 0.5, .sigma = 0.04, .counted_As = 15'000.0, .at_s = 3'700.0}, sensor, rated_As);
  REQUIRE(pair);
  CHECK(pair->charge_As == 14'000.0);
  CHECK(pair->charge_sigma_As == Approx(360.0).epsilon(1e-4));
  CHECK(pair->soc_change == Approx(0.4));
  CHECK(pair->soc_change_sigma == Approx(0.05));
  const auto back =
      anchors.take({.soc = 1.0, .sigma = 0.03, .counted_As = -3'000.0, .at_s = 3'710.0}, sensor, rated_As);
  REQUIRE(back);
  CHECK(back->charge_As == -18'000.0);
  CHECK(back->soc_change == Approx(-0.5));
  CHECK(back->charge_sigma_As == Approx(std::hypot(1.0, 1.0)));  // 10 s of 0.1 A, and the counting itself
}

TEST_CASE("anchors close to each other: the better one waits on", "[unit][estimators][BMS_F.6]") {
  const auto pair_after = [](const CapacityAnchor& first, const CapacityAnchor& second) {
    CapacityAnchors anchors;
    CHECK_FALSE(anchors.take(first, sensor, rated_As));
    CHECK_FALSE(anchors.take(second, sensor, rated_As));
    return anchors.take({.soc = 0.2, .sigma = 0.001, .counted_As = 0.0, .at_s = 100'000.0}, sensor, rated_As);
  };
  const CapacityAnchor first{.soc = 0.9, .sigma = 0.02, .counted_As = -25'000.0, .at_s = 0.0};
  const auto is_first = [&](const CapacityAnchor& second) {
    const auto pair = pair_after(first, second);
    REQUIRE(pair);
    return pair->soc_change == Approx(0.7);
  };
  const double at_once = 1.0;
  CHECK_FALSE(is_first({.soc = 0.8, .sigma = 0.019, .counted_As = -21'000.0, .at_s = at_once}));
  CHECK(is_first({.soc = 0.8, .sigma = 0.021, .counted_As = -21'000.0, .at_s = at_once}));
  // After 7200 s counting has lost 2 % of 36 kAs: the sigma of the first is 2.83 % by then.
  CHECK_FALSE(is_first({.soc = 0.8, .sigma = 0.028, .counted_As = -21'000.0, .at_s = 7'200.0}));
  CHECK(is_first({.soc = 0.8, .sigma = 0.029, .counted_As = -21'000.0, .at_s = 7'200.0}));
}

TEST_CASE("anchors are a pair from a quarter of the capacity on", "[unit][estimators][BMS_F.6]") {
  const auto makes_pair = [](double soc) {
    CapacityAnchors anchors;
    CHECK_FALSE(anchors.take({.soc = 0.5, .sigma = 0.02, .counted_As = 0.0, .at_s = 0.0}, sensor, rated_As));
    return anchors.take({.soc = soc, .sigma = 0.02, .counted_As = 0.0, .at_s = 1.0}, sensor, rated_As).has_value();
  };
  CHECK(makes_pair(0.25));
  CHECK(makes_pair(0.75));
  CHECK_FALSE(makes_pair(0.2501));
  CHECK_FALSE(makes_pair(0.7499));
}

TEST_CASE("an absurd anchor is passed over, and one that is no later begins anew", "[unit][estimators][BMS_F.6]") {
  const CapacityAnchor high{.soc = 0.9, .sigma = 0.02, .counted_As = 0.0, .at_s = 10.0};
  const CapacityAnchor low{.soc = 0.2, .sigma = 0.02, .counted_As = 25'000.0, .at_s = 20.0};
  CapacityAnchors anchors;
  CHECK_FALSE(anchors.take(high, sensor, rated_As));
  for (const double wrong : {not_measured, infinite, -infinite}) {
    CAPTURE(wrong);
    for (double CapacityAnchor::*const member :
         {&CapacityAnchor::soc, &CapacityAnchor::sigma, &CapacityAnchor::counted_As, &CapacityAnchor::at_s}) {
      CapacityAnchor anchor = low;
      anchor.*member = wrong;
      CHECK_FALSE(anchors.take(anchor, sensor, rated_As));
    }
  }
  const auto is_passed_over = [&](double CapacityAnchor::*member, double value) {
    CapacityAnchor anchor = low;
    anchor.*member = value;
    return !anchors.take(anchor, sensor, rated_As);
  };
  CHECK(is_passed_over(&CapacityAnchor::soc, -0.01));
  CHECK(is_passed_over(&CapacityAnchor::soc, 1.01));
  CHECK(is_passed_over(&CapacityAnchor::sigma, 0.0));
  CHECK(is_passed_over(&CapacityAnchor::sigma, 1.0));
  CHECK_FALSE(anchors.take(low, {.offset_A = not_measured}, rated_As));
  CHECK_FALSE(anchors.take(low, sensor, 0.0));
  CHECK(anchors.take(low, sensor, rated_As));  // the first was still kept
  CapacityAnchor early = high;
  early.at_s = 20.0;
  CHECK_FALSE(anchors.take(early, sensor, rated_As));  // at the same time as `low`: the clock restarted
  CapacityAnchor later = low;
  later.at_s = 20.1;
  CHECK(anchors.take(later, sensor, rated_As));
  anchors.forget();
  early.at_s = 30.0;
  CHECK_FALSE(anchors.take(early, sensor, rated_As));
}

TEST_CASE("a cell with 15 % less and 40 % more resistance is found out by its rests, and inside what is told",
          "[unit][estimators][BMS_F.6]") {
  const CellDynamics cell = test::sloped_cell();
  for (const double gain : {0.0, 0.01, -0.01}) {
    CAPTURE(gain);
    test::SimulatedCell truth(cell, {.soc = 0.9,
                                     .capacity_share = -0.15,
                                     .resistance_share = 0.4,
                                     .sensor_gain = gain,
                                     .sensor_offset_A = 0.02,
                                     .voltage_noise_V = 0.001});
    CapacityEstimate estimate = estimate_of({.capacity_As = cell.capacity_As, .rated_As = cell.capacity_As});
    CapacityAnchors anchors;
    double counted_As = 0.0;
    double at_s = 0.0;
    const auto run = [&](double seconds, double current_A) {
      CellSample sample;
      for (double second = 0.0; second < seconds; second += 10.0) {
        sample = truth.run(10.0, current_A, 25.0);
        counted_As += sample.mean_current_A * 10.0;
        at_s += 10.0;
      }
      estimate.pass(seconds, std::abs(current_A) * seconds);
      return sample.voltage_V;
    };
    for (int turn = 0; turn < 4; ++turn) {
      for (const double current_A : {5.0, -5.0}) {
        run(3'600.0, current_A);  // 16.3 % of the remaining capacity, three times
        run(3'600.0, 0.5 * current_A);
        const double rested_V = run(7'200.0, 0.0);
        // Known to a daemon: the hysteresis of the last current, here 10 mV of 0.9 V, and the model error.
        const double soc = soc_from_ocv(cell, rested_V, 25.0, current_A > 0.0 ? -1.0 : 1.0);
        const auto pair = anchors.take({.soc = soc, .sigma = 0.01, .counted_As = counted_As, .at_s = at_s},
                                       {.gain = 0.01, .offset_A = 0.02}, cell.capacity_As);
        if (pair) CHECK(estimate.take(*pair));
      }
    }
    CHECK(estimate.pairs() >= 5);
    const double off_As = std::abs(estimate.capacity_As() - 0.85 * cell.capacity_As);
    CAPTURE(estimate.capacity_As(), estimate.sigma_As());
    CHECK(off_As < 0.025 * cell.capacity_As);
    CHECK(off_As < 2.0 * estimate.sigma_As());
  }
}
