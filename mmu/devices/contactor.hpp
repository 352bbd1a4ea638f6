// Mechanical model of a contactor: a coil, contacts that follow it with a delay, an auxiliary contact, and the faults
// of these.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "protocol/time.hpp"

namespace bmu {

enum class ContactorName : std::uint8_t { main_positive, main_negative, precharge, charge };
inline constexpr std::size_t contactor_count = 4;
inline constexpr std::array<std::string_view, contactor_count> contactor_names{"main_positive", "main_negative",
                                                                               "precharge", "charge"};

/// One flag per contactor: coils driven, or contacts closed.
using ContactorFlags = std::array<bool, contactor_count>;

enum class ContactorFault : std::uint8_t {
  none,
  welded,      // closed, regardless of the coil
  stuck_open,  // never closes: coil burnt out, wire off
};
enum class AuxiliaryContact : std::uint8_t { follows, stays_open, stays_closed };

class Contactor {
 public:
  struct Mechanics {
    Duration closing = 20ms;
    Duration opening = 10ms;
  };

  explicit constexpr Contactor(Mechanics mechanics) : mechanics_(mechanics) {}

  constexpr void update(bool is_coil_driven, TimePoint now) {
    if (is_coil_driven != is_coil_driven_) {
      is_coil_driven_ = is_coil_driven;
      moves_at_ = now + (is_coil_driven ? mechanics_.closing : mechanics_.opening);
    }
    if (is_armature_closed_ != is_coil_driven_ && now >= moves_at_) is_armature_closed_ = is_coil_driven_;
  }
  constexpr void set_fault(ContactorFault fault) { fault_ = fault; }
  constexpr void set_auxiliary(AuxiliaryContact auxiliary) { auxiliary_ = auxiliary; }

  [[nodiscard]] constexpr bool is_closed() const {
    return fault_ == ContactorFault::welded || (is_armature_closed_ && fault_ != ContactorFault::stuck_open);
  }
  /// State of the auxiliary contact; mirror contacts of a welded contactor stay closed with it.
  [[nodiscard]] constexpr bool feedback() const {
    return auxiliary_ == AuxiliaryContact::follows ? is_closed() : auxiliary_ == AuxiliaryContact::stays_closed;
  }

 private:
  Mechanics mechanics_;
  bool is_coil_driven_ = false;
  bool is_armature_closed_ = false;
  TimePoint moves_at_{};
  ContactorFault fault_ = ContactorFault::none;
  AuxiliaryContact auxiliary_ = AuxiliaryContact::follows;
};

}  // namespace bmu
