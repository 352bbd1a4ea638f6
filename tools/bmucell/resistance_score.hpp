// Scores both methods of estimating a cell's resistance on a recording with pulses: the recording passes through them
// row by row, and their estimate soon after each pulse is compared with the value in the bench's table, at the
// temperature in the table.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/core/cell/cell_dynamics.hpp"
#include "protocol/result.hpp"
#include "tools/bmucell/data/pulse_table.hpp"
#include "tools/bmucell/data/series.hpp"

namespace bmu::cell {

enum class ResistanceMethod : unsigned char { recursive, steps };
inline constexpr std::size_t resistance_methods = 2;
inline constexpr std::array<std::string_view, resistance_methods> resistance_method_names{"recursive", "steps"};

/// Estimate of one method for one pulse.
struct ToldResistance {
  double resistance_Ohm = 0.0;
  std::optional<double> sigma_Ohm{};  // only of methods that estimate it
};

struct PulseResult {
  double time_s = 0.0;  // of the first row with current
  PulseRow reference;
  std::array<std::optional<ToldResistance>, resistance_methods> told;  // none: not yet known
};

/// Over the pulses with an estimate of the method; without one there are no figures.
struct ResistanceScore {
  ResistanceMethod method = ResistanceMethod::recursive;
  bool is_all = true;  // false: only pulses above 10 % of charge
  std::size_t pulses = 0;
  std::size_t told = 0;
  std::size_t within_5_pct = 0;
  std::optional<double> rms_pct{};
  std::optional<double> max_pct{};
  std::optional<double> mean_pct{};                // above 0: estimates too high
  std::optional<double> inside_uncertainty_pct{};  // with the table within two of the estimated standard deviations
};

/// Near empty a cell's resistance doubles within a few percent of charge, so a second score excludes this range.
inline constexpr double nearly_empty_soc = 0.10;

struct ResistanceEvaluation {
  std::vector<PulseResult> pulses;
  std::vector<ResistanceScore> scores;  // by method, first of all pulses, then without the nearly empty
};

/// The series needs ref_soc_pct and temp_C. `recursive` is ResistanceTracker. `steps` is the daemon's method between
/// two sample sets of the pack (StepResponse): rows stand for sample sets, rows with the same current as the row before
/// or after for steady ones, 2.5 s for the maximum time between two, and a current step is at least an ampere or a
/// tenth of the 1C current, whichever is more. The estimates are read ten seconds after the pulse.
[[nodiscard]] Result<ResistanceEvaluation, std::string> evaluate_resistance(const CellDynamics& cell,
                                                                            const Series& series,
                                                                            const PulseTable& table);

}  // namespace bmu::cell
