#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "core/parallel.h"
#include "tiler/vegetation/species.h"
#include "world/tile_id.h"

namespace terracast::test {
namespace {

using Eigen::Vector3d;
using tiler::SpeciesInfo;
using world::Material;
using world::Shape;

Vector3d place_m(const Shape& shape, std::uint32_t vertex) {
  return shape.vertices_steps[vertex].cast<double>() * world::kHeightStep_m;
}

struct Extents {
  Vector3d lowest = Vector3d::Constant(1e9);
  Vector3d highest = Vector3d::Constant(-1e9);
};

Extents extents_of(const Shape& shape) {
  Extents extents;
  for (std::uint32_t i = 0; i < shape.vertices_steps.size(); ++i) {
    extents.lowest = extents.lowest.cwiseMin(place_m(shape, i));
    extents.highest = extents.highest.cwiseMax(place_m(shape, i));
  }
  return extents;
}

/// Whether the line through `point` along `direction` meets a triangle (Moeller and Trumbore 1997).
bool line_meets(const Vector3d& point, const Vector3d& direction, const Vector3d& a,
                const Vector3d& b, const Vector3d& c) {
  const Vector3d p = direction.cross(c - a);
  const double determinant = p.dot(b - a);
  if (std::abs(determinant) < 1e-12) return false;
  const double u = p.dot(point - a) / determinant;
  const Vector3d q = (point - a).cross(b - a);
  const double v = q.dot(direction) / determinant;
  return u >= 0.0 && v >= 0.0 && u + v <= 1.0;
}

/// Share of parallel lines through a box round `extents` that a shape stops, by trying every triangle:
/// of lines from the sides, aslant and from above.
double stopped_share(const Shape& shape, const Extents& extents) {
  const Vector3d center = 0.5 * (extents.lowest + extents.highest);
  const double reach_m = 0.5 * (extents.highest - extents.lowest).norm();
  const std::vector<Vector3d> directions = {
      {1, 0.2, 0}, {-0.3, 1, 0}, {0.8, 0.7, -0.9}, {-0.7, 0.4, -0.8}, {0.02, 0.01, -1}};
  constexpr int kSide = 72;
  int num_stopped = 0;
  for (const Vector3d& direction : directions) {
    const Vector3d along = direction.normalized();
    const Vector3d x = along.unitOrthogonal();
    const Vector3d y = along.cross(x);
    std::vector<std::uint8_t> is_stopped(kSide * kSide, 0);
    for (const Shape::Triangle& triangle : shape.triangles) {
      const Vector3d corners[3] = {place_m(shape, triangle.corners[0]),
                                   place_m(shape, triangle.corners[1]),
                                   place_m(shape, triangle.corners[2])};
      int lowest[2] = {kSide, kSide};
      int highest[2] = {-1, -1};
      for (const Vector3d& corner : corners) {
        const double at[2] = {(corner - center).dot(x), (corner - center).dot(y)};
        for (int k = 0; k < 2; ++k) {
          const double cell = (at[k] / reach_m * 0.5 + 0.5) * kSide;
          lowest[k] = std::min(lowest[k], static_cast<int>(std::floor(cell)) - 1);
          highest[k] = std::max(highest[k], static_cast<int>(std::ceil(cell)) + 1);
        }
      }
      for (int j = std::max(lowest[1], 0); j <= std::min(highest[1], kSide - 1); ++j)
        for (int i = std::max(lowest[0], 0); i <= std::min(highest[0], kSide - 1); ++i) {
          std::uint8_t& stopped = is_stopped[static_cast<std::size_t>(j * kSide + i)];
          if (stopped != 0) continue;
          const Vector3d point = center + reach_m * (2.0 * (i + 0.5) / kSide - 1.0) * x +
                                 reach_m * (2.0 * (j + 0.5) / kSide - 1.0) * y;
          if (line_meets(point, along, corners[0], corners[1], corners[2])) stopped = 1;
        }
    }
    num_stopped += static_cast<int>(std::count(is_stopped.begin(), is_stopped.end(), 1));
  }
  return num_stopped / static_cast<double>(directions.size() * kSide * kSide);
}

struct Grown {
  const SpeciesInfo* species;
  int variety;
  world::ShapeLevels levels;
};

/// All varieties of all species, with their levels.
const std::vector<Grown>& all_grown() {
  static const std::vector<Grown> grown = [] {
    std::vector<Grown> all;
    for (const SpeciesInfo& species : tiler::all_species())
      for (int variety = 0; variety < species.num_varieties; ++variety)
        all.push_back({&species, variety, {}});
    core::parallel_for(static_cast<std::int64_t>(all.size()), [&](std::int64_t i) {
      Grown& one = all[static_cast<std::size_t>(i)];
      one.levels =
          tiler::levels_of(tiler::grow_variety(*one.species, one.variety), one.species->levels);
    });
    return all;
  }();
  return grown;
}

std::string name_of(const Grown& grown) {
  return fmt::format("{} {}", grown.species->name, grown.variety);
}

TEST(VegetationSpecies, TheTableIsSortedAndHasThePlantsThatLandNeeds) {
  std::vector<std::string> names;
  for (const SpeciesInfo& species : tiler::all_species()) names.emplace_back(species.name);
  EXPECT_TRUE(std::is_sorted(names.begin(), names.end()));
  EXPECT_THAT(names,
              testing::IsSupersetOf({"oak", "birch", "spruce", "pine", "dead_tree", "palm", "bush",
                                     "grass", "reed", "corn", "wheat", "vine", "boulder"}));
}

TEST(VegetationSpecies, MeshesAreSane) {
  for (const Grown& grown : all_grown())
    for (const world::ShapeLevel& level : grown.levels) {
      SCOPED_TRACE(fmt::format("{} up to level {}", name_of(grown), level.coarsest_level));
      const Shape& shape = level.shape;
      ASSERT_FALSE(shape.triangles.empty());
      ASSERT_LE(shape.finishes.size(), 256U);
      std::set<std::array<std::array<int, 3>, 3>> places;
      std::size_t num_degenerate = 0;
      std::size_t num_coincident = 0;
      for (const Shape::Triangle& triangle : shape.triangles) {
        ASSERT_LT(triangle.finish, shape.finishes.size());
        std::array<std::array<int, 3>, 3> corners;
        for (std::size_t k = 0; k < 3; ++k) {
          ASSERT_LT(triangle.corners[k], shape.vertices_steps.size());
          const Eigen::Vector3i& vertex = shape.vertices_steps[triangle.corners[k]];
          corners[k] = {vertex.x(), vertex.y(), vertex.z()};
          ASSERT_LT(vertex.cwiseAbs().maxCoeff(),
                    64 * 1024);  // a NaN or a runaway is no int of these
        }
        const Vector3d a = place_m(shape, triangle.corners[0]);
        const Vector3d normal = (place_m(shape, triangle.corners[1]) - a)
                                    .cross(place_m(shape, triangle.corners[2]) - a);
        if (normal.norm() == 0.0) ++num_degenerate;
        std::sort(corners.begin(), corners.end());
        if (!places.insert(corners).second) ++num_coincident;
      }
      EXPECT_EQ(num_degenerate, 0U);
      EXPECT_EQ(num_coincident, 0U);
      // Feet are in the ground, and nothing hangs far below it.
      const Extents extents = extents_of(shape);
      EXPECT_LT(extents.lowest.z(), 0.0);
      EXPECT_GT(extents.lowest.z(), -1.6);
    }
}

TEST(VegetationSpecies, TrunksBranchesAndStonesAreClosedAndOrientedOutward) {
  for (const Grown& grown : all_grown())
    for (const world::ShapeLevel& level : grown.levels) {
      SCOPED_TRACE(fmt::format("{} up to level {}", name_of(grown), level.coarsest_level));
      std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
      double volume_m3 = 0.0;
      std::size_t num_solid = 0;
      for (const Shape::Triangle& triangle : level.shape.triangles) {
        const Material material = level.shape.finishes[triangle.finish].material;
        if (material != Material::Bark && material != Material::Boulder &&
            material != Material::Planks)
          continue;
        ++num_solid;
        for (std::size_t k = 0; k < 3; ++k)
          ++edges[{triangle.corners[k], triangle.corners[(k + 1) % 3]}];
        volume_m3 += place_m(level.shape, triangle.corners[0])
                         .dot(place_m(level.shape, triangle.corners[1])
                                  .cross(place_m(level.shape, triangle.corners[2]))) /
                     6.0;
      }
      for (const auto& [edge, count] : edges) {
        ASSERT_EQ(count, 1);
        ASSERT_TRUE(edges.contains({edge.second, edge.first}));
      }
      EXPECT_TRUE(num_solid == 0 || volume_m3 > 0.0) << volume_m3;
    }
}

TEST(VegetationSpecies, LevelsStayWithinTheirTrianglesAndGetFewer) {
  for (const Grown& grown : all_grown()) {
    SCOPED_TRACE(name_of(grown));
    ASSERT_EQ(grown.levels.size(), grown.species->levels.size());
    for (std::size_t i = 0; i < grown.levels.size(); ++i) {
      const std::size_t num_triangles = grown.levels[i].shape.triangles.size();
      EXPECT_LE(num_triangles, static_cast<std::size_t>(grown.species->levels[i].max_triangles));
      if (i == 0) continue;
      EXPECT_GT(grown.levels[i].coarsest_level, grown.levels[i - 1].coarsest_level);
      EXPECT_LT(num_triangles, grown.levels[i - 1].shape.triangles.size());
    }
    EXPECT_LE(grown.levels.front().shape.triangles.size(), 6000U);
  }
}

TEST(VegetationSpecies, LevelsKeepTheAreaThatIsSeenAndTheHeight) {
  for (const Grown& grown : all_grown()) {
    SCOPED_TRACE(name_of(grown));
    const Shape& finest = grown.levels.front().shape;
    const Extents extents = extents_of(finest);
    const double share = stopped_share(finest, extents);
    const double height_m = extents.highest.z();
    const bool has_leaves = grown.species->name != "dead_tree";
    // A stone of 20 triangles is as large as the round one only where its corners stand out.
    const double outward = grown.species->name == "boulder" ? 0.17 : 0.06;
    for (std::size_t i = 1; i < grown.levels.size(); ++i) {
      const Shape& shape = grown.levels[i].shape;
      // The area is fitted in other views; lines 1/72 of the extent apart see it within some per
      // cent. A bare tree has nothing to make up for the twigs that are left out.
      EXPECT_NEAR(stopped_share(shape, extents) / share, 1.0, has_leaves ? 0.12 : 0.4) << i;
      // Branches end below the sprays of leaves that are gathered into one.
      EXPECT_NEAR(extents_of(shape).highest.z(), height_m, outward * height_m) << i;
      // What is drawn as leaves fills the crown's width; a hull has no gaps, and is narrower for it.
      for (int k = 0; k < 2; ++k) {
        const double width_m = extents.highest[k] - extents.lowest[k];
        const double own_m = extents_of(shape).highest[k] - extents_of(shape).lowest[k];
        EXPECT_LT(own_m, (1.06 + outward) * width_m) << i;
        EXPECT_GT(own_m, 0.4 * width_m) << i;
      }
    }
  }
}

TEST(VegetationSpecies, SeenAreaIsThatOfAClosedForm) {
  // A box of 1 x 2 x 3 m shows 2 m2 from above; from the side at heading a it shows
  // 3 (|cos a| + 2 |sin a|) or with the cosine and sine exchanged, and aslant at 45 degrees the mean of both.
  Shape box;
  for (int i = 0; i < 8; ++i)
    box.vertices_steps.emplace_back((i & 1) * 1024, (i >> 1 & 1) * 2048, (i >> 2) * 3072);
  const std::array<std::array<std::uint32_t, 4>, 6> sides = {
      {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}};
  for (const auto& side : sides) {
    box.triangles.push_back({{side[0], side[1], side[2]}, 0});
    box.triangles.push_back({{side[0], side[2], side[3]}, 0});
  }
  box.finishes.resize(1);
  const auto from_side = [](double heading_rad) {
    return 3.0 * (std::abs(std::cos(heading_rad)) + 2.0 * std::abs(std::sin(heading_rad)));
  };
  const double half = std::sqrt(0.5);
  const double expected = (from_side(0.3) + from_side(1.4) + half * (from_side(2.4) + 2.0) +
                           half * (from_side(4.5) + 2.0) + 2.0) /
                          5.0;
  // Cells of 3 / 160 m, and an outline of some 8 m.
  EXPECT_NEAR(tiler::seen_area_m2(box), expected, 0.03);
}

TEST(VegetationSpecies, FeetAreSpreadEvenlyOverTheirDisc) {
  constexpr int kCount = 200;
  constexpr double kReach_m = 3.0, kSunk_m = 0.25, kAstray_rad = 0.3;
  const double golden_rad = std::numbers::pi * (3.0 - std::sqrt(5.0));
  for (const double astray_rad : {0.0, kAstray_rad}) {
    tiler::Draws draws(7);
    double farthest_astray_rad = 0.0;
    for (int k = 0; k < kCount; ++k) {
      const tiler::Foot foot = tiler::spread_foot(k, kCount, kReach_m, kSunk_m, astray_rad, draws);
      EXPECT_EQ(foot.place_m.z(), -kSunk_m);
      // Of sines and cosines: 1e-12 of the reach is far more than they round by.
      EXPECT_NEAR(foot.place_m.head<2>().norm(), foot.out_m, 1e-12);
      // Rings of one area hold one foot each.
      const double share = foot.out_m * foot.out_m / (kReach_m * kReach_m);
      EXPECT_GE(share * kCount, k - 1e-9);
      EXPECT_LE(share * kCount, k + 1 + 1e-9);
      farthest_astray_rad = std::max(
          farthest_astray_rad,
          std::abs(std::remainder(std::atan2(foot.place_m.y(), foot.place_m.x()) - k * golden_rad,
                                  2.0 * std::numbers::pi)));
    }
    EXPECT_LE(farthest_astray_rad, astray_rad + 1e-12);  // doubles of 480 rad are 6e-14 apart
    EXPECT_GE(farthest_astray_rad, 0.9 * astray_rad);    // of 200 draws
    // One draw a foot, and one more where it goes astray.
    tiler::Draws others(7);
    for (int i = 0; i < (astray_rad > 0.0 ? 2 : 1) * kCount; ++i) others.unit();
    EXPECT_EQ(draws.unit(), others.unit());
  }
}

TEST(VegetationSpecies, VarietiesDifferAndGrowTheSameEveryTime) {
  const SpeciesInfo& oak = tiler::all_species()[tiler::species_row("oak")];
  const Shape first = tiler::full_mesh(tiler::grow_variety(oak, 0));
  EXPECT_EQ(first, tiler::full_mesh(tiler::grow_variety(oak, 0)));
  for (const SpeciesInfo& species : tiler::all_species())
    EXPECT_NE(tiler::full_mesh(tiler::grow_variety(species, 0)),
              tiler::full_mesh(tiler::grow_variety(species, 1)))
        << species.name;
  // As they grew beside others on several threads.
  for (const Grown& grown : all_grown())
    if (grown.species->name == "birch" || grown.species->name == "grass") {
      const world::ShapeLevels again = tiler::levels_of(
          tiler::grow_variety(*grown.species, grown.variety), grown.species->levels);
      EXPECT_EQ(grown.levels, again) << name_of(grown);
    }
}

}  // namespace
}  // namespace terracast::test
