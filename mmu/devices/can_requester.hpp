// What in the vehicle asks the master for data as a Lithiumate is asked (devices/lithiumate_requests): a display, a
// laptop. It asks when the script says so, once; the answers are on the bus for whoever listens.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "protocol/frame.hpp"

namespace bmu {

class CanRequester {
 public:
  static constexpr std::size_t waiting_max = 16;

  /// `request_id` 0: the master is not asked.
  explicit CanRequester(std::uint32_t request_id) : request_id_(request_id) {}

  [[nodiscard]] std::uint32_t request_id() const { return request_id_; }
  /// By the index in request_words. What does not fit any more is not asked.
  void ask(std::size_t word);
  /// What is asked now, one question after the other.
  [[nodiscard]] std::optional<CanFrame> take();

  std::uint8_t number = 0;  // of the cell, bank or battery that it asks about

 private:
  std::uint32_t request_id_;
  std::array<CanFrame, waiting_max> waiting_{};  // a ring
  std::size_t first_ = 0;
  std::size_t count_ = 0;
};

}  // namespace bmu
