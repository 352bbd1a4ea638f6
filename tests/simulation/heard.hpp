// What has really reached the master, and how old it was: kept from the frames on their way alone, apart from anything
// the core knows.
//
// Devices are overheard as they send; what arrives later is recognised by its bytes, so that a frame that was held
// back, sent twice or repeated is as old as it is, whatever its counter says. A frame without its checksum, and a
// result that its sensor flags as wrong, is no news.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "daemon/core/types/core_config.hpp"
#include "protocol/frame.hpp"

namespace bmu::test {

class Heard {
 public:
  explicit Heard(const CoreConfig& config);

  /// A device sends it, as it goes out on the wire.
  void note_sent(const CanFrame& frame, TimePoint now);
  /// The master is told it.
  void note_told(const CanFrame& frame, TimePoint now);

  enum class Kind : std::uint8_t {
    cells,
    temperatures,
    board_temperatures,
    module_status,
    module_voltage,
    current,
    pack_voltage,
    link_voltage,
    pdu
  };
  /// The first thing the pack needs and whose last word came more than its age and `more` ago, or was made so long ago
  /// that nobody may take it for new; of one kind, or of all. Empty: all is fresh.
  [[nodiscard]] std::string stale(TimePoint now, Duration more, std::optional<Kind> kind = {}) const;
  /// Frames with a right checksum that no device has sent so: damage that nobody can tell.
  [[nodiscard]] std::uint64_t forged() const { return forged_; }

 private:
  struct Sent {
    std::array<std::uint8_t, 8> data{};
    TimePoint at{};
  };
  static constexpr std::size_t remembered = 24;  // of each identifier: more than what 300 ms hold
  struct Source {
    std::uint32_t id = 0;
    Kind kind{};
    Duration age{};         // to which it counts
    Duration on_the_way{};  // what it may have been without anybody being able to tell
    TimePoint told_at{};    // zero: never
    TimePoint made_at{};
    std::array<Sent, remembered> sent{};
    std::size_t next = 0;
  };
  static constexpr std::size_t id_count = 0x800;
  static constexpr std::uint16_t nobody = 0xFFFF;

  void add(std::uint32_t id, Kind kind, Duration age, Duration on_the_way);
  [[nodiscard]] static bool is_stale(const Source& source, TimePoint now, Duration more);

  std::vector<Source> sources_;
  std::array<std::uint16_t, id_count> source_of_{};
  std::uint64_t forged_ = 0;
};

}  // namespace bmu::test
