// Data on request, as a Lithiumate gives it: a frame at `request_id` (745h) asks for one thing by its number (PID), the
// answer comes at `reply_id` (74Dh). Diagnostic tools and displays made for that system ask us as they ask it.
//
//   request   b0 how many bytes follow (3)   b1 10h read, 14h clear   b2 PID   b3 cell, bank or battery, else 0
//   answer    b0 how many bytes follow       b1 50h, 54h              b2, b3 as asked           b4 on: the data
//
// All that can be read of cells, banks, batteries, the pack and the system is answered, and 14 62, which clears stored
// faults as a user's command does, where the pack file allows it (vehicle/may_clear_faults). Nothing else is: no
// setting is read or written, no output forced. A PID we do not have, a cell that there is not, and a value that is not
// known get no answer: the encodings have no code for "unknown", and every number would be believed.
//
// What differs from a Lithiumate, as our pack does:
//   - cells are numbered from 1 as in 623h; a bank is a module, in the order of the pack file, from 0; there is one
//     battery, 0, which is the pack.
//   - temperatures are those of the sensors on the cells, not of boards: of a cell, the average of its module's. With
//     loads on or off they are the same, and both places carry it. Their numbers are the sensors' as in 627h.
//   - one current flows: into the pack it is the source's, out of it the load's.
//   - power cycles (60h) are starts of the daemon in which it has seen the whole pack; no answer before that, nor where
//     no state is kept. 65535 stands for more, too.
//
// Asked for in any number, answered one a tick; what waits beyond eight is dropped and counted. Pure; an answer about
// all cells of a large pack takes some microseconds.
#pragma once

#include <cstdint>
#include <optional>

#include "daemon/core/measurement/module_table.hpp"
#include "daemon/core/types/core_config.hpp"
#include "daemon/core/vehicle/report_vehicle.hpp"
#include "protocol/fields.hpp"
#include "protocol/fixed_vector.hpp"
#include "protocol/frame.hpp"

namespace bmu {

struct CellRequestView {
  TimePoint now{};
  const CoreConfig* config = nullptr;
  const ModuleTable* modules = nullptr;
  const VehicleView* vehicle = nullptr;
};

/// The answer to a request to read; none if there is nothing to say. `request` need not be well formed.
[[nodiscard]] std::optional<CanFrame> answer_request(const CanFrame& request, const CellRequestView& view);

/// 14 62: clear the stored fault.
[[nodiscard]] bool is_clear_request(const CanFrame& request);
/// What is said once that is done.
[[nodiscard]] CanFrame clear_answer(const VehicleConfig& vehicle);

class CellRequests {
 public:
  static constexpr std::size_t waiting_max = 8;

  struct Counts {
    std::uint64_t answered = 0;
    std::uint64_t unanswered = 0;  // a PID, cell or value that there is not
    std::uint64_t refused = 0;     // to clear, which the pack file does not allow
    std::uint64_t dropped = 0;     // too many at once
  };

  /// One request of the vehicle's bus.
  void take(const CanFrame& request);
  void note_refused() { ++counts_.refused; }
  [[nodiscard]] bool is_waiting() const { return count_ > 0; }
  /// The answer to the oldest that waits, or none if it has none.
  [[nodiscard]] std::optional<CanFrame> step(const CellRequestView& view);
  void forget() { count_ = 0; }

  [[nodiscard]] const Counts& counts() const { return counts_; }

 private:
  std::array<CanFrame, waiting_max> waiting_{};  // a ring
  std::size_t first_ = 0;
  std::size_t count_ = 0;
  Counts counts_;
  [[nodiscard]] bool are_fields_possible() const { return first_ < waiting_max && count_ <= waiting_max; }
  BMU_FIELDS(waiting_, first_, count_, counts_)
};

}  // namespace bmu
