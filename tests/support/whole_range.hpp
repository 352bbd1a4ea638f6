// Cases of a property whose range is small enough to try each of them: no case is left to chance, and there is nothing
// to shrink, as the plainest case that fails has been tried, too.
//
//   WholeRange range;
//   for (std::size_t load = 0; load < loads.size(); ++load) {
//     for (std::size_t ahead = 0; ahead < 5; ++ahead) {
//       range.attempt(text_of(load, ahead), load + ahead, [&] { return problem_with(load, ahead); });
//     }
//   }
//   range.check();
//
// Report: how many cases fail, the plainest of them with what is wrong in it, and the command that runs that case
// alone, which has its text in BMUD_CASE.
#pragma once

#include <cstddef>
#include <functional>
#include <string>

namespace bmu::test {

struct TriedCases {
  std::size_t tried = 0;
  std::size_t failed = 0;
  std::string plainest;  // of those that fail; "": none
  std::string problem;   // with that one
};

class WholeRange {
 public:
  /// Of the test case that runs: all cases, or the one in BMUD_CASE.
  WholeRange();
  /// `only`: the text of the one case to try; "": all.
  explicit WholeRange(std::string only) : only_(std::move(only)) {}

  /// `text` names the case and no other, without quotes. `steps` are taken through the ranges from the plainest case to
  /// this one; of two that fail the one with fewer is reported, of as many the first. `problem_of` tries it and returns
  /// what is wrong; "": nothing.
  void attempt(const std::string& text, std::size_t steps, const std::function<std::string()>& problem_of);
  /// Whether it is to be tried: for what is made once for many cases.
  [[nodiscard]] bool has(const std::string& text) const { return only_.empty() || only_ == text; }
  [[nodiscard]] const TriedCases& tried() const { return cases_; }
  /// Fails the test case where a case has failed, or none was tried. The report is on stderr.
  void check() const;

 private:
  std::string only_;
  std::size_t steps_ = 0;  // of the plainest
  TriedCases cases_;
};

/// What check() prints; `name` of the test.
[[nodiscard]] std::string report_of(const TriedCases& cases, const std::string& name);

}  // namespace bmu::test
