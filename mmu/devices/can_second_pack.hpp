// The master of an emulated pack beside this one: it tells the vehicle of its pack with the nine traction-pack
// messages, at the identifiers and in the dialect that the pack file expects of it (`second_pack`).
//
// What it tells is what the script says; no current of it flows anywhere. It says of its own cells what follows from
// that, and of what does not follow (health, energies, resistances, the limits of a closed pack) that it is not known.
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
  /// As our own master: each message once a second, 10 ms after the one before.
  static constexpr Duration period = 1s;
  static constexpr Duration spacing = 10ms;

  /// It has so many cells, 1 at least. `config.base_id` 0: there is none.
  CanSecondPack(const SecondPackConfig& config, std::size_t cell_count, TimePoint started_at)
      : config_(config), cell_count_(cell_count), started_at_(started_at), due_at_(started_at + period) {}

  [[nodiscard]] const SecondPackConfig& config() const { return config_; }
  [[nodiscard]] std::size_t cell_count() const { return cell_count_; }
  [[nodiscard]] bool is_there() const { return config_.base_id != 0; }
  /// The message that is due, if any; called every millisecond. `rest_mV`: of its pack, as long as the script names no
  /// voltage.
  [[nodiscard]] std::optional<CanFrame> tick(TimePoint now, double rest_mV);

  // What a script has it say.
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
