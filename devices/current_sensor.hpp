// Sensor that sends the pack current in frames of its own, independent of its protocol.
//
//   const CurrentSensorDriver& driver = *find_device("lem_cab")->current;
//   if (const CurrentNews news = driver.take(frame); news.word == CurrentWord::value) use(news.current_mA);
//
// The sign is the sensor's own: the pack file gives its mounting direction. A value that the sensor marks as wrong, or
// that it cannot have measured, is invalid, with the reason. `report` is the inverse function, for emulated sensors; a
// test checks both against each other. Pure; about 20 ns per frame.
#pragma once

#include <cstdint>
#include <string_view>

#include "protocol/frame.hpp"
#include "protocol/signal.hpp"
#include "protocol/time.hpp"

namespace bmu {

enum class CurrentWord : std::uint8_t {
  none,     // not from this sensor
  refused,  // its identifier with a wrong length or frame type: nothing was read from it
  value,    // a current, or the reason why there is none
};
struct CurrentNews {
  CurrentWord word = CurrentWord::none;
  SignalValue current_mA;
};

struct CurrentSensorDriver {
  std::string_view name;  // of the device
  Duration period{};
  CurrentNews (*take)(const CanFrame& frame) = nullptr;
  /// Frame for this current; an invalid one is marked as wrong.
  CanFrame (*report)(const SignalValue& current_mA) = nullptr;
};

}  // namespace bmu
