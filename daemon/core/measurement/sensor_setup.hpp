// Asks the current sensor how it is configured before its results are believed, and configures it where the pack file
// says so.
//
//   reading --all as wanted------------------------------------------------> (starting) --> done
//      |                                                                        ^
//      +--differs, `configure`, pack open--> stopping, setting, checking, (storing)
//      +--differs, does not answer, does not understand--> failed --5 s--> reading
//
// What is wanted of the three results that the daemon uses stands in a table: sent by themselves, with their period, in
// the pack file's byte order, the sign not turned round (that is the pack file's to do). Of the other results nothing
// is asked. Each command has its time and its tries in a table, too. A command is acknowledged even where it is not
// allowed, so what was set is read back. Nothing is stored in the sensor unless the pack file says so, and then only
// what was just set.
//
// Until it is done the results are nobody's: not known, never zero. A sensor that starts anew says so; it is then asked
// again, from the beginning. While contactors are commanded its results go on being used meanwhile, for `trust_max`:
// mostly it comes back as it was, and a healthy pack need not open for it. Wrong byte order shows as thousands of
// amperes, silence is judged by the age of the current as ever, and an answer that differs ends the trust at once. A
// sensor is never stopped while a contactor is commanded.
//
// A second sensor beside the first is asked in the same way for the one result that is used of it, under the
// identifiers that the pack file has for it, and never set otherwise: on a bus with two of them a command for one must
// not reach the other.
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

/// The results that the daemon uses, in the order of their channels.
inline constexpr std::uint8_t sensor_channels_used = 3;
/// In what is told of them, the current of a second sensor comes behind those.
inline constexpr std::uint8_t sensor_channels_told = sensor_channels_used + 1;

/// What is wrong with a sensor's settings.
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
  std::uint8_t channel = 0;  // 0: the current, 1: the pack's voltage, 2: the link's, 3: the second sensor's current
  std::int32_t found = 0;    // a SensorTrigger, milliseconds, or whether it is little-endian, or turned round
  std::int32_t wanted = 0;

  friend constexpr bool operator==(const SensorSetupProblem&, const SensorSetupProblem&) = default;
};

/// Of one that is read from outside.
[[nodiscard]] bool is_possible(const SensorSetupProblem& problem);

/// What is wanted of a channel.
[[nodiscard]] SensorSetting wanted_setting(std::uint8_t channel, const SensorConfig& config);

class SensorSetup {
 public:
  /// After a start in a closed pack results are used unasked for so long at the most.
  static constexpr Duration trust_max = 1s;
  /// A sensor that is configured otherwise, or does not answer, is asked again after this.
  static constexpr Duration retry = 5s;

  void init(const SensorConfig& config);
  /// As that of the second sensor, if it is to be asked.
  void init_second(const SensorConfig& config);
  [[nodiscard]] bool is_there() const { return target_.driver != nullptr; }
  /// A frame under this identifier commands the sensor.
  [[nodiscard]] bool is_command(const CanFrame& frame) const {
    return is_there() && !frame.is_error && !frame.is_remote && !frame.is_extended && frame.id == target_.command_id;
  }
  /// As after a start of the daemon: nothing is known of the sensor.
  void start_over();
  /// A frame of the internal bus. False: it is no answer of the sensor's.
  bool observe(const CanFrame& frame, TimePoint at, bool is_any_commanded);
  /// The command that is due, if any. Once a tick.
  [[nodiscard]] std::optional<CanFrame> step(TimePoint now, bool is_any_commanded);

  /// The sensor's results are what the pack file says.
  [[nodiscard]] bool are_results_good(TimePoint now) const;
  [[nodiscard]] SensorSetupStage stage() const { return stage_; }
  /// Why it was not to be used last; until it is.
  [[nodiscard]] const SensorSetupProblem& problem() const { return problem_; }
  /// It has been found wanting, and not been found good since.
  [[nodiscard]] bool has_failed() const { return problem_.trouble != SensorSetupTrouble::none; }
  /// What it was configured anew for, by channel: none of all where it was found as wanted. Until it is read again.
  [[nodiscard]] const std::array<SensorSetupProblem, sensor_channels_used>& changed() const { return changed_; }
  /// Where its channels begin in what is told: SensorSetupProblem::channel.
  [[nodiscard]] std::uint8_t first_told() const { return target_.first_told; }
  /// It said that it started, so often.
  [[nodiscard]] std::uint32_t restarts() const { return restarts_; }
  /// Answers of the wrong form.
  [[nodiscard]] std::uint64_t answers_refused() const { return answers_refused_; }

 private:
  /// Who is asked, and for what.
  struct Target {
    const SensorSetUpDriver* driver = nullptr;
    std::uint32_t command_id = 0;
    std::uint32_t response_id = 0;
    std::uint8_t channel_count = sensor_channels_used;
    std::uint8_t first_told = 0;  // in what is told, of its channel 0
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
  TimePoint trusted_since_{};  // it started anew with contactors commanded; zero: it did not
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
