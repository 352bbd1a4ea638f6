// Emulated device in the vehicle, such as a display or a laptop, that requests data from the master as from a
// Lithiumate (devices/lithiumate_requests). It sends one request for each command of the script; any node can receive
// the answers.
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

  /// `request_id` 0: no requests.
  explicit CanRequester(std::uint32_t request_id) : request_id_(request_id) {}

  [[nodiscard]] std::uint32_t request_id() const { return request_id_; }
  /// Queues a request, by its index in request_words. Dropped if the queue is full.
  void ask(std::size_t word);
  /// The next request, or none.
  [[nodiscard]] std::optional<CanFrame> take();

  std::uint8_t number = 0;  // of the requested cell, bank or battery

 private:
  std::uint32_t request_id_;
  std::array<CanFrame, waiting_max> waiting_{};  // a ring
  std::size_t first_ = 0;
  std::size_t count_ = 0;
};

}  // namespace bmu
