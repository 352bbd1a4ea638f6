// Frames of third-party devices as received by a whole core, on every bus and at any time: modules of other makers,
// chargers, inverters, sensors, a second pack, requests for data. No contactor is commanded closed without permission,
// no frame without a row is sent, and the answers to requests are as long as their length field states.
//
// Input: which pack (1), then 14 bytes per frame: time since the last one (1, in ms), bus (1), how (1: .0 sealed as its
// row requires, .1 to .7 the node), which catalogue and row (2), length (1), 8 data bytes.
#include <memory>

#include "daemon/core/core.hpp"
#include "devices/device_list.hpp"
#include "protocol/receive_check.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "protocol/tables/vehicle_bus.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/support/patched_pack.hpp"

using namespace bmu;

namespace {

constexpr std::uint32_t request_id = 0x745;
constexpr std::uint32_t reply_id = 0x74D;

const CoreConfig& pack(std::uint8_t which) {
  static const CoreConfig packs[] = {
      test::patched_pack(R"({"vehicle": {"request_id": "745", "may_clear_faults": true}})", "outlander-80s.json"),
      test::patched_pack(R"({"vehicle": {"request_id": "745"}})", "i3-96s.json"),
      test::patched_pack(R"({"vehicle": {"request_id": "745"}, "second_pack": {"base_id": "640"}})",
                         "charger-48s.json"),
      test::patched_pack(R"({"charger": {"protocol": "brusa_nlg5"}})", "charger-48s.json"),
      test::patched_pack("{}", "storage-16s-48v.json"),
      test::patched_pack(R"({"inverter": {"protocol": "sma"}})", "storage-16s-48v.json"),
      test::patched_pack(R"({"sensor": {"has_second_current": true, "second_protocol": "lem_cab"}})"),
  };
  return packs[which % std::size(packs)];
}

/// A row of a third-party device, or of bmud's own buses; or a request for data.
CanFrame next_frame(fuzz::Numbers& input) {
  constexpr std::size_t catalogue_count_of_ours = 2;
  const std::uint8_t how = input.next<std::uint8_t>();
  const std::uint16_t which = input.next<std::uint16_t>();
  const std::size_t number = which % 64U % (all_devices().size() + catalogue_count_of_ours + 1);
  const Catalogue& catalogue = number < all_devices().size()    ? *all_devices()[number]->catalogue
                               : number == all_devices().size() ? internal_bus::catalogue
                                                                : vehicle_bus::catalogue;
  const MessageSpec& message = *catalogue.messages()[which / 64U % catalogue.messages().size()];
  const auto nodes = static_cast<std::uint16_t>(message.node_max - message.node_min + 1);
  CanFrame frame = make_frame(message, static_cast<std::uint8_t>(message.node_min + how / 2U % nodes));
  if (number == all_devices().size() + catalogue_count_of_ours) frame = {.id = request_id};
  const std::uint8_t length = input.next<std::uint8_t>() % 9;
  for (std::uint8_t& byte : frame.data) byte = input.next<std::uint8_t>();
  if ((how & 0x01U) == 0) {
    frame.length = length;
  } else if (frame.id != request_id) {
    seal(message, counter_of(message, frame), frame);
  }
  return frame;
}

void check_decisions(const Core& core, const Decisions& decisions, TimePoint now) {
  FUZZ_CHECK(!decisions.outputs.any_contactor() || core.permission().may_stay_closed);
  FUZZ_CHECK(decisions.wake_at > now && decisions.wake_at <= now + 1s);
  FUZZ_CHECK(core.gate_refusals() == 0);
  for (const OutgoingFrame& out : decisions.frames) {
    FUZZ_CHECK(out.frame.length <= 8 && !out.frame.is_remote && !out.frame.is_error);
    const bool is_answer = out.port == Port::vehicle && !out.frame.is_extended && out.frame.id == reply_id;
    // b0 is the number of bytes that follow.
    if (is_answer) FUZZ_CHECK(out.frame.data[0] < 8 && out.frame.data[0] + 1U <= out.frame.length);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Numbers input(data, size);
  const CoreConfig& config = pack(input.next<std::uint8_t>());
  TimePoint now{1s};
  const auto core = std::make_unique<Core>(config, now);
  for (const Port port : all_ports) static_cast<void>(core->observe({.at = now, .what = PortChanged{port, true}}));
  TimePoint wake_at = now;
  const auto decide = [&] {
    const Decisions decisions = core->decide(now);
    check_decisions(*core, decisions, now);
    wake_at = decisions.wake_at;
  };
  for (int count = 0; count < 64 && !input.is_empty(); ++count) {
    const TimePoint next = now + input.next<std::uint8_t>() * 1ms;
    while (wake_at <= next) {
      now = wake_at;
      decide();
    }
    now = next;
    const Port port = all_ports[input.next<std::uint8_t>() % all_ports.size()];
    const Urgency urgency = core->observe({.at = now, .what = FrameReceived{port, next_frame(input)}});
    if (urgency == Urgency::decide_now) decide();
  }
  return 0;
}
