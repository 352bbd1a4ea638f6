#include "tools/bmureplay/decision_changes.hpp"

namespace bmu::replay {

void DecisionChanges::take(const WhatIfMove& move) {
  if (moves_.size() < moves_max) {
    moves_.push_back(move);
  } else {
    ++left_out_;
  }
}

void DecisionChanges::take(const WhatIfReport& report) {
  ReportChanges& changes = reports_[report.recorded.id];
  if (changes.count == 0) changes.first = report;
  ++changes.count;
  changes.last_log_us = report.log_us;
}

}  // namespace bmu::replay
