// Adapter between GPIO lines and the core: turns levels and failures into LineImages, and drives the outputs.
//
// A stop that was pressed and released, or lines that failed and came back, between two decisions must reach the next
// of them: a momentary unsafe state is kept in every image until decided().
#pragma once

#include <optional>
#include <span>

#include "daemon/core/types/line_image.hpp"
#include "daemon/shell/gpio/gpio_lines.hpp"

namespace bmu {

/// Image of the levels; stops and interlocks are numbered in their order, each kind by itself.
[[nodiscard]] LineImage line_image(std::span<const GpioLevel> levels);

/// `image` with every unsafe state of `doubts`: stops pressed, loops open, permissions missing, failed.
[[nodiscard]] LineImage with_doubts(LineImage image, const LineImage& doubts);

class LineFeeder {
 public:
  explicit LineFeeder(GpioLines& lines) : lines_(lines) {}

  /// To be called after an edge, and once a tick before the decision.
  [[nodiscard]] LineImage look();
  /// The decision has been made with the last image; unsafe states before it are dropped.
  void decided() { doubts_ = no_doubts; }
  /// Drives the outputs of a decision. Returns an image, to be observed, if they could be driven before and now cannot.
  /// Lines that continue to fail are reported by look().
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
