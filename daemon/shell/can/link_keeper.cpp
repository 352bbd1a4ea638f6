#include "daemon/shell/can/link_keeper.hpp"

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <utility>

namespace bmu {

namespace {

constexpr std::int64_t tolerance_permille = 5;  // a controller divides its clock, and its rate is not exact

std::string rate_text(std::uint32_t bit_per_s) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%g kbit/s", static_cast<double>(bit_per_s) / 1000);
  return text.data();
}

std::string settings_text(std::uint32_t bit_rate_bit_per_s, std::uint32_t restart_ms) {
  const std::string restart = restart_ms == 0 ? "no restart" : "restart " + std::to_string(restart_ms) + " ms";
  return rate_text(bit_rate_bit_per_s) + ", " + restart + " after bus-off";
}

}  // namespace

std::string_view to_text(SetUp set_up) {
  switch (set_up) {
    case SetUp::not_asked: return "not asked for";
    case SetUp::waits: return "waits for the interface";
    case SetUp::as_wanted: return "was as wanted";
    case SetUp::left_alone: return "is up with other settings";
    case SetUp::done: return "done";
    case SetUp::no_right: return "no right to it";
    case SetUp::failed: return "failed";
  }
  return "?";
}

bool LinkKeeper::is_as_wanted() const {
  const std::int64_t wanted = wanted_->bit_rate_bit_per_s;
  const std::int64_t off = std::abs(std::int64_t{details_.bit_rate_bit_per_s} - wanted);
  return off * 1'000 <= wanted * tolerance_permille && details_.restart_ms == wanted_->restart_ms;
}

bool LinkKeeper::look(const LinkLook& look, TimePoint now) {
  details_ = look.details;
  if (!wanted_) return false;
  if (look.result < 0 || !details_.is_can) {
    // Another one may come under this name, and is reported again.
    if (look.result == -ENODEV) become(SetUp::waits, Severity::info, "");
    return false;
  }
  const std::string found = settings_text(details_.bit_rate_bit_per_s, details_.restart_ms);
  const std::string wanted = settings_text(wanted_->bit_rate_bit_per_s, wanted_->restart_ms);
  if (details_.is_up) {
    if (set_up_ == SetUp::done) return false;  // by this daemon: its settings have been logged
    if (is_as_wanted()) {
      become(SetUp::as_wanted, Severity::info, name_ + ": already up with " + found + " as configured");
    } else {
      become(SetUp::left_alone, Severity::warning,
             name_ + ": up with " + found + ", expected " + wanted +
                 "; left unchanged, will be configured when it is down");
    }
    return false;
  }
  if (!look.has_right) {
    become(SetUp::no_right, Severity::error,
           name_ +
               ": down, and CAP_NET_ADMIN is missing to configure it; let the network manager do it (80-can0.network) "
               "or grant the capability to the service (interfaces.conf); both are in /usr/share/doc/bmud/examples");
    return false;
  }
  return set_up_ != SetUp::failed || now - tried_at_ >= retry;
}

void LinkKeeper::tried(const LinkTried& tried, TimePoint now) {
  tried_at_ = now;
  if (tried.result < 0) {
    return become(SetUp::failed, Severity::error,
                  name_ + ": configuration failed: " + std::strerror(-tried.result) + "; retry every 10 s");
  }
  const std::uint32_t restart_ms = tried.has_restart ? wanted_->restart_ms : 0;
  become(SetUp::done, Severity::info,
         name_ + ": configured: " + settings_text(wanted_->bit_rate_bit_per_s, restart_ms) +
             (tried.has_restart ? "" : " (automatic restart not supported by the driver)"));
}

void LinkKeeper::become(SetUp set_up, Severity severity, const std::string& text) {
  set_up_ = set_up;
  if (std::exchange(told_, text) != text && !text.empty()) lines_.push_back({severity, text});
}

std::vector<LinkLine> LinkKeeper::take_lines() {
  return std::exchange(lines_, {});
}

}  // namespace bmu
