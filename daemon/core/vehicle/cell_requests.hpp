// Data requests in the format of a Lithiumate: a frame with `request_id` (745h) requests one value by its number (PID),
// the answer has `reply_id` (74Dh). Diagnostic tools and displays made for that system can poll this daemon.
//
//   request   b0 bytes that follow (3)   b1 10h read, 14h clear   b2 PID   b3 cell, bank or battery, else 0
//   answer    b0 bytes that follow       b1 50h, 54h              b2, b3 as requested             b4 on: the data
//
// All readable values of cells, banks, batteries, the pack and the system are answered, and 14 62, which clears stored
// faults as a user's command does, where the pack file permits it (vehicle/may_clear_faults). Nothing else is: no
// setting is read or written, no output forced. An unsupported PID, a cell that does not exist, and an unknown value
// get no answer: the encodings have no code for "unknown", and every number would be taken as valid.
//
// Differences from a Lithiumate, due to the different pack:
//   - cells are numbered from 1 as in 623h; a bank is a module, in the order of the pack file, from 0; there is one
//     battery, 0, which is the pack.
//   - temperatures are those of the sensors on the cells, not of boards: of a cell, the average of its module's. With
//     loads on or off they are the same, and both fields carry it. Their numbers are the sensors' as in 627h.
//   - only one current exists: into the pack it is the source's, out of it the load's.
//   - power cycles (60h) are starts of the daemon in which it has received data of the whole pack; no answer before
//     that, nor without persistent state. 65535 stands for more, too.
//
// Any number of requests is accepted, one is answered per tick; more than eight waiting ones are dropped and counted.
// Pure; an answer about all cells of a large pack takes some microseconds.
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

/// The answer to a read request; none if there is no value. `request` need not be well formed.
[[nodiscard]] std::optional<CanFrame> answer_request(const CanFrame& request, const CellRequestView& view);

/// 14 62: clear the stored fault.
[[nodiscard]] bool is_clear_request(const CanFrame& request);
/// The answer after that is done.
[[nodiscard]] CanFrame clear_answer(const VehicleConfig& vehicle);

class CellRequests {
 public:
  static constexpr std::size_t waiting_max = 8;

  struct Counts {
    std::uint64_t answered = 0;
    std::uint64_t unanswered = 0;  // PID or cell does not exist, or the value is unknown
    std::uint64_t refused = 0;     // clear requests that the pack file does not permit
    std::uint64_t dropped = 0;     // too many at once
  };

  /// Queues one request of the vehicle bus.
  void take(const CanFrame& request);
  void note_refused() { ++counts_.refused; }
  [[nodiscard]] bool is_waiting() const { return count_ > 0; }
  /// The answer to the oldest waiting request, or none if it has none.
  [[nodiscard]] std::optional<CanFrame> step(const CellRequestView& view);
  void forget() { count_ = 0; }

  [[nodiscard]] const Counts& counts() const { return counts_; }

 private:
  std::array<CanFrame, waiting_max> waiting_{};  // ring buffer
  std::size_t first_ = 0;
  std::size_t count_ = 0;
  Counts counts_;
  [[nodiscard]] bool are_fields_possible() const { return first_ < waiting_max && count_ <= waiting_max; }
  BMU_FIELDS(waiting_, first_, count_, counts_)
};

}  // namespace bmu
