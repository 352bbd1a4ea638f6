#include "protocol/image.hpp"

namespace bmu {

std::string_view to_text(ImageProblem problem) {
  switch (problem) {
    case ImageProblem::too_short: return "truncated";
    case ImageProblem::too_long: return "trailing data";
    case ImageProblem::no_bool: return "invalid boolean";
    case ImageProblem::no_word: return "invalid enumerator";
    case ImageProblem::no_size: return "too many items";
    case ImageProblem::no_variant: return "invalid alternative";
    case ImageProblem::no_number: return "number out of range";
    case ImageProblem::no_state: return "inconsistent values";
  }
  return "?";
}

}  // namespace bmu
