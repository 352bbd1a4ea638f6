// The two supplies of a module (MMU_7 to 11): external, 5 to 36 V, and its own cells. Both are read in every loop, 10
// ms; four low readings in a row are a failure, and as many good ones in a row end it, so that neither a dip of a
// cranking motor nor one good reading of a loose contact has an effect.
//
//   external good                      on the external supply, regardless of the module's
//   external failed, module good       on the module
//   both failed                        no supply
//
// A reading that did not arrive leaves the counts unchanged.
#pragma once

#include <cstdint>

namespace bmu {

/// Minimum of either supply, at the input of the same regulator.
inline constexpr std::int32_t supply_min_mV = 5'000;

enum class SupplyInUse : std::uint8_t { external, module, none };

class SupplyMonitor {
 public:
  static constexpr int readings_to_change = 4;

  constexpr void note(std::int32_t external_mV, std::int32_t module_mV) {
    external_.note(external_mV >= supply_min_mV);
    module_.note(module_mV >= supply_min_mV);
  }

  [[nodiscard]] constexpr bool is_external_low() const { return !external_.is_good; }
  [[nodiscard]] constexpr SupplyInUse in_use() const {
    if (external_.is_good) return SupplyInUse::external;
    return module_.is_good ? SupplyInUse::module : SupplyInUse::none;
  }

 private:
  /// Initially good: the module was able to start.
  struct Watch {
    bool is_good = true;
    int against = 0;  // opposite readings in a row

    constexpr void note(bool is_good_now) {
      against = is_good_now == is_good ? 0 : against + 1;
      if (against < readings_to_change) return;
      is_good = is_good_now;
      against = 0;
    }
  };

  Watch external_;
  Watch module_;
};

}  // namespace bmu
