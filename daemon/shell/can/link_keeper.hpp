// One CAN interface and the settings of the pack file: set up while it is down, and otherwise only monitored.
//
// Pure; link_watch.hpp reads and acts. An interface that is up is never changed, not even with other settings: it may
// be in use, and an administrator set it up so. That is logged, with the remedy. Each line is logged once.
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
  not_asked,   // not requested by the pack file
  waits,       // there is no such interface yet, or it has no settings
  as_wanted,   // it was up with these settings
  left_alone,  // it is up with others
  done,
  no_right,
  failed,  // retried every `retry`
};

[[nodiscard]] std::string_view to_text(SetUp set_up);

/// Result of one probe of an interface.
struct LinkLook {
  int result = 0;  // -ENODEV: there is none; other negative errno values: its state is unknown
  LinkDetails details{};
  bool has_right = false;  // this process may change link settings
};

/// Result of setting an interface up.
struct LinkTried {
  int result = 0;           // of bit rate and start: a negative errno value is a failure
  bool has_restart = true;  // its driver can recover from bus-off by itself
};

struct LinkLine {
  Severity severity = Severity::info;
  std::string text;
};

class LinkKeeper {
 public:
  static constexpr Duration retry = 10s;

  /// `wanted`: settings; no value: it is only monitored.
  LinkKeeper(std::string name, std::optional<LinkSettings> wanted) : name_(std::move(name)), wanted_(wanted) {}

  /// True: set it up now, and pass the result to tried().
  [[nodiscard]] bool look(const LinkLook& look, TimePoint now);
  void tried(const LinkTried& tried, TimePoint now);
  /// Log lines since the last call.
  [[nodiscard]] std::vector<LinkLine> take_lines();

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] const std::optional<LinkSettings>& wanted() const { return wanted_; }
  /// As of the last probe; empty while there is no such interface.
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
