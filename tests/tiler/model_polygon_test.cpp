#include "tiler/objects/model_polygon.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <set>

#include "core/random.h"

namespace terracast::test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using tiler::triangles_of_face;

Vector3d doubled_area(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  return (b - a).cross(c - a);
}

/// Triangles have the polygon's area (the shoelace formula), each turns as it does, and each corner is used.
void expect_covers(const std::vector<Vector3d>& corners) {
  Vector3d area = Vector3d::Zero();
  for (std::size_t i = 0; i < corners.size(); ++i)
    area += corners[i].cross(corners[(i + 1) % corners.size()]);
  const auto triangles = triangles_of_face(corners);
  ASSERT_EQ(triangles.size(), corners.size() - 2);
  double sum = 0.0;
  std::set<std::uint32_t> used;
  for (const auto& [a, b, c] : triangles) {
    const Vector3d own = doubled_area(corners[a], corners[b], corners[c]);
    EXPECT_GE(own.dot(area.normalized()), -1e-12 * area.norm()) << a << " " << b << " " << c;
    sum += own.norm();
    for (const std::uint32_t corner : {a, b, c}) used.insert(corner);
  }
  // Coordinates are of hundreds at most; sums of a thousand products of doubles.
  EXPECT_NEAR(sum, area.norm(), 1e-9 * area.norm());
  EXPECT_EQ(used.size(), corners.size());
}

/// A polygon in the plane, laid into space.
std::vector<Vector3d> in_space(const std::vector<Vector2d>& places, const Vector3d& normal) {
  const Eigen::Quaterniond turn = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), normal);
  std::vector<Vector3d> corners;
  for (const Vector2d& place : places)
    corners.push_back(turn * Vector3d(place.x(), place.y(), 0.0) + Vector3d(3, -5, 7));
  return corners;
}

TEST(ModelPolygon, TrianglesCoverPolygonsOfAnyShapeInAnyPlane) {
  for (int seed = 0; seed < 200; ++seed) {
    // Seen from its middle, a star of corners at drawn distances.
    std::vector<Vector2d> star;
    const auto drawn = [&](int index) {
      return static_cast<double>(
                 core::mix_bits(core::stream_of(static_cast<std::uint64_t>(seed),
                                                static_cast<std::uint64_t>(index))) >>
                 11U) *
             0x1p-53;
    };
    const int size = 3 + seed % 40;
    for (int i = 0; i < size; ++i) {
      const double turn = 2.0 * std::numbers::pi * i / size;
      star.push_back((0.2 + 10.0 * drawn(i)) * Vector2d(std::cos(turn), std::sin(turn)));
    }
    const Vector3d normal(drawn(100) - 0.5, drawn(101) - 0.5, drawn(102) - 0.5);
    SCOPED_TRACE(seed);
    expect_covers(in_space(star, normal.normalized()));
    std::reverse(star.begin(), star.end());
    expect_covers(in_space(star, normal.normalized()));
  }
}

TEST(ModelPolygon, CornersOnAStraightEdgeAreKept) {
  expect_covers({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}});
  expect_covers(
      {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 1, 0}, {2, 2, 0}, {1, 2, 0}, {0, 2, 0}, {0, 1, 0}});
}

/// A comb has as many corners that turn inward as it has teeth.
TEST(ModelPolygon, FacesOfAThousandCornersTakeMilliseconds) {
  std::vector<Vector3d> comb;
  for (int i = 0; i < 998; ++i) comb.emplace_back(i, i % 2 == 0 ? 0.0 : 10.0, 0.0);
  comb.emplace_back(997.0, -1.0, 0.0);
  comb.emplace_back(0.0, -1.0, 0.0);
  std::reverse(comb.begin(), comb.end());
  expect_covers(comb);
  // One that crosses itself everywhere ends, too.
  std::vector<Vector3d> knot;
  for (int i = 0; i < 1000; ++i) knot.emplace_back((i * 7919) % 1000, (i * 104729) % 997, 0.0);
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(triangles_of_face(comb).size(), 998U);
    EXPECT_EQ(triangles_of_face(knot).size(), 998U);
  }
  // Of two million triangles there are a hundred times as many: a minute or two at this bound, where the cube of the
  // corners would take hours.
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(4));
}

}  // namespace
}  // namespace terracast::test
