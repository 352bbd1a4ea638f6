// Scores an estimator on a recorded test: the recording passes through it sample by sample, as the daemon would feed
// it, with the errors of a real sensor and a wrong start added, and the estimate is compared with the bench's charge
// count.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "daemon/core/cell/cell_dynamics.hpp"
#include "daemon/core/estimation/soc/soc_estimate.hpp"
#include "protocol/result.hpp"
#include "tools/bmucell/data/series.hpp"

namespace bmu::cell {

struct EvaluationPlan {
  SocMethod method = SocMethod::ekf;
  // Errors added to the recording.
  double sensor_gain = 1.0;
  double sensor_offset_A = 0.0;
  double soc_error = 0.0;  // of the start, as a share: -0.1 starts 10 % low
  double from_soc = 1.0;   // starts at the first row at or below; below 1: in mid-operation, not after a rest
  double voltage_noise_V = 0.0;
  double current_noise_A = 0.0;
  std::uint64_t seed = 1;  // of the noise
  // Sensor error assumed by the estimator, one standard deviation, as shares: of the current, and of the 1C current.
  double gain_sigma = 0.02;
  double offset_sigma_C = 0.005;
};

/// One row, as received and estimated by the estimator.
struct TraceRow {
  double time_s = 0.0;
  double current_A = 0.0;  // as received by the estimator
  double voltage_V = 0.0;
  double temperature_C = 0.0;
  double true_soc = 0.0;
  double soc = 0.0;
  double sigma = 0.0;
};

/// Rows that are not scored, by reason.
struct RowsLeftOut {
  std::size_t before_start = 0;       // before the charge falls to EvaluationPlan::from_soc
  std::size_t time_not_forward = 0;   // no later than the latest row before: skipped by every estimator
  std::size_t without_reference = 0;  // estimated, but not compared

  [[nodiscard]] std::size_t count() const { return before_start + time_not_forward + without_reference; }
};

/// In percent and seconds. Figures that the recording is too short for are absent.
struct Score {
  std::string file;
  SocMethod method = SocMethod::ekf;
  std::size_t rows = 0;
  double rmse_pct = 0.0;
  double max_pct = 0.0;
  std::optional<double> rmse_after_20min_pct{};
  std::optional<double> max_after_20min_pct{};
  std::optional<double> settle_3pct_s{};  // from then on always within 3 %; none: not at the end either
  double misfit = 0.0;  // maximum of SocFilter::misfit(): from 1 on the recording is not of the cell of the cell file
  double inside_uncertainty_pct = 0.0;  // rows with the true SOC within two of the estimated standard deviations
  RowsLeftOut left_out{};
};

struct Evaluation {
  Score score;
  std::vector<TraceRow> trace;  // the rows that were scored
};

/// Evaluates as the daemon does: all methods in parallel, with the ends of charges; the current between rows that are
/// ten times as far apart as usual is not counted. The series needs ref_soc_pct; without temperatures the estimator
/// receives none. The error names the missing part.
[[nodiscard]] Result<Evaluation, std::string> evaluate(const EvaluationPlan& plan, const CellDynamics& cell,
                                                       const Series& series);

/// The mean of each figure over the files that have it; the time to settle only if all files have it; the maximum of
/// misfit.
[[nodiscard]] Score mean_of(const std::vector<Score>& scores);

}  // namespace bmu::cell
