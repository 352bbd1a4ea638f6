// Data that has really reached the master, and its age: derived only from the frames on their way, independent of the
// core's data.
//
// Devices are observed as they send; a frame that arrives later is recognised by its bytes, so that one that was
// delayed, sent twice or repeated has its true age, whatever its counter. A frame without a correct checksum, and a
// result that its sensor flags as wrong, is not new data.
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

  /// A device sends it, in the form in which it is on the wire.
  void note_sent(const CanFrame& frame, TimePoint now);
  /// The master receives it.
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
  /// The first required message that was last received more than its age and `more` ago, or was made so long ago that
  /// it must not count as new; of one kind, or of all. Empty: all is fresh.
  [[nodiscard]] std::string stale(TimePoint now, Duration more, std::optional<Kind> kind = {}) const;
  /// Frames with a correct checksum that no device has sent in this form: undetectable damage.
  [[nodiscard]] std::uint64_t forged() const { return forged_; }

 private:
  struct Sent {
    std::array<std::uint8_t, 8> data{};
    TimePoint at{};
  };
  static constexpr std::size_t remembered = 24;  // of each identifier: more than 300 ms of frames
  struct Source {
    std::uint32_t id = 0;
    Kind kind{};
    Duration age{};         // up to which it counts
    Duration on_the_way{};  // undetectable delay on its way
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
