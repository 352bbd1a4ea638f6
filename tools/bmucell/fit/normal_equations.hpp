// Linear least squares, one equation after the other: only the sums are kept (A'A and A'b), so a million equations of a
// few terms each take as much memory as ten.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Dense>

namespace bmu::cell {

/// `factor` times unknown number `at`.
struct Term {
  std::size_t at = 0;
  double factor = 0.0;
};

class NormalEquations {
 public:
  explicit NormalEquations(std::size_t unknowns);

  /// Adds the equation: sum of the terms = `wanted`, with the standard deviation `sigma` (above 0). Cost: the square of
  /// the terms.
  void add(const std::vector<Term>& terms, double wanted, double sigma);
  /// The unknowns with the smallest residual over all equations, in squares of their sigmas. Unknowns of no equation
  /// are 0.
  [[nodiscard]] Eigen::VectorXd solve() const;
  /// The residual of a solution: the sum of those squares.
  [[nodiscard]] double misfit(const Eigen::VectorXd& solution) const;

 private:
  Eigen::MatrixXd squares_;  // the lower triangle
  Eigen::VectorXd products_;
  double wanted_squares_ = 0.0;
};

}  // namespace bmu::cell
