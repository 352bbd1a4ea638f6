// Text of the error frames of Linux (linux/can/error.h), in which a CAN controller reports its state and that of the
// bus, as candump -e explains them. They were never on the bus; identifier and bytes are bit fields.
#pragma once

#include "protocol/frame.hpp"
#include "tools/bmudump/text_writer.hpp"

namespace bmu::dump {

/// "no acknowledgement, controller: send errors passive, 128 send errors and 0 receive errors". At most 1,000
/// characters.
void print_error_frame(const CanFrame& frame, TextWriter& out);

}  // namespace bmu::dump
