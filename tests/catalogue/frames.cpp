#include "tests/catalogue/frames.hpp"

#include <string>

#include "protocol/assert.hpp"

namespace bmu::test {

Act on_every_cell(std::string_view property) {
  return [property](WiredPack& pack) {
    for (const ModuleConfig& module : pack.config().modules) {
      for (int cell = 1; cell <= module.cell_count; ++cell) {
        pack.apply("cell " + std::to_string(module.node) + "." + std::to_string(cell) + " " + std::string(property));
      }
    }
  };
}

Act for_a_while(std::string_view events, Duration duration, std::string_view back) {
  return [=](WiredPack& pack) {
    pack.apply(events);
    const TimePoint ends_at = pack.now() + duration;
    pack.each_ms = [=, is_over = false](WiredPack& now) mutable {
      if (is_over || now.now() < ends_at) return;
      is_over = true;
      now.apply(back);
    };
  };
}

bool is_of_last_module(const CanFrame& frame, const WiredPack& pack) {
  return station_of(frame) == static_cast<Station>(pack.last_node());
}

bool is_of_a_module(const CanFrame& frame, const WiredPack&) {
  return station_of(frame) < Station::pdu;
}

bool is_of_anybody(const CanFrame&, const WiredPack&) {
  return true;
}

FrameTest is_message(const MessageSpec& row) {
  return [&row](const CanFrame& frame, const WiredPack& pack) {
    const bool is_from_module = row.sender == Sender::mmu;
    return internal_bus::catalogue.find(frame.id).message == &row &&
           (!is_from_module || is_of_last_module(frame, pack));
  };
}

Act losing(const FrameTest& test) {
  return [test](WiredPack& pack) {
    pack.on_sent = [test](CanFrame& frame, const WiredPack& now) { return Fate{.is_lost = test(frame, now)}; };
  };
}

Act delaying(const FrameTest& test, Duration delay) {
  return [=](WiredPack& pack) {
    pack.on_sent = [=](CanFrame& frame, const WiredPack& now) {
      return Fate{.delay = test(frame, now) ? delay : Duration{}};
    };
  };
}

Act changing(const FrameTest& test, const FrameChange& change) {
  return [=](WiredPack& pack) {
    pack.on_sent = [=](CanFrame& frame, const WiredPack& now) {
      if (test(frame, now)) change(frame, now);
      return Fate{};
    };
  };
}

Act forging(const FrameTest& test, const FrameChange& change) {
  return changing(test, [change](CanFrame& frame, const WiredPack& now) {
    change(frame, now);
    reseal(frame, frame.data[6]);
  });
}

Act strange(CanFrame frame) {
  return [frame](WiredPack& pack) { pack.send_as_stranger(frame); };
}

void heal(WiredPack& pack) {
  pack.on_sent = {};
  pack.each_ms = {};
  pack.is_cut = pack.is_swallowing = pack.sends_fail = false;
  pack.flood = {};
  pack.latency = {};
  pack.set_acknowledged(true);
}

void reseal(CanFrame& frame, std::uint8_t counter) {
  const MessageSpec* const message = internal_bus::catalogue.find(frame.id).message;
  BMU_ASSERT(message != nullptr);
  seal(*message, counter, frame);
}

FrameChange cells_as(std::uint16_t raw) {
  return [raw](CanFrame& frame, const WiredPack&) {
    for (std::size_t slot = 0; slot < internal_bus::cells_per_frame; ++slot) {
      frame.data[2 * slot] = static_cast<std::uint8_t>(raw >> 8);
      frame.data[2 * slot + 1] = static_cast<std::uint8_t>(raw & 0xFF);
    }
  };
}

Act all(const std::vector<Act>& acts) {
  return [acts](WiredPack& pack) {
    for (const Act& act : acts) act(pack);
  };
}

}  // namespace bmu::test
