// Master of an emulated second pack: it reports its pack to the vehicle with the nine traction-pack messages, at the
// identifiers and in the dialect that the pack file expects of it (`second_pack`).
//
// A script sets its values; no current of it flows anywhere. Values of its cells are derived from these, and values
// that cannot be derived (health, energies, resistances, the limits of a closed pack) are sent as unknown.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "daemon/core/types/core_config.hpp"
#include "protocol/frame.hpp"
#include "protocol/time.hpp"

namespace bmu {

/// In the order of the script's words.
enum class SecondPackState : std::uint8_t { fault, open, closed, driving, charging };
inline constexpr std::size_t second_pack_state_count = 5;

class CanSecondPack {
 public:
  /// As this program: each message once a second, 10 ms after the previous one.
  static constexpr Duration period = 1s;
  static constexpr Duration spacing = 10ms;

  /// Precondition: `cell_count` is at least 1. `config.base_id` 0: no second pack.
  CanSecondPack(const SecondPackConfig& config, std::size_t cell_count, TimePoint started_at)
      : config_(config), cell_count_(cell_count), started_at_(started_at), due_at_(started_at + period) {}

  [[nodiscard]] const SecondPackConfig& config() const { return config_; }
  [[nodiscard]] std::size_t cell_count() const { return cell_count_; }
  [[nodiscard]] bool is_there() const { return config_.base_id != 0; }
  /// The message that is due, if any; called every millisecond. `rest_mV`: voltage of its pack unless the script sets
  /// one.
  [[nodiscard]] std::optional<CanFrame> tick(TimePoint now, double rest_mV);

  // Set by a script.
  SecondPackState state = SecondPackState::open;
  double soc_permille = 500.0;
  bool knows_soc = true;
  std::optional<double> voltage_mV;
  double current_A = 0.0;  // positive out of its pack
  double temperature_dC = 250.0;
  bool is_silent = false;

 private:
  [[nodiscard]] CanFrame message(std::size_t index, TimePoint now, double pack_mV) const;

  SecondPackConfig config_;
  std::size_t cell_count_;
  TimePoint started_at_;
  TimePoint due_at_;
  std::size_t next_ = 0;
};

}  // namespace bmu
