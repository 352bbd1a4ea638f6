#include "daemon/shell/status/measured_json.hpp"

#include <string>

namespace bmu {

void put_measured(JsonText& to, std::string_view stem, Unit unit, const Measured<std::int32_t>& measured,
                  const CoreView& view, Duration age_max) {
  to.put(key_with_unit(stem, unit), if_known(measured.is_usable(view.now, age_max), measured.value));
  to.put(std::string(stem) + "_validity", validity_text(measured, view.now, age_max));
  to.put(std::string(stem) + "_age_ms", ago_ms(view, measured.taken_at));
}

void put_spread(JsonText& to, std::string_view name, const Spread& spread, Unit unit, const CoreView& view) {
  const bool is_known = spread.is_known();
  const auto age_ms = [&](TimePoint at) { return is_known ? ago_ms(view, at) : std::nullopt; };
  to.object(name, [&] {
    to.put(key_with_unit("min", unit), if_known(is_known, spread.min));
    put_element(to, "min_at", is_known ? spread.min_at : Element{}, unit);
    to.put("min_age_ms", age_ms(spread.min_taken_at));
    to.put(key_with_unit("max", unit), if_known(is_known, spread.max));
    put_element(to, "max_at", is_known ? spread.max_at : Element{}, unit);
    to.put("max_age_ms", age_ms(spread.max_taken_at));
    to.put(key_with_unit("average", unit), if_known(is_known, spread.average));
    to.put("count", spread.count);
    to.put("expected", spread.expected);
  });
}

}  // namespace bmu
