// Derating tables of a cell file: linear between the points, constant outside them.
#include "daemon/core/cell/derating.hpp"

#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

DeratingTable table(std::initializer_list<DeratingPoint> points) {
  DeratingTable made;
  for (const DeratingPoint& point : points) made.points.push_back(point);
  return made;
}

}  // namespace

TEST_CASE("a table is straight between its points and level beyond", "[unit][limits][derating][BMU_15]") {
  const DeratingTable cold = table({{0, 0}, {100, 300}, {250, 1'000}, {400, 1'000}, {500, 200}});
  CHECK(share_permille(cold, -400) == 0);
  CHECK(share_permille(cold, -1) == 0);
  CHECK(share_permille(cold, 0) == 0);
  CHECK(share_permille(cold, 1) == 3);
  CHECK(share_permille(cold, 50) == 150);
  CHECK(share_permille(cold, 99) == 297);
  CHECK(share_permille(cold, 100) == 300);
  CHECK(share_permille(cold, 101) == 304);  // 304 and two thirds, rounded down
  CHECK(share_permille(cold, 249) == 995);
  CHECK(share_permille(cold, 250) == 1'000);
  CHECK(share_permille(cold, 400) == 1'000);
  CHECK(share_permille(cold, 401) == 992);
  CHECK(share_permille(cold, 499) == 208);
  CHECK(share_permille(cold, 500) == 200);
  CHECK(share_permille(cold, 900) == 200);
}

TEST_CASE("a table that is not given takes nothing", "[unit][limits][derating]") {
  CHECK(share_permille({}, 0) == 1'000);
  CHECK(smallest_share_permille({}) == 1'000);
  CHECK_FALSE(DeratingTable{}.is_given());
  CHECK_FALSE(table({{0, 0}}).is_given());
  CHECK(share_permille(table({{0, 0}}), 0) == 1'000);
  CHECK(smallest_share_permille(table({{0, 0}})) == 1'000);
  CHECK(table({{0, 0}, {1, 1}}).is_given());
}

TEST_CASE("while nobody knows where on a table a cell is, its smallest share holds", "[unit][limits][derating]") {
  CHECK(smallest_share_permille(table({{0, 300}, {100, 1'000}, {1'000, 900}})) == 300);
  CHECK(smallest_share_permille(table({{0, 1'000}, {800, 1'000}, {1'000, 400}})) == 400);
  CHECK(smallest_share_permille(table({{0, 500}, {500, 100}, {1'000, 400}})) == 100);
}
