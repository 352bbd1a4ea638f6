// Whether a frame may be the message of a row, if only its identifier indicates that: identifiers of devices
// and of the traction pack have other meanings in cars.
#pragma once

#include <cstdint>

#include "protocol/frame.hpp"
#include "protocol/message.hpp"

namespace bmu::dump {

enum class Fit : std::uint8_t {
  no,        // it cannot be this message
  unproven,  // nothing contradicts, but the row has almost no content that the bytes of another device could contradict
  proven,    // its checksum is right, or at most half of the possible contents of such a frame would fit
};

/// A frame fits if its length, checksum and counter are those of the row; each number is one that its field may hold;
/// and, unless a checksum of its own has already identified its device, none is outside the range of a battery, a
/// charger or a car, a field with two or more named numbers has one of them, and a name is text. Codes for "not known"
/// prove nothing, nor do bytes that are all 00h or all FFh, in any row. Cost: a decoding of all fields.
[[nodiscard]] Fit fit_of(const MessageSpec& message, const CanFrame& frame);

}  // namespace bmu::dump
