// Writes, for each test case, its computing time and the mutants it reached: name, seconds and numbers separated by
// tabs. Mutants reached before the first one belong to all, and have no name. Included at the end of
// tests/support/catch_main.cpp in the instrumented copy of the sources.
#pragma once

#include <cstdlib>
#include <ctime>
#include <fstream>
#include <string>

#include "tests/mutation/mutant.hpp"

namespace bmu_mutant {

#if __has_include(<catch2/catch_all.hpp>)
using ListenerBase = Catch::EventListenerBase;
#else
using ListenerBase = Catch::TestEventListenerBase;
#endif

class ReachListener : public ListenerBase {
 public:
  using ListenerBase::ListenerBase;

  void testCaseStarting(const Catch::TestCaseInfo& info) override {
    ListenerBase::testCaseStarting(info);
    if (!is_recording) return;
    if (!out_.is_open()) {
      out_.open(std::getenv("BMU_MUTANT_RECORD"));
      write("", 0.0);
    }
    reached().clear();
    name_ = info.name;
    started_at_ = std::clock();
  }

  void testCaseEnded(const Catch::TestCaseStats& stats) override {
    ListenerBase::testCaseEnded(stats);
    if (!is_recording) return;
    write(name_, static_cast<double>(std::clock() - started_at_) / CLOCKS_PER_SEC);
  }

 private:
  void write(const std::string& name, double took_s) {
    out_ << name << '\t' << took_s << '\t';
    for (std::size_t id = 0; id < reached().size(); ++id) {
      if (reached()[id]) out_ << id << ' ';
    }
    out_ << std::endl;
  }

  std::ofstream out_;
  std::string name_;
  std::clock_t started_at_ = 0;
};

CATCH_REGISTER_LISTENER(ReachListener)

}  // namespace bmu_mutant
