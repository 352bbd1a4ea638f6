#include "protocol/image.hpp"

namespace bmu {

std::string_view to_text(ImageProblem problem) {
  switch (problem) {
    case ImageProblem::too_short: return "it ends too soon";
    case ImageProblem::too_long: return "something is left over";
    case ImageProblem::no_bool: return "a truth value that is neither 0 nor 1";
    case ImageProblem::no_word: return "a word that there is not";
    case ImageProblem::no_size: return "more items than there is room for";
    case ImageProblem::no_variant: return "an alternative that there is not";
    case ImageProblem::no_number: return "a number further from 0 than any can be";
    case ImageProblem::no_state: return "numbers that cannot be together, or not there";
  }
  return "?";
}

}  // namespace bmu
