// A sensor that tells the pack's current in frames of its own, whatever language it speaks.
//
//   const CurrentSensorDriver& driver = *find_device("lem_cab")->current;
//   if (const CurrentNews news = driver.take(frame); news.word == CurrentWord::value) use(news.current_mA);
//
// The sign is the sensor's own: which way round it is mounted the pack file says. A value that the sensor marks as
// wrong, and one that it cannot have measured, is not valid, with the reason. `report` looks from the other side, for
// emulated sensors; a test holds both against each other. Pure; some 20 ns a frame.
#pragma once

#include <cstdint>
#include <string_view>

#include "protocol/frame.hpp"
#include "protocol/signal.hpp"
#include "protocol/time.hpp"

namespace bmu {

enum class CurrentWord : std::uint8_t {
  none,     // not this sensor's
  refused,  // under its identifier, and of a wrong length or form: nothing was taken from it
  value,    // a current, or why there is none
};
struct CurrentNews {
  CurrentWord word = CurrentWord::none;
  SignalValue current_mA;
};

struct CurrentSensorDriver {
  std::string_view name;  // of the device
  Duration period{};
  CurrentNews (*take)(const CanFrame& frame) = nullptr;
  /// What it says of this current; of one that is not valid, that it is wrong.
  CanFrame (*report)(const SignalValue& current_mA) = nullptr;
};

}  // namespace bmu
