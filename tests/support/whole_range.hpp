// Cases of a property with a range small enough to try each of them: no case is left to chance, and there is nothing to
// shrink, as the plainest case that fails has been tried, too.
//
//   WholeRange range;
//   for (std::size_t load = 0; load < loads.size(); ++load) {
//     for (std::size_t ahead = 0; ahead < 5; ++ahead) {
//       range.attempt(text_of(load, ahead), load + ahead, [&] { return problem_with(load, ahead); });
//     }
//   }
//   range.check();
//
// Report: the number of failing cases, the plainest of them with its problem, and the command that runs only that case,
// by its text in BMUD_CASE.
#pragma once

#include <cstddef>
#include <functional>
#include <string>

namespace bmu::test {

struct TriedCases {
  std::size_t tried = 0;
  std::size_t failed = 0;
  std::string plainest;  // of the failing ones; "": none
  std::string problem;   // of that one
};

class WholeRange {
 public:
  /// For the running test case: all cases, or the one in BMUD_CASE.
  WholeRange();
  /// `only`: the text of the one case to try; "": all.
  explicit WholeRange(std::string only) : only_(std::move(only)) {}

  /// `text` identifies the case, without quotes. `steps`: through the ranges from the plainest case to this one; of two
  /// that fail the one with fewer is reported, of as many the first. `problem_of` runs the case and returns its
  /// problem; "": none.
  void attempt(const std::string& text, std::size_t steps, const std::function<std::string()>& problem_of);
  /// Whether the case is to be tried: for objects that are made once for many cases.
  [[nodiscard]] bool has(const std::string& text) const { return only_.empty() || only_ == text; }
  [[nodiscard]] const TriedCases& tried() const { return cases_; }
  /// Fails the test case if a case has failed, or none was tried. The report is on stderr.
  void check() const;

 private:
  std::string only_;
  std::size_t steps_ = 0;  // of the plainest
  TriedCases cases_;
};

/// The text that check() prints; `name` of the test.
[[nodiscard]] std::string report_of(const TriedCases& cases, const std::string& name);

}  // namespace bmu::test
