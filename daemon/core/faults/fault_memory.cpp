#include "daemon/core/faults/fault_memory.hpp"

#include <algorithm>

namespace bmu {

std::string_view to_text(FaultStage stage) {
  switch (stage) {
    case FaultStage::good: return "good";
    case FaultStage::suspected: return "suspected";
    case FaultStage::active: return "active";
    case FaultStage::latched: return "latched";
  }
  return "?";
}

namespace {

using Kind = FaultChange::Kind;

/// Samples of different cells at least this far apart are from different polls, whatever sample age the modules report.
constexpr Duration poll_apart_min = 50ms;

/// Whether `one` is worse than `other` in the row's direction.
bool is_worse(const Reading& one, const Reading& other, Sense sense) {
  return sense == Sense::at_or_above ? one.value > other.value : one.value < other.value;
}

class RowUpdate {
 public:
  RowUpdate(const FaultRow& row, const Thresholds& thresholds, TimePoint now, FaultState& state, FaultChanges& changes)
      : row_(row), thresholds_(thresholds), now_(now), state_(state), changes_(changes) {}

  void run(const Reading& reading) {
    state_.latest = reading;
    stood_ = now_ - state_.judged_at;
    if (thresholds_.has_warning) update_warning(reading);
    const Verdict verdict = evaluate(reading, row_.sense, thresholds_.open, thresholds_.hysteresis);
    if (state_.is_doubtful()) state_.evidence = weighed(state_.evidence, state_.judged, thresholds_.confirm);
    state_.judged = verdict;
    state_.judged_at = now_;
    switch (state_.stage) {
      case FaultStage::active: while_active(verdict); break;
      case FaultStage::good:
      case FaultStage::suspected:
      case FaultStage::latched:
        if (state_.is_doubtful()) {
          while_doubtful(reading, verdict);
        } else {
          if_beyond_suspect(reading, verdict);
        }
        break;
    }
  }

 private:
  void update_warning(const Reading& reading) {
    const Verdict verdict = evaluate(reading, row_.sense, thresholds_.warn, thresholds_.hysteresis);
    state_.warning_evidence = weighed(state_.warning_evidence, state_.warning_judged, thresholds_.warn_confirm);
    state_.warning_judged = verdict;
    const bool is_believed = state_.warning_evidence >= thresholds_.warn_confirm;
    if (!state_.is_warning && verdict == Verdict::beyond && is_believed) {
      state_.is_warning = true;
      state_.warning_since = now_;
      state_.warning = reading;
      note(Kind::warned);
    } else if (state_.is_warning && verdict == Verdict::good) {
      state_.is_warning = false;
      note(Kind::warning_over);
    } else if (state_.is_warning && reading.is_known && is_worse(reading, state_.warning, row_.sense)) {
      state_.warning = reading;
    }
  }

  /// The debounce time at `now_`: the last result was valid until now.
  [[nodiscard]] Duration weighed(Duration evidence, Verdict judged, Duration confirm) const {
    if (judged == Verdict::beyond) evidence += stood_;
    if (judged == Verdict::good || judged == Verdict::between) evidence -= stood_ / 2;
    // Limited to the confirm time, so that an old bad sample does not take arbitrarily long to decay.
    return std::clamp(evidence, Duration{}, confirm);
  }

  /// Makes the fault pending. A latched one stays latched meanwhile; its recurrence is confirmed like the first
  /// occurrence.
  void if_beyond_suspect(const Reading& reading, Verdict verdict) {
    if (verdict != Verdict::beyond) return;
    if (state_.stage == FaultStage::latched) {
      state_.returning_since = now_;
    } else {
      state_.stage = FaultStage::suspected;
      state_.suspected_since = now_;
    }
    state_.evidence = {};
    state_.samples = 1;
    take_sample(reading);
    confirm_if_due(reading);
  }

  void take_sample(const Reading& reading) {
    state_.sample_taken_at = reading.taken_at;
    state_.sample_element = reading.element;
  }

  /// A newer sample of the same cell or sensor, or one so much later that it cannot be another cell's value in the same
  /// answer.
  [[nodiscard]] bool is_another_sample(const Reading& reading) const {
    const Duration later = reading.taken_at - state_.sample_taken_at;
    return later > Duration{} && (reading.element == state_.sample_element || later >= poll_apart_min);
  }

  void while_doubtful(const Reading& reading, Verdict verdict) {
    if (verdict == Verdict::unknown) return;
    if (verdict != Verdict::beyond) {
      if (state_.evidence <= Duration{}) forget_doubt();
      return;
    }
    if (is_another_sample(reading)) {
      ++state_.samples;
      take_sample(reading);
    }
    confirm_if_due(reading);
  }

  void forget_doubt() {
    if (state_.stage == FaultStage::suspected) state_.stage = FaultStage::good;
    state_.returning_since = {};
  }

  void confirm_if_due(const Reading& reading) {
    if (state_.evidence < thresholds_.confirm || state_.samples < row_.samples) return;
    if (state_.stage == FaultStage::latched) state_.suspected_since = state_.returning_since;
    state_.returning_since = {};
    state_.stage = FaultStage::active;
    state_.is_restored = false;
    state_.confirmed_at = now_;
    state_.confirmed = reading;
    state_.threshold = thresholds_.open;
    state_.first_at = state_.count == 0 ? now_ : state_.first_at;
    state_.last_at = now_;
    state_.good_since = {};
    ++state_.count;
    note(Kind::confirmed);
  }

  void while_active(Verdict verdict) {
    if (verdict == Verdict::beyond) state_.last_at = now_;
    if (verdict != Verdict::good) {
      state_.good_since = {};
      return;
    }
    if (state_.good_since == TimePoint{}) state_.good_since = now_;
    if (now_ - state_.good_since < thresholds_.clear) return;
    const bool latches = row_.latch != Latch::none;
    state_.stage = latches ? FaultStage::latched : FaultStage::good;
    note(latches ? Kind::cause_gone : Kind::cleared);
  }

  void note(Kind kind) { changes_.push_back({row_.id, kind}); }

  const FaultRow& row_;
  const Thresholds& thresholds_;
  TimePoint now_;
  FaultState& state_;
  FaultChanges& changes_;
  Duration stood_{};  // time since the last update
};

}  // namespace

FaultChanges FaultMemory::update(const FaultInputs& inputs) {
  FaultChanges changes;
  for (const FaultRow& row : fault_table()) {
    judge(row, row.read(inputs), inputs.config->limits, inputs.now, changes);
  }
  return changes;
}

void FaultMemory::judge(const FaultRow& row, const Reading& reading, const LimitsConfig& limits, TimePoint now,
                        FaultChanges& changes) {
  const Thresholds thresholds = thresholds_of(row, limits);
  RowUpdate(row, thresholds, now, states_[static_cast<std::size_t>(row.id)], changes).run(reading);
}

void FaultMemory::restore_lock(FaultId id, const Reading& confirmed, std::int64_t threshold, TimePoint at) {
  FaultState& state = states_[static_cast<std::size_t>(id)];
  state.stage = FaultStage::latched;
  state.is_restored = true;
  state.confirmed = confirmed;
  state.threshold = threshold;
  state.confirmed_at = state.last_at = at;
}

FaultChanges FaultMemory::clear_latched(Authority authority) {
  FaultChanges changes;
  for (const FaultRow& row : fault_table()) {
    FaultState& state = states_[static_cast<std::size_t>(row.id)];
    const bool may_clear = row.latch == Latch::until_cleared || authority == Authority::service;
    const bool is_gone = state.judged == Verdict::good && !state.is_doubtful();
    if (state.stage != FaultStage::latched || !is_gone || !may_clear) continue;
    state.stage = FaultStage::good;
    changes.push_back({row.id, Kind::cleared});
  }
  return changes;
}

}  // namespace bmu
