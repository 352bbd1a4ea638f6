// Error text for a bus that cannot be opened.
#include "tools/common/bus_text.hpp"

#include "tests/support/catch.hpp"

namespace bmu {

TEST_CASE("a missing interface is named, with how to make or find one", "[unit][tools]") {
  const OsError missing{.code = ENODEV, .what = "find vcan9"};
  CHECK(open_failure_text("vcan9", missing) ==
        "there is no interface vcan9; make it with: sudo modprobe vcan && sudo ip link add vcan9 type vcan && "
        "sudo ip link set vcan9 up");
  CHECK(open_failure_text("can7", missing) == "there is no interface can7; `ip -br link` lists those there are");
  CHECK(open_failure_text("can0", {.code = EACCES, .what = "bind a CAN socket to can0"}) ==
        "bind a CAN socket to can0: Permission denied");
}

}  // namespace bmu
