#include "daemon/core/core_image.hpp"

namespace bmu {

static_assert(image_names_all_fields<Core>);

std::uint64_t core_image_layout() {
  return image_layout<Core>;
}

std::size_t core_image_size(const Core& core) {
  return image_size(core);
}

void write_core_image(const Core& core, std::span<std::uint8_t> to) {
  static_cast<void>(write_image(core, to));
}

std::optional<ImageProblem> read_core_image(std::span<const std::uint8_t> bytes, Core& core) {
  return read_image(bytes, core);
}

}  // namespace bmu
