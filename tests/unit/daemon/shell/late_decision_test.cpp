// A closing command that cannot be sent at once is not sent at all; an opening one always is.
#include "daemon/shell/late_decision.hpp"

#include "tests/support/catch.hpp"

using namespace bmu;

TEST_CASE("what keeps something closed is carried out within 30 ms or not at all", "[unit][loop][F67]") {
  constexpr std::array closing{ContactorOutputs{.main_positive = true}, ContactorOutputs{.main_negative = true},
                               ContactorOutputs{.precharge = true}, ContactorOutputs{.charge = true}};
  for (const ContactorOutputs& outputs : closing) {
    OutgoingFrame command{Port::internal, contactor_command_frame(outputs, 7)};
    CHECK_FALSE(is_too_late(outputs, 30ms));
    CHECK_FALSE(is_too_late(command, 30ms));
    CHECK(is_too_late(outputs, 30ms + 1ns));
    CHECK(is_too_late(command, 30ms + 1ns));
    command.port = Port::vehicle;  // the same identifier means something else there
    CHECK_FALSE(is_too_late(command, 1h));
  }
}

TEST_CASE("to open, and everything that closes nothing, is never too late", "[unit][loop][F67]") {
  constexpr ContactorOutputs open{.auxiliary = true, .fan = true, .heater = true};
  CHECK_FALSE(is_too_late(open, 1h));
  CHECK_FALSE(is_too_late(OutgoingFrame{Port::internal, contactor_command_frame(open, 7)}, 1h));
  CHECK_FALSE(is_too_late(OutgoingFrame{Port::internal, make_frame(internal_bus::poll)}, 1h));
}
