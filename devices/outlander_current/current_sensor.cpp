// The driver of a LEM CAB with the sign of the Outlander's mounting.
#include "devices/outlander_current/outlander_current.hpp"

namespace bmu::outlander_current {

namespace {

SignalValue turned_round(const SignalValue& current_mA) {
  return current_mA.is_valid() ? known(-current_mA.value) : current_mA;
}

CurrentNews take(const CanFrame& frame) {
  CurrentNews news = lem_cab::take(frame);
  news.current_mA = turned_round(news.current_mA);
  return news;
}

CanFrame report(const SignalValue& current_mA) {
  return lem_cab::report(turned_round(current_mA));
}

}  // namespace

const CurrentSensorDriver driver{
    .name = "outlander_current", .period = lem_cab::current.period, .take = take, .report = report};

}  // namespace bmu::outlander_current
