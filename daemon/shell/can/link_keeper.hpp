// One CAN interface as the pack file wants it: set up while it is down, and else only looked at.
//
// Pure; link_watch.hpp looks and acts. An interface that is up is never touched, not even with other settings: it may
// be in use, and somebody wanted it so. That is told, and what to do. Whatever is told is told once.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/core/records/event.hpp"
#include "daemon/shell/can/link_details.hpp"
#include "protocol/time.hpp"

namespace bmu {

struct LinkSettings {
  std::uint32_t bit_rate_bit_per_s = 0;
  std::uint32_t restart_ms = 0;

  friend bool operator==(const LinkSettings&, const LinkSettings&) = default;
};

enum class SetUp : std::uint8_t {
  not_asked,   // the pack file does not want it
  waits,       // there is no such interface yet, or it has nothing to be set
  as_wanted,   // it was up with these settings
  left_alone,  // it is up with others
  done,
  no_right,
  failed,  // tried again every `retry`
};

[[nodiscard]] std::string_view to_text(SetUp set_up);

/// What one look at an interface has shown.
struct LinkLook {
  int result = 0;  // -ENODEV: there is none; other negative errno values: nobody knows
  LinkDetails details{};
  bool has_right = false;  // this process may change link settings
};

/// How setting one up went.
struct LinkTried {
  int result = 0;           // of bit rate and start: a negative errno value is a failure
  bool has_restart = true;  // its driver can come back from bus-off by itself
};

struct LinkLine {
  Severity severity = Severity::info;
  std::string text;
};

class LinkKeeper {
 public:
  static constexpr Duration retry = 10s;

  /// `wanted`: none, it is only looked at.
  LinkKeeper(std::string name, std::optional<LinkSettings> wanted) : name_(std::move(name)), wanted_(wanted) {}

  /// True: set it up now, and say by tried() how that went.
  [[nodiscard]] bool look(const LinkLook& look, TimePoint now);
  void tried(const LinkTried& tried, TimePoint now);
  /// What there is to tell since the last time.
  [[nodiscard]] std::vector<LinkLine> take_lines();

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] const std::optional<LinkSettings>& wanted() const { return wanted_; }
  /// As of the last look; empty while there is no such interface.
  [[nodiscard]] const LinkDetails& details() const { return details_; }
  [[nodiscard]] SetUp set_up() const { return wanted_ ? set_up_ : SetUp::not_asked; }

 private:
  [[nodiscard]] bool is_as_wanted() const;
  void become(SetUp set_up, Severity severity, const std::string& text);

  std::string name_;
  std::optional<LinkSettings> wanted_;
  LinkDetails details_;
  SetUp set_up_ = SetUp::waits;
  TimePoint tried_at_{};
  std::string told_;
  std::vector<LinkLine> lines_;
};

}  // namespace bmu
