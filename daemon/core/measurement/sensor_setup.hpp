// Reads the configuration of the current sensor before its results are used, and configures the sensor if the pack file
// requires it.
//
//   reading --all as expected----------------------------------------------> (starting) --> done
//      |                                                                        ^
//      +--differs, `configure`, pack open--> stopping, setting, checking, (storing)
//      +--differs, does not answer, does not understand--> failed --5 s--> reading
//
// The expected settings of the three results that the daemon uses are in a table: sent cyclically, with their period,
// in the byte order of the pack file, the sign not inverted (the pack file does that). The other results are not
// checked. The timeout and the number of attempts of each command are in a table, too. A command is acknowledged even
// if it is not permitted, so settings are read back. Nothing is stored in the sensor unless the pack file requires it,
// and then only settings that were just changed.
//
// Until it is done the results are not used: unknown, never zero. A sensor reports its restart; it is then read again,
// from the beginning. While contactors are commanded its results are still used meanwhile, for `trust_max`: usually its
// settings are unchanged, and a healthy pack need not open for it. A wrong byte order shows as thousands of amperes, a
// receive timeout is detected by the age of the current as usual, and an answer that differs ends the use of the
// results immediately. A sensor is never stopped while a contactor is commanded.
//
// A second sensor beside the first is read in the same way for the one result that is used of it, with the identifiers
// that the pack file has for it, and never configured: on a bus with two of them a command for one must not reach the
// other.
//
// Cost: nothing once it is done.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "daemon/core/types/core_config.hpp"
#include "protocol/fields.hpp"
#include "protocol/frame.hpp"

namespace bmu {

enum class SensorSetupStage : std::uint8_t {
  reading,
  stopping,
  setting,
  checking,
  storing,
  starting,
  done,
  failed,
};

[[nodiscard]] std::string_view to_text(SensorSetupStage stage);

/// Results that the daemon uses, in the order of their channels.
inline constexpr std::uint8_t sensor_channels_used = 3;
/// In reports, the current of a second sensor follows these.
inline constexpr std::uint8_t sensor_channels_told = sensor_channels_used + 1;

/// Difference or error in the settings of a sensor.
enum class SensorSetupTrouble : std::uint8_t {
  none,
  no_answer,
  not_understood,
  trigger,
  period,
  byte_order,
  sign,
};

struct SensorSetupProblem {
  SensorSetupTrouble trouble = SensorSetupTrouble::none;
  std::uint8_t channel = 0;  // 0: current, 1: pack voltage, 2: DC link voltage, 3: current of the second sensor
  std::int32_t found = 0;    // SensorTrigger, milliseconds, or 1 for little-endian or inverted
  std::int32_t wanted = 0;

  friend constexpr bool operator==(const SensorSetupProblem&, const SensorSetupProblem&) = default;
};

/// Validity of a problem that was read from outside.
[[nodiscard]] bool is_possible(const SensorSetupProblem& problem);

/// Expected setting of a channel.
[[nodiscard]] SensorSetting wanted_setting(std::uint8_t channel, const SensorConfig& config);

class SensorSetup {
 public:
  /// Maximum time for which results are used without a check after a restart in a closed pack.
  static constexpr Duration trust_max = 1s;
  /// Delay before a sensor that is configured otherwise, or does not answer, is read again.
  static constexpr Duration retry = 5s;

  void init(const SensorConfig& config);
  /// For the second sensor, if its settings are to be read.
  void init_second(const SensorConfig& config);
  [[nodiscard]] bool is_there() const { return target_.driver != nullptr; }
  /// A frame with this identifier is a command to the sensor.
  [[nodiscard]] bool is_command(const CanFrame& frame) const {
    return is_there() && !frame.is_error && !frame.is_remote && !frame.is_extended && frame.id == target_.command_id;
  }
  /// As after a start of the daemon: the settings of the sensor are unknown.
  void start_over();
  /// A frame of the internal bus. False: not an answer of the sensor.
  bool observe(const CanFrame& frame, TimePoint at, bool is_any_commanded);
  /// The command that is due, if any. Called once a tick.
  [[nodiscard]] std::optional<CanFrame> step(TimePoint now, bool is_any_commanded);

  /// The results may be used: the settings are as expected, or `trust_max` has not elapsed.
  [[nodiscard]] bool are_results_good(TimePoint now) const;
  [[nodiscard]] SensorSetupStage stage() const { return stage_; }
  /// Last reason why the results are not used; `none` after success.
  [[nodiscard]] const SensorSetupProblem& problem() const { return problem_; }
  /// Its settings differed or it did not answer, and no check has succeeded since.
  [[nodiscard]] bool has_failed() const { return problem_.trouble != SensorSetupTrouble::none; }
  /// Settings that were corrected, by channel: all `none` if they were as expected. Valid until they are read again.
  [[nodiscard]] const std::array<SensorSetupProblem, sensor_channels_used>& changed() const { return changed_; }
  /// First channel number of this sensor in reports, see SensorSetupProblem::channel.
  [[nodiscard]] std::uint8_t first_told() const { return target_.first_told; }
  /// Number of restarts that the sensor reported.
  [[nodiscard]] std::uint32_t restarts() const { return restarts_; }
  /// Answers of the wrong form.
  [[nodiscard]] std::uint64_t answers_refused() const { return answers_refused_; }

 private:
  /// The sensor, and the settings to read and write.
  struct Target {
    const SensorSetUpDriver* driver = nullptr;
    std::uint32_t command_id = 0;
    std::uint32_t response_id = 0;
    std::uint8_t channel_count = sensor_channels_used;
    std::uint8_t first_told = 0;  // in reports, of its channel 0
    bool is_configured = false;
    bool is_stored = false;
  };

  void enter(SensorSetupStage stage);
  void advance();
  void take_setting(const SetUpAnswer& answer, TimePoint at);
  void take_restart(TimePoint at, bool is_any_commanded);
  void fail(const SensorSetupProblem& problem, TimePoint at);
  void note_changes();
  void judge(TimePoint now, bool is_any_commanded);
  [[nodiscard]] SensorSetupProblem difference() const;
  [[nodiscard]] SetUpOrder order_now() const;
  [[nodiscard]] std::uint8_t told(std::uint8_t channel) const {
    return static_cast<std::uint8_t>(target_.first_told + channel);
  }

  SensorConfig config_;
  Target target_;
  SensorSetupStage stage_ = SensorSetupStage::reading;
  std::uint8_t channel_ = 0;
  std::uint8_t tries_ = 0;
  TimePoint asked_at_{};  // zero: not yet
  bool is_judgement_due_ = false;
  std::array<SensorSetting, sensor_channels_used> found_{};
  SensorSetupProblem problem_;
  std::array<SensorSetupProblem, sensor_channels_used> changed_{};
  TimePoint failed_at_{};
  TimePoint trusted_since_{};  // restart while contactors were commanded; zero: none
  std::uint32_t restarts_ = 0;
  std::uint64_t answers_refused_ = 0;
  [[nodiscard]] bool are_fields_possible() const {
    return channel_ < sensor_channels_used && is_possible(problem_) &&
           std::all_of(changed_.begin(), changed_.end(), is_possible);
  }
  BMU_FIELDS(skipped(config_), skipped(target_), stage_, channel_, tries_, asked_at_, is_judgement_due_, found_,
             problem_, changed_, failed_at_, trusted_since_, restarts_, answers_refused_)
};

}  // namespace bmu
