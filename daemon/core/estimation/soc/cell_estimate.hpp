// State of charge of one cell by every method, side by side: all get the same samples and the same ends of a charge, so
// that they can be compared. The caller selects one of them.
//
// Methods that contradict each other by more than their reported uncertainty show that something deviates from the pack
// file: disagreement().
//
// Cost: that of SocFilter, SocMixed and SocCoulomb together; docs/performance.md.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "daemon/core/estimation/soc/charge_ends.hpp"
#include "daemon/core/estimation/soc/model_memo.hpp"
#include "daemon/core/estimation/soc/model_pointer.hpp"
#include "daemon/core/estimation/soc/soc_coulomb.hpp"
#include "daemon/core/estimation/soc/soc_filter.hpp"
#include "daemon/core/estimation/soc/soc_mixed.hpp"
#include "protocol/fields.hpp"

namespace bmu {

class CellEstimate {
 public:
  /// `cell` must outlive this.
  void begin(const CellDynamics& cell, const CurrentSensorError& sensor, const SocBegin& from, double temperature_C) {
    ends_ = {};
    filter_.begin(cell, sensor, from, temperature_C);
    mixed_.begin(cell, sensor, from, temperature_C);
    coulomb_.begin(cell, sensor, from, temperature_C);
    cell_.set(cell);
  }
  void forget() { *this = {}; }
  /// Rebinds to the same tables at their new address. Before begin(): no effect.
  void move_to(const CellDynamics& cell) {
    cell_.move_to(cell);
    filter_.move_to(cell);
    mixed_.move_to(cell);
    coulomb_.move_to(cell);
  }
  [[nodiscard]] bool is_begun() const { return cell_.is_set(); }

  /// Before begin(): no effect. Returns the end of its charge that the cell has reached with this sample, if any.
  /// `memo`: of the same model.
  std::optional<ChargeAnchor> update(const CellSample& sample, const ChargeEndConfig& ends, ModelMemo& memo) {
    if (!is_begun()) return std::nullopt;
    filter_.update(sample, memo);
    mixed_.update(sample, memo);
    coulomb_.update(sample);
    const std::optional<ChargeAnchor> anchor = ends_.update(*cell_, ends, sample);
    if (!anchor) return std::nullopt;
    filter_.anchor(anchor->soc, anchor->sigma);
    mixed_.set(anchor->soc, anchor->sigma);
    coulomb_.set(anchor->soc, anchor->sigma);
    return anchor;
  }
  std::optional<ChargeAnchor> update(const CellSample& sample, const ChargeEndConfig& ends) {
    ModelMemo memo;
    return update(sample, ends, memo);
  }

  [[nodiscard]] SocEstimate estimate(SocMethod method) const {
    switch (method) {
      case SocMethod::ekf: return filter_.estimate();
      case SocMethod::mixed: return mixed_.estimate();
      case SocMethod::coulomb: return coulomb_.estimate();
    }
    return {};
  }
  [[nodiscard]] const SocFilter& filter() const { return filter_; }

  /// Largest distance between two methods, relative to the uncertainty that both together report (two standard
  /// deviations). Above 1 they contradict each other; 0 while nothing is known.
  [[nodiscard]] double disagreement() const {
    std::array<SocEstimate, soc_methods> said;
    for (std::size_t method = 0; method < soc_methods; ++method) {
      said[method] = estimate(SocMethod{static_cast<unsigned char>(method)});
    }
    double most = 0.0;
    for (std::size_t one = 0; one < soc_methods; ++one) {
      for (std::size_t other = one + 1; other < soc_methods; ++other) {
        most = std::max(most, disagreement(said[one], said[other]));
      }
    }
    return most;
  }

 private:
  static double disagreement(const SocEstimate& one, const SocEstimate& other) {
    constexpr double told_sigmas = 2.0;
    if (!one.is_known || !other.is_known) return 0.0;
    return std::abs(one.soc - other.soc) / (told_sigmas * root_sum_square(one.sigma, other.sigma));
  }

  ModelPointer<CellDynamics> cell_;
  SocFilter filter_;
  SocMixed mixed_;
  SocCoulomb coulomb_;
  ChargeEnds ends_;
  [[nodiscard]] bool are_fields_possible() const {
    return filter_.is_begun() == is_begun() && mixed_.is_begun() == is_begun() && coulomb_.is_begun() == is_begun();
  }
  BMU_FIELDS(cell_, filter_, mixed_, coulomb_, ends_)
};

}  // namespace bmu
