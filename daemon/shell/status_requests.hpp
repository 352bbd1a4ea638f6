// The commands a client of the status socket may give, one row each, and what they are answered with.
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "daemon/shell/status_socket.hpp"
#include "daemon/shell/status_view.hpp"

namespace bmu {

class StatusRequests {
 public:
  using MakeView = std::function<StatusView()>;
  using ClearFaults = std::function<void()>;

  /// `clear_faults` returns when the command has been decided on: the reply tells what it did.
  StatusRequests(MakeView make_view, ClearFaults clear_faults);

  /// One request line in, one reply line out; never throws.
  [[nodiscard]] StatusReply answer(std::string_view request) const;
  /// What watching clients get each period: status, cells, faults and why of one instant, as one line.
  [[nodiscard]] std::string picture() const;

  // The rows' functions.
  [[nodiscard]] StatusReply clear() const;
  [[nodiscard]] StatusReply watch(const Json& request) const;
  [[nodiscard]] StatusView view() const { return make_view_(); }

 private:
  MakeView make_view_;
  ClearFaults clear_faults_;
};

}  // namespace bmu
