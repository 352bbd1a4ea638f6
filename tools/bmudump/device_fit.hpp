// Whether a frame may be the message of a row, where nothing but its identifier indicates that: identifiers of devices
// and of the traction pack have other meanings in cars.
#pragma once

#include "protocol/frame.hpp"
#include "protocol/message.hpp"

namespace bmu::dump {

/// Its length, checksum and counter are those of the row; each number is one that its field may hold; and, unless a
/// checksum of its own has shown already which device it is of, none is beyond what a battery, a charger or a car has,
/// and a field with two or more named numbers has one of them. Cost: a decoding of all fields.
[[nodiscard]] bool fits(const MessageSpec& message, const CanFrame& frame);

}  // namespace bmu::dump
