#include "tools/bmucell/fit/normal_equations.hpp"

namespace bmu::cell {

namespace {

Eigen::Index index(std::size_t at) {
  return static_cast<Eigen::Index>(at);
}

}  // namespace

NormalEquations::NormalEquations(std::size_t unknowns)
    : squares_(Eigen::MatrixXd::Zero(index(unknowns), index(unknowns))),
      products_(Eigen::VectorXd::Zero(index(unknowns))) {}

void NormalEquations::add(const std::vector<Term>& terms, double wanted, double sigma) {
  const double weight = 1.0 / (sigma * sigma);
  for (const Term& one : terms) {
    products_[index(one.at)] += weight * one.factor * wanted;
    for (const Term& other : terms) {
      if (other.at <= one.at) squares_(index(one.at), index(other.at)) += weight * one.factor * other.factor;
    }
  }
  wanted_squares_ += weight * wanted * wanted;
}

Eigen::VectorXd NormalEquations::solve() const {
  const Eigen::MatrixXd whole = squares_.selfadjointView<Eigen::Lower>();
  return whole.ldlt().solve(products_);
}

double NormalEquations::misfit(const Eigen::VectorXd& solution) const {
  return wanted_squares_ - products_.dot(solution);
}

}  // namespace bmu::cell
