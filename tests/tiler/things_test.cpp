#include "tiler/objects/things.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "tiler/objects/footprints.h"
#include "tiler/objects/power_line.h"
#include "tiler/objects/wires.h"
#include "world/tile_id.h"

namespace terracast::test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using tiler::Stance;
using tiler::ThingInfo;
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

/// Triangles that hang together by their vertices.
std::map<std::uint32_t, std::vector<Shape::Triangle>> parts_of(const Shape& shape) {
  std::vector<std::uint32_t> root(shape.vertices_steps.size());
  std::iota(root.begin(), root.end(), 0U);
  const auto find = [&](std::uint32_t i) {
    while (root[i] != i) i = root[i] = root[root[i]];
    return i;
  };
  for (const Shape::Triangle& triangle : shape.triangles)
    for (const std::uint32_t corner : triangle.corners)
      root[find(corner)] = find(triangle.corners[0]);
  std::map<std::uint32_t, std::vector<Shape::Triangle>> parts;
  for (const Shape::Triangle& triangle : shape.triangles)
    parts[find(triangle.corners[0])].push_back(triangle);
  return parts;
}

template <class Body>
void for_each_level(const Body& body) {
  for (const ThingInfo& thing : tiler::all_things()) {
    const world::Prototype prototype = tiler::thing_prototype(thing, 0);
    for (std::size_t level = 0; level < prototype.levels.size(); ++level) {
      SCOPED_TRACE(thing.name + " level " + std::to_string(level));
      body(thing, static_cast<int>(level), prototype.levels[level].shape);
    }
  }
}

TEST(Things, HaveTheSizesOfTheirTableAndASourceForThem) {
  std::set<std::string> names;
  for_each_level([&](const ThingInfo& thing, int level, const Shape& shape) {
    if (level > 0) return;
    EXPECT_TRUE(names.insert(thing.name).second);
    EXPECT_GT(thing.source.size(), 20U);
    const Extents extents = extents_of(shape);
    const Vector3d size = extents.highest - extents.lowest;
    // 1 %: what bends, such as bumpers and blades, stands out by so much; 2 cm for small things.
    const auto tolerance = [](double of) { return std::max(0.01 * of, 0.02); };
    EXPECT_NEAR(size.x(), thing.size_m.x(), tolerance(thing.size_m.x()));
    EXPECT_NEAR(size.y(), thing.size_m.y(), tolerance(thing.size_m.y()));
    EXPECT_NEAR(extents.highest.z(), thing.size_m.z(), tolerance(thing.size_m.z()));
  });
  EXPECT_GE(names.size(), 50U);
}

TEST(Things, FeetAreAtZeroToTheStep) {
  for_each_level([&](const ThingInfo& thing, int level, const Shape& shape) {
    int lowest = 1 << 30;
    for (const Eigen::Vector3i& vertex : shape.vertices_steps)
      lowest = std::min(lowest, vertex.z());
    if (thing.stance == Stance::Stands) {
      EXPECT_EQ(lowest, 0);
    } else {
      EXPECT_LT(lowest, 0) << "it goes on into ground or water";
    }
    // Each wheel by itself: what is of rubber and round about an axle.
    if (level > 1 || thing.stance != Stance::Stands) return;
    int num_wheels = 0;
    for (const auto& [root, triangles] : parts_of(shape)) {
      if (shape.finishes[triangles[0].finish].material != world::Material::Rubber) continue;
      int foot = 1 << 30;
      for (const Shape::Triangle& triangle : triangles)
        for (const std::uint32_t corner : triangle.corners)
          foot = std::min(foot, shape.vertices_steps[corner].z());
      EXPECT_EQ(foot, 0);
      ++num_wheels;
    }
    const int expected = thing.family == "cars"              ? 4
                         : thing.name == "articulated_truck" ? 10
                         : thing.name == "airliner"          ? 6
                                                             : num_wheels;
    EXPECT_EQ(num_wheels, expected);
  });
}

TEST(Things, PartsAreClosedTurnedOutwardAndWithoutEmptyTriangles) {
  for_each_level([&](const ThingInfo&, int, const Shape& shape) {
    ASSERT_FALSE(shape.triangles.empty());
    std::set<std::array<std::array<int, 3>, 3>> faces;
    for (const auto& [root, triangles] : parts_of(shape)) {
      std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
      double volume = 0.0;
      const Vector3d origin = place_m(shape, triangles[0].corners[0]);
      for (const Shape::Triangle& triangle : triangles) {
        ASSERT_LT(triangle.finish, shape.finishes.size());
        for (std::size_t k = 0; k < 3; ++k)
          ++edges[{triangle.corners[k], triangle.corners[(k + 1) % 3]}];
        const Vector3d a = place_m(shape, triangle.corners[0]) - origin;
        const Vector3d b = place_m(shape, triangle.corners[1]) - origin;
        const Vector3d c = place_m(shape, triangle.corners[2]) - origin;
        volume += a.dot(b.cross(c)) / 6.0;
        EXPECT_GT((b - a).cross(c - a).norm(), 0.0);
        // No face is there twice, whichever way it is turned.
        std::array<std::array<int, 3>, 3> face{};
        for (std::size_t k = 0; k < 3; ++k) {
          const Eigen::Vector3i& at = shape.vertices_steps[triangle.corners[k]];
          face[k] = {at.x(), at.y(), at.z()};
        }
        std::sort(face.begin(), face.end());
        EXPECT_TRUE(faces.insert(face).second);
      }
      for (const auto& [edge, count] : edges) {
        EXPECT_EQ(count, 1);
        EXPECT_EQ(edges.count({edge.second, edge.first}), 1U);
      }
      EXPECT_GT(volume, 0.0);
    }
  });
}

TEST(Things, LevelsGetCoarserAndStayWithinTheirBudget) {
  for (const ThingInfo& thing : tiler::all_things()) {
    SCOPED_TRACE(thing.name);
    const world::Prototype prototype = tiler::thing_prototype(thing, 0);
    ASSERT_GE(prototype.levels.size(), 3U);
    EXPECT_LE(prototype.levels[0].shape.triangles.size(), 6000U);
    EXPECT_GE(prototype.levels[0].shape.triangles.size(), 100U);
    for (std::size_t k = 1; k < prototype.levels.size(); ++k) {
      EXPECT_GT(prototype.levels[k].coarsest_level, prototype.levels[k - 1].coarsest_level);
      EXPECT_LE(prototype.levels[k].shape.triangles.size(),
                prototype.levels[k - 1].shape.triangles.size());
    }
    EXPECT_LE(prototype.levels.back().shape.triangles.size(), 700U);
    // All variants differ in colour alone.
    for (int variant = 1; variant < thing.num_variants; ++variant) {
      const world::Prototype other = tiler::thing_prototype(thing, variant);
      EXPECT_EQ(other.levels[0].shape.vertices_steps, prototype.levels[0].shape.vertices_steps);
      EXPECT_NE(other.levels[0].shape.finishes, prototype.levels[0].shape.finishes);
    }
  }
}

/// Area that a shape covers seen along a direction, by painting its triangles on squares.
double covered_m2(const Shape& shape, const Vector3d& along, double cell_m) {
  const Vector3d x = along.unitOrthogonal();
  const Vector3d y = along.cross(x);
  std::vector<Vector2d> flat;
  Vector2d origin = Vector2d::Constant(1e9);
  Vector2d end = Vector2d::Constant(-1e9);
  for (std::uint32_t i = 0; i < shape.vertices_steps.size(); ++i) {
    const Vector3d place = place_m(shape, i) / cell_m;
    flat.emplace_back(place.dot(x), place.dot(y));
    origin = origin.cwiseMin(flat.back());
    end = end.cwiseMax(flat.back());
  }
  const int width = static_cast<int>(end.x() - origin.x()) + 2;
  const int height = static_cast<int>(end.y() - origin.y()) + 2;
  std::vector<std::uint8_t> covered(
      static_cast<std::size_t>(width) * static_cast<std::size_t>(height), 0);
  const auto cross = [](const Vector2d& a, const Vector2d& b) {
    return a.x() * b.y() - a.y() * b.x();
  };
  for (const Shape::Triangle& triangle : shape.triangles) {
    Vector2d at[3];
    for (std::size_t k = 0; k < 3; ++k) at[k] = flat[triangle.corners[k]] - origin;
    if (cross(at[1] - at[0], at[2] - at[0]) <= 0.0) continue;
    const Vector2d low = at[0].cwiseMin(at[1]).cwiseMin(at[2]);
    const Vector2d high = at[0].cwiseMax(at[1]).cwiseMax(at[2]);
    for (int j = static_cast<int>(low.y()); j <= static_cast<int>(high.y()); ++j)
      for (int i = static_cast<int>(low.x()); i <= static_cast<int>(high.x()); ++i) {
        const Vector2d point(i + 0.5, j + 0.5);
        if (cross(at[1] - at[0], point - at[0]) >= 0.0 &&
            cross(at[2] - at[1], point - at[1]) >= 0.0 &&
            cross(at[0] - at[2], point - at[2]) >= 0.0)
          covered[static_cast<std::size_t>(j) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(i)] = 1;
      }
  }
  return static_cast<double>(std::count(covered.begin(), covered.end(), 1)) * cell_m * cell_m;
}

TEST(Things, CoarserLevelsCoverAsMuchOfAPicture) {
  const std::vector<Vector3d> directions = {Vector3d(1, 0.3, 0.4).normalized(),
                                            Vector3d(-0.3, 1, 0.25).normalized(),
                                            Vector3d(0.1, 0.2, 1).normalized()};
  double worst = 0.0;
  for (const ThingInfo& thing : tiler::all_things()) {
    const world::Prototype prototype = tiler::thing_prototype(thing, 0);
    // So that the thinnest bars of what is made of bars are seen.
    const double cell_m = std::clamp(thing.size_m.maxCoeff() / 250.0, 0.01, 1.0);
    // What is made of thin bars loses some of them: its silhouette is stated apart.
    const bool is_thin = thing.family == "power_lines" || thing.family == "masts" ||
                         thing.name == "tower_crane" || thing.name == "sailing_yacht";
    double areas[4] = {};
    for (std::size_t k = 0; k < prototype.levels.size(); ++k)
      for (const Vector3d& along : directions)
        areas[k] += covered_m2(prototype.levels[k].shape, along, cell_m);
    for (std::size_t k = 1; k < prototype.levels.size(); ++k) {
      const double ratio = areas[k] / areas[0];
      if (!is_thin) worst = std::max(worst, std::abs(ratio - 1.0));
      if (is_thin) {
        EXPECT_GT(ratio, 0.35) << thing.name << " level " << k;
        EXPECT_LT(ratio, 1.30) << thing.name << " level " << k;
      } else {
        EXPECT_NEAR(ratio, 1.0, 0.12) << thing.name << " level " << k;
      }
    }
  }
  RecordProperty("worst", std::to_string(worst));
  std::printf("largest difference of area: %.3f\n", worst);
}

TEST(Wires, HangAlongTheCatenary) {
  // Independently: the catenary through both ends by bisection for its lowest point.
  for (const double c : {700.0, 1400.0})
    for (const double d : {40.0, 333.0, 900.0})
      for (const double rise : {0.0, 12.5, -60.0}) {
        double low = -1e5;
        double high = 1e5;
        for (int k = 0; k < 200; ++k) {
          const double m = 0.5 * (low + high);
          // Rises less the farther the lowest point lies.
          (c * (std::cosh((d - m) / c) - std::cosh(m / c)) > rise ? low : high) = m;
        }
        for (const double share : {0.0, 0.2, 0.5, 0.9, 1.0}) {
          const double expected = c * (std::cosh((share * d - low) / c) - std::cosh(low / c));
          EXPECT_NEAR(tiler::wire_height_m(share, d, rise, c), expected,
                      1e-9 * std::max(1.0, std::cosh(std::abs(low) / c) * c / 100.0))
              << c << " " << d << " " << rise;
        }
        // The rule of thumb for the sag of a level span: d^2 / (8 c), to (d / c)^2 / 48 of it.
        if (rise == 0.0) {
          EXPECT_NEAR(-tiler::wire_height_m(0.5, d, 0.0, c), d * d / (8.0 * c),
                      d * d / (8.0 * c) * (d * d / (c * c)) / 40.0 + 1e-9);
        }
      }
}

TEST(Wires, GoFromArmToArmAsClosedTubesWhicheverWaySupportsFace) {
  const auto row =
      static_cast<std::uint32_t>(tiler::find_thing("pylon") - tiler::all_things().data());
  const Vector3d up = Vector3d::UnitZ();
  world::InstanceFrame from{.place_world = {100.0, 50.0, 300.0},
                            .world_from_prototype = Eigen::Quaterniond(Eigen::AngleAxisd(0.3, up)),
                            .scale = 1.0};
  world::InstanceFrame to{.place_world = {440.0, 155.0, 320.0},
                          .world_from_prototype = Eigen::Quaterniond(Eigen::AngleAxisd(0.3, up)),
                          .scale = 1.0};
  for (const bool is_turned : {false, true}) {
    if (is_turned)
      to.world_from_prototype = Eigen::Quaterniond(Eigen::AngleAxisd(0.3 + 3.14159265358979, up));
    const world::Solid solid = tiler::wires_between(row, from, row, to);
    ASSERT_EQ(solid.levels.size(), 2U);
    for (const world::ShapeLevel& level : solid.levels) {
      const auto parts = parts_of(level.shape);
      EXPECT_EQ(parts.size(), 7U);
      for (const auto& [root, triangles] : parts) {
        std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
        for (const Shape::Triangle& triangle : triangles)
          for (std::size_t k = 0; k < 3; ++k)
            ++edges[{triangle.corners[k], triangle.corners[(k + 1) % 3]}];
        for (const auto& [edge, count] : edges) {
          EXPECT_EQ(count, 1);
          EXPECT_EQ(edges.count({edge.second, edge.first}), 1U);
        }
      }
    }
    // Each end of each wire lies at a point of its support, and no wire crosses to the other side.
    const Vector3d along = (to.place_world - from.place_world).normalized();
    const Vector3d left = up.cross(along).normalized();
    const std::vector<Vector3d> points = tiler::wire_points("pylon");
    for (const auto& [root, triangles] : parts_of(solid.levels[0].shape)) {
      double lowest_t = 1e9, highest_t = -1e9;
      Vector3d first, last;
      for (const Shape::Triangle& triangle : triangles)
        for (const std::uint32_t corner : triangle.corners) {
          const Vector3d at = solid.origin_steps.cast<double>() * world::kHeightStep_m +
                              place_m(solid.levels[0].shape, corner);
          const double t = (at - from.place_world).dot(along);
          if (t < lowest_t) lowest_t = t, first = at;
          if (t > highest_t) highest_t = t, last = at;
        }
      const auto nearest = [&](const world::InstanceFrame& frame, const Vector3d& at) {
        double least = 1e9;
        for (const Vector3d& point : points) least = std::min(least, (frame * point - at).norm());
        return least;
      };
      EXPECT_LT(nearest(from, first), 0.02);  // a wire's radius and the lattice
      EXPECT_LT(nearest(to, last), 0.02);
      const double side_first = (first - from.place_world).dot(left);
      const double side_last = (last - to.place_world).dot(left);
      EXPECT_GT(side_first * side_last, -1.0) << "crosses over";
    }
  }
}

TEST(Things, WhatTurnsIsThePartThatIsMissing) {
  std::map<std::string, std::size_t> num_turning;
  for (const ThingInfo& thing : tiler::all_things()) {
    SCOPED_TRACE(thing.name);
    const Shape whole = tiler::thing_prototype(thing, 0).levels[0].shape;
    const tiler::MovableThing movable = tiler::movable_thing(thing, 0);
    num_turning[thing.name] = movable.turning.size();
    // At rest the parts stand where they do in what stands: the same triangles of the same finishes, whose
    // corners differ by a step where a part's origin is off the lattice.
    std::size_t num_triangles = movable.shape.triangles.size();
    std::vector<Vector3d> corners_m;
    const auto add = [&](const Shape& shape, const Vector3d& origin_m) {
      EXPECT_EQ(shape.finishes, whole.finishes);
      for (std::uint32_t i = 0; i < shape.vertices_steps.size(); ++i)
        corners_m.push_back(origin_m + place_m(shape, i));
    };
    add(movable.shape, Vector3d::Zero());
    std::set<std::string> names;
    for (const tiler::TurningShape& part : movable.turning) {
      EXPECT_TRUE(names.insert(part.turning.name).second);
      EXPECT_NEAR(part.turning.axis.norm(), 1.0, 1e-12);
      num_triangles += part.shape.triangles.size();
      add(part.shape, part.turning.origin_m);
      // Round about its axis: as far to all sides as to the farthest, for wheels; rotors lie across it.
      double farthest_m = 0.0, along_m = 0.0;
      for (std::uint32_t i = 0; i < part.shape.vertices_steps.size(); ++i) {
        const Vector3d at = place_m(part.shape, i);
        along_m = std::max(along_m, std::abs(at.dot(part.turning.axis)));
        farthest_m = std::max(farthest_m, at.cross(part.turning.axis).norm());
      }
      // Two wheels of a train on their axle reach from rail to rail.
      const bool is_wheelset = thing.semantic_class == core::SemanticClass::Train;
      EXPECT_LT(along_m, is_wheelset ? 0.83 : farthest_m);
      if (part.turning.swing_rad > 0.0) {
        EXPECT_EQ(part.turning.rate_radps, 0.0) << "legs stand still while nobody goes";
        EXPECT_NEAR(std::sin(part.turning.phase_rad), 0.0, 1e-12) << "and are straight then";
      } else if (part.turning.per_metre_rad != 0.0) {
        EXPECT_NEAR(farthest_m, 1.0 / part.turning.per_metre_rad, 0.01) << "a wheel's radius";
      }
    }
    EXPECT_EQ(num_triangles, whole.triangles.size());
    ASSERT_EQ(corners_m.size(), whole.vertices_steps.size());
    std::vector<Vector3d> whole_m;
    for (std::uint32_t i = 0; i < whole.vertices_steps.size(); ++i)
      whole_m.push_back(place_m(whole, i));
    const auto sum = [](const std::vector<Vector3d>& points) {
      Vector3d total = Vector3d::Zero();
      for (const Vector3d& point : points) total += point;
      return total;
    };
    EXPECT_LT((sum(corners_m) - sum(whole_m)).cwiseAbs().maxCoeff(),
              static_cast<double>(whole_m.size()) * world::kHeightStep_m);
  }
  EXPECT_EQ(num_turning.at("hatchback"), 4U);
  EXPECT_EQ(num_turning.at("helicopter"), 2U);
  EXPECT_EQ(num_turning.at("quadcopter"), 4U);
  EXPECT_EQ(num_turning.at("person"), 4U);
  EXPECT_EQ(num_turning.at("tram"), 4U);
}

TEST(Footprints, OverlapsAreThoseOfSampledRectangles) {
  // Against points sampled inside each rectangle.
  std::uint64_t state = 7;
  const auto draw = [&](double low, double high) {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    return low + (high - low) * static_cast<double>(state >> 11U) * 0x1.0p-53;
  };
  int num_overlaps = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const auto random = [&] {
      const double turn = draw(0.0, 6.28);
      return tiler::GroundRectangle{
          {draw(-5, 5), draw(-5, 5)}, {std::cos(turn), std::sin(turn)}, draw(0.5, 4), draw(0.3, 2)};
    };
    const tiler::GroundRectangle a = random();
    const tiler::GroundRectangle b = random();
    bool has_common = false;
    double depth = -1e9;
    for (int i = -40; i <= 40; ++i)
      for (int j = -40; j <= 40; ++j) {
        const Vector2d at = a.middle + i / 40.0 * a.half_length_m * a.along +
                            j / 40.0 * a.half_width_m * Vector2d(-a.along.y(), a.along.x());
        has_common = has_common || b.distance_m(at) == 0.0;
        depth = std::max(depth, -b.distance_m(at));
      }
    // Samples are up to 0.1 m apart: what is nearer than that may go either way.
    if (has_common) {
      EXPECT_TRUE(a.overlaps(b));
    }
    if (depth < -0.15) {
      EXPECT_FALSE(a.overlaps(b));
    }
    num_overlaps += a.overlaps(b) ? 1 : 0;
  }
  EXPECT_GT(num_overlaps, 60);
  EXPECT_LT(num_overlaps, 340);
}

}  // namespace
}  // namespace terracast::test
