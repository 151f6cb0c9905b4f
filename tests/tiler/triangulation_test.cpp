#include "tiler/roofs/triangulation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <set>
#include <utility>
#include <vector>

#include "core/random.h"
#include "tiler/roofs/touching_rings.h"

namespace terracast::test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector2i;
using tiler::RingsSteps;

/// Whether a ring goes round a place, by the angles at which its corners are seen.
bool goes_round(const std::vector<Vector2i>& ring, const Vector2d& at) {
  double angle_rad = 0.0;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Vector2d a = ring[i].cast<double>() - at;
    const Vector2d b = ring[(i + 1) % ring.size()].cast<double>() - at;
    angle_rad += std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b));
  }
  return std::abs(angle_rad) > 3.0;
}

/// Two areas joined by a neck that is narrower than a step, at (1000, 1000), so that rounding parts them. The western
/// one is a C about a notch, and has a hole that is a C as well: its corners' mean lies in the notch.
class ClosedNeck {
 public:
  /// is_framed   the eastern area goes on all around, and the western one lies in its hole
  explicit ClosedNeck(bool is_framed) : is_framed_(is_framed) {
    add_box({-3000, 0}, {2000, 2000});
    if (is_framed) add_box({-4000, -1000}, {3000, 3000});
    // The wedge from above ends where its sides cross, half a step above the tip of the one from below.
    add({{0, 2000}, {1001, 1000}});
    add({{2000, 2000}, {1000, 1000}});
    add({{0, 0}, {1000, 1000}, {2000, 0}});
    add({{2000, 100}, {-2900, 100}, {-2900, 1900}, {2000, 1900}});
    add({{-2900, 800}, {-1000, 800}, {-1000, 1200}, {-2900, 1200}});
    add(kHole);
    add({kHole.back(), kHole.front()});
  }

  const std::vector<std::array<Vector2i, 2>>& edges() const { return edges_; }

  bool is_inside(const Vector2d& at) const {
    const double x = at.x();
    const double y = at.y();
    const auto is_in_box = [&](double west, double south, double east, double north) {
      return x > west && x < east && y > south && y < north;
    };
    if (!is_in_box(-3000, 0, 2000, 2000)) return is_framed_ && is_in_box(-4000, -1000, 3000, 3000);
    if (y > 2000.0 - x * 1000.0 / 1001.0 && y > x) return false;
    if (y < x && y < 2000.0 - x) return false;
    const bool is_in_hole = is_in_box(-2800, 300, -400, 1700) && !is_in_box(-2800, 500, -600, 1500);
    return is_in_box(-2900, 100, 2000, 1900) && !is_in_box(-2900, 800, -1000, 1200) && !is_in_hole;
  }

  inline static const std::vector<Vector2i> kHole = {{-2800, 300},  {-400, 300},   {-400, 1700},
                                                     {-2800, 1700}, {-2800, 1500}, {-600, 1500},
                                                     {-600, 500},   {-2800, 500}};

 private:
  void add(const std::vector<Vector2i>& line) {
    for (std::size_t i = 0; i + 1 < line.size(); ++i) edges_.push_back({line[i], line[i + 1]});
  }
  void add_box(const Vector2i& low, const Vector2i& high) {
    add({low, {high.x(), low.y()}, high, {low.x(), high.y()}, low});
  }

  bool is_framed_;
  std::vector<std::array<Vector2i, 2>> edges_;
};

TEST(PolygonsWhere, AConcaveHoleLiesInTheOneOuterRingAboutIt) {
  for (const bool is_framed : {false, true}) {
    SCOPED_TRACE(is_framed ? "one in the other's hole" : "side by side");
    const ClosedNeck areas(is_framed);
    const std::vector<RingsSteps> polygons = tiler::polygons_where(
        areas.edges(), [&](const Vector2d& at) { return areas.is_inside(at); });
    EXPECT_EQ(polygons.size(), 2u);
    std::size_t num_holes = 0;
    for (const RingsSteps& polygon : polygons) {
      num_holes += polygon.size() - 1;
      EXPECT_GT(tiler::doubled_area(polygon.front()), 0.0);
    }
    EXPECT_EQ(num_holes, is_framed ? 2u : 1u);
    // All places but those that rounding may have moved across a border: none lies within 2 steps of one, for the
    // corners are multiples of 100 or on lines about 45 degrees steep through them.
    for (int i = -4100; i < 3100; i += 50)
      for (int j = -1100; j < 3100; j += 50) {
        const Vector2d at(i + 21.0, j + 33.0);
        const auto count = std::count_if(polygons.begin(), polygons.end(), [&](const auto& rings) {
          return goes_round(rings.front(), at) &&
                 std::none_of(rings.begin() + 1, rings.end(),
                              [&](const auto& hole) { return goes_round(hole, at); });
        });
        ASSERT_EQ(count, areas.is_inside(at) ? 1 : 0) << "at " << at.transpose();
      }
  }
}

/// A square of 1000 steps with holes, of which places are told apart by rings as they were given.
struct Square {
  RingsSteps holes;

  RingsSteps rings() const {
    RingsSteps rings = {{{0, 0}, {1000, 0}, {1000, 1000}, {0, 1000}}};
    rings.insert(rings.end(), holes.begin(), holes.end());
    return rings;
  }
  bool is_inside(const Vector2d& at) const {
    return goes_round(rings().front(), at) &&
           std::none_of(holes.begin(), holes.end(),
                        [&](const auto& hole) { return goes_round(hole, at); });
  }
};

/// Twice the area of all polygons.
double doubled_area(const std::vector<RingsSteps>& polygons) {
  double doubled = 0.0;
  for (const RingsSteps& polygon : polygons)
    for (const auto& ring : polygon) doubled += tiler::doubled_area(ring);
  return doubled;
}

std::int64_t num_about(const std::vector<RingsSteps>& polygons, const Vector2d& at) {
  return std::count_if(polygons.begin(), polygons.end(), [&](const auto& rings) {
    return goes_round(rings.front(), at) &&
           std::none_of(rings.begin() + 1, rings.end(),
                        [&](const auto& hole) { return goes_round(hole, at); });
  });
}

void expect_all_of(const Square& square, double doubled, std::size_t most_polygons) {
  const std::vector<RingsSteps> polygons = tiler::repaired(square.rings());
  EXPECT_EQ(doubled_area(polygons), doubled);
  EXPECT_GE(polygons.size(), 1U);
  EXPECT_LE(polygons.size(), most_polygons);
  for (const RingsSteps& polygon : polygons) EXPECT_TRUE(tiler::is_valid(polygon));
  // No place lies on a line between corners, whose coordinates are multiples of 100 and no more than 1000 apart.
  for (int i = -50; i < 1050; i += 20)
    for (int j = -50; j < 1050; j += 20) {
      const Vector2d at(i + 0.137, j + 0.0713);
      ASSERT_EQ(num_about(polygons, at), square.is_inside(at) ? 1 : 0) << "at " << at.transpose();
    }
}

// Seen in November 2026: holes that touch the border were filled.
TEST(Repaired, KeepsHolesThatTouchTheBorder) {
  constexpr double kAll = 2e6;  // twice the square
  const auto check = [&](const char* what, const RingsSteps& holes, double doubled_holes,
                         std::size_t most_polygons) {
    SCOPED_TRACE(what);
    expect_all_of({holes}, kAll - doubled_holes, most_polygons);
    // Turned the other way, by a quarter (about the square's middle), and with the rings begun elsewhere.
    RingsSteps turned = holes;
    for (auto& hole : turned) {
      for (Vector2i& point : hole) point = Vector2i(1000 - point.y(), point.x());
      std::reverse(hole.begin(), hole.end());
      std::rotate(hole.begin(), hole.begin() + 1, hole.end());
    }
    expect_all_of({turned}, kAll - doubled_holes, most_polygons);
  };
  const std::vector<Vector2i> corner_down = {{500, 0}, {700, 400}, {300, 400}};
  const std::vector<Vector2i> box = {{400, 400}, {400, 600}, {600, 600}, {600, 400}};
  // Cut in two at the least, for the ground beside the point is on either side of it.
  check("at a point of an edge", {corner_down}, 160000, 2);
  check("at a corner", {{{0, 0}, {400, 200}, {200, 400}}}, 120000, 2);
  check("at two points", {{{500, 0}, {700, 500}, {500, 1000}, {300, 500}}}, 400000, 2);
  check("at a point, another hole free", {corner_down, {{600, 700}, {600, 800}, {700, 700}}},
        170000, 2);
  // A bay of the border: one polygon.
  check("along an edge", {{{300, 0}, {700, 0}, {700, 400}, {300, 400}}}, 320000, 1);
  check("along two edges at a corner", {{{0, 0}, {400, 0}, {400, 400}, {0, 400}}}, 320000, 1);
  check("along an edge and at a point across", {{{300, 0}, {700, 0}, {500, 1000}}}, 400000, 2);
  // Each other.
  check("two at a point", {box, {{600, 600}, {800, 600}, {800, 800}, {600, 800}}}, 160000, 2);
  check("two along an edge", {box, {{600, 400}, {600, 600}, {800, 600}, {800, 400}}}, 160000, 1);
  check("two at a point of an edge", {box, {{600, 500}, {800, 400}, {800, 600}}}, 120000, 2);
  // The ground amid them is a polygon of its own.
  check("a ring of four",
        {{{400, 200}, {600, 200}, {600, 400}, {400, 400}},
         {{600, 400}, {800, 400}, {800, 600}, {600, 600}},
         {{400, 600}, {600, 600}, {600, 800}, {400, 800}},
         {{200, 400}, {400, 400}, {400, 600}, {200, 600}}},
        320000, 2);
  check("two at a point of the border", {corner_down, {{500, 0}, {900, 100}, {800, 300}}}, 250000,
        3);
}

// Holes are cells of a square, drawn at random, which touch each other and the border in all ways: what is left are the
// other cells.
TEST(Repaired, KeepsAllOtherCellsWhereCellsAreHoles) {
  constexpr int kCells = 6, kSide = 100, kPatterns = 300;
  constexpr std::uint64_t kSeed = 1;
  for (std::uint64_t pattern = 0; pattern < kPatterns; ++pattern) {
    SCOPED_TRACE(pattern);
    RingsSteps rings = {{{0, 0}, {600, 0}, {600, 600}, {0, 600}}};
    std::array<bool, kCells* kCells> is_hole = {};
    const double share = 0.1 + 0.6 * core::random_unit(kSeed, pattern, kCells * kCells);
    for (int cell = 0; cell < kCells * kCells; ++cell) {
      if (core::random_unit(kSeed, pattern, static_cast<std::uint64_t>(cell)) >= share) continue;
      is_hole[static_cast<std::size_t>(cell)] = true;
      const Vector2i low = kSide * Vector2i(cell % kCells, cell / kCells);
      rings.push_back(
          {low, low + Vector2i(kSide, 0), low + Vector2i(kSide, kSide), low + Vector2i(0, kSide)});
    }
    const std::vector<RingsSteps> polygons = tiler::repaired(rings);
    const auto num_left = std::count(is_hole.begin(), is_hole.end(), false);
    ASSERT_EQ(doubled_area(polygons), 2.0 * kSide * kSide * static_cast<double>(num_left));
    for (const RingsSteps& polygon : polygons) ASSERT_TRUE(tiler::is_valid(polygon));
    for (int cell = 0; cell < kCells * kCells; ++cell) {
      const Vector2d at = kSide * Vector2d(cell % kCells + 0.43, cell / kCells + 0.37);
      ASSERT_EQ(num_about(polygons, at), is_hole[static_cast<std::size_t>(cell)] ? 0 : 1) << cell;
    }
  }
}

/// Cells of a square as holes, drawn at random: steps are counted, not timed.
TEST(CutWhereRingsTouch, TakesStepsByTheSquareOfCorners) {
  constexpr int kSide = 100;
  for (const int num_cells : {12, 24, 48}) {
    RingsSteps rings = {{{0, 0},
                         {kSide * num_cells, 0},
                         {kSide * num_cells, kSide * num_cells},
                         {0, kSide * num_cells}}};
    double doubled = tiler::doubled_area(rings.front());
    std::set<std::pair<int, int>> corners;
    for (int cell = 0; cell < num_cells * num_cells; ++cell) {
      if (core::random_unit(2, 0, static_cast<std::uint64_t>(cell)) >= 0.4) continue;
      const Vector2i low = kSide * Vector2i(cell % num_cells, cell / num_cells);
      rings.push_back(
          {low, low + Vector2i(0, kSide), low + Vector2i(kSide, kSide), low + Vector2i(kSide, 0)});
      for (const Vector2i& corner : rings.back()) corners.emplace(corner.x(), corner.y());
      doubled -= 2.0 * kSide * kSide;
    }
    std::int64_t num_steps = 0;
    const auto polygons = tiler::cut_where_rings_touch(rings, &num_steps);
    ASSERT_TRUE(polygons);
    EXPECT_EQ(doubled_area(*polygons), doubled);
    const auto num_corners = static_cast<std::int64_t>(corners.size());
    EXPECT_GT(num_corners, num_cells * num_cells / 2);
    EXPECT_GE(num_steps, num_corners);
    EXPECT_LE(num_steps, num_corners * num_corners);
  }
}

// Seen in November 2026 as a hole that was filled: the ground closes about a court at one point.
TEST(Repaired, KeepsACourtWhoseRingComesBackToItsCorner) {
  const std::vector<RingsSteps> polygons = tiler::repaired(
      {{{0, 0}, {500, 0}, {300, 400}, {700, 400}, {500, 0}, {1000, 0}, {1000, 1000}, {0, 1000}}});
  EXPECT_EQ(doubled_area(polygons), 2e6 - 160000);
  EXPECT_EQ(polygons.size(), 2U);
  for (const RingsSteps& polygon : polygons) EXPECT_TRUE(tiler::is_valid(polygon));
}

}  // namespace
}  // namespace terracast::test
