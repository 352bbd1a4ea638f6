#include "tools/bmucell/data/score_terms.hpp"

#include <nlohmann/json.hpp>

namespace bmu::cell {

nlohmann::ordered_json number_or_null(const std::optional<double>& value) {
  return value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json(nullptr);
}

}  // namespace bmu::cell
