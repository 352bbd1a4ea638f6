// Between GPIO lines and the core: levels become LineImages, outputs are driven, and what fails is one image, too.
//
// A stop that was pressed and let go, or lines that failed and came back, between two decisions must reach the next of
// them: what says "no" for a moment is kept in every image until decided().
#pragma once

#include <optional>
#include <span>

#include "daemon/core/types/line_image.hpp"
#include "daemon/shell/gpio/gpio_lines.hpp"

namespace bmu {

/// What the levels say; stops and interlocks are counted in the order they come, each kind by itself.
[[nodiscard]] LineImage line_image(std::span<const GpioLevel> levels);

/// The first with every "no" of the second: stops pressed, loops open, permissions missing, failed.
[[nodiscard]] LineImage with_doubts(LineImage image, const LineImage& doubts);

class LineFeeder {
 public:
  explicit LineFeeder(GpioLines& lines) : lines_(lines) {}

  /// After an edge, and once a tick before the decision.
  [[nodiscard]] LineImage look();
  /// The decision has been made with the last image; the next doubts are new ones.
  void decided() { doubts_ = no_doubts; }
  /// What was decided. An image: they could be driven so far and now could not, and that is to be observed. Lines that
  /// go on failing are told by look().
  [[nodiscard]] std::optional<LineImage> drive(const ContactorOutputs& outputs);

  [[nodiscard]] GpioLines& lines() const { return lines_; }
  [[nodiscard]] const LineImage& last() const { return last_; }

 private:
  static constexpr LineImage no_doubts{.insulation_ok = true, .supply_ok = true};

  GpioLines& lines_;
  LineImage doubts_ = no_doubts;
  LineImage last_{.is_failed = true};
};

}  // namespace bmu
