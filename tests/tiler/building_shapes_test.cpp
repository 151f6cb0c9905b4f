#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "core/random.h"
#include "tests/support/expect_error.h"
#include "tests/support/mesh_checks.h"
#include "tests/tiler/building_facts.h"
#include "tiler/buildings/building_mesh.h"
#include "tiler/buildings/footprint.h"
#include "tiler/buildings/roof.h"
#include "tiler/roofs/inner_polygons.h"
#include "tiler/roofs/triangulation.h"
#include "world/facade.h"
#include "world/tile_id.h"

namespace terracast::test {
namespace {

using core::ErrorKind;
using Eigen::Vector2d;
using Eigen::Vector2i;
using Eigen::Vector3d;
using tiler::BuildingDesign;
using tiler::BuildingDetail;
using tiler::BuildingPlan;
using tiler::FootprintCounts;
using tiler::RingsSteps;
using tiler::RoofShape;
using world::kHeightStep_m;

RingsSteps rings_of(const std::vector<std::vector<Vector2d>>& rings_m) {
  RingsSteps rings;
  for (const auto& ring : rings_m) {
    rings.emplace_back();
    for (const Vector2d& at : ring) rings.back().emplace_back(steps(at.x()), steps(at.y()));
  }
  return rings;
}
RingsSteps rectangle(double length_m, double width_m) {
  return rings_of({{{0, 0}, {length_m, 0}, {length_m, width_m}, {0, width_m}}});
}

/// A building of a roof's shape, without details.
world::Shape plain_shape(const RingsSteps& rings, RoofShape roof, double top_m, double roof_m,
                         BuildingDetail detail = BuildingDetail::Plain) {
  BuildingDesign design;
  design.roof = roof;
  design.roof_height_m = roof_m;
  design.top_m = top_m;
  BuildingPlan plan;
  plan.rings = rings;
  plan.design = &design;
  plan.foundation_steps = steps(1.0);
  return tiler::building_shape(plan, detail);
}

TEST(BuildingShapes, RoofsOverARectangleHaveTheirClosedForms) {
  const double length = 14.0;
  const double width = 8.0;
  const double walls = 5.0;
  const double roof = 3.0;
  const double block = length * width * (walls + 1.0);  // 1 m of foundation
  const std::map<RoofShape, double> roofs = {
      {RoofShape::Flat, length * width * roof},
      {RoofShape::Gabled, length * width * roof / 2.0},
      // A ridge as long as the length is more than the width: a prism and two halves of a pyramid.
      {RoofShape::Hipped, (length - width) * width * roof / 2.0 + width * width * roof / 3.0},
      {RoofShape::Pyramidal, length * width * roof / 3.0},
      {RoofShape::Skillion, length * width * roof / 2.0},
      // Of a cross-section with corners at 0.45 of the half width and 0.68 of the height.
      {RoofShape::Gambrel, length * width * roof * (0.45 * 0.34 + 0.55 * (0.68 + 1.0) / 2.0)},
  };
  for (const auto& [shape, volume_m3] : roofs) {
    const world::Shape mesh = plain_shape(rectangle(length, width), shape, walls + roof, roof);
    const MeshFacts facts = sound_facts(mesh, std::to_string(static_cast<int>(shape)));
    // Corners are rounded by half a step: 250 m2 of surface times 0.5 mm.
    EXPECT_NEAR(facts.volume_m3, block + volume_m3, 0.13) << static_cast<int>(shape);
    EXPECT_NEAR(area_from_above_m2(mesh), length * width, 0.02) << static_cast<int>(shape);
    EXPECT_LE(mesh.triangles.size(), 40u);
  }
}

// OpenStreetMap's values of roof:shape (https://wiki.openstreetmap.org/wiki/Key:roof:shape) and the shape that each draws,
// of a house, whose roof is gabled or hipped as it likes where nobody says, and of a part, whose roof is flat then.
TEST(BuildingShapes, EachRoofThatATagNamesIsTheOneThatStands) {
  const std::map<std::string, RoofShape> shapes = {{"flat", RoofShape::Flat},
                                                   {"gabled", RoofShape::Gabled},
                                                   {"pitched", RoofShape::Gabled},
                                                   {"gabled_row", RoofShape::Gabled},
                                                   {"saltbox", RoofShape::Gabled},
                                                   {"cross_gabled", RoofShape::Gabled},
                                                   {"hipped", RoofShape::Hipped},
                                                   {"side_hipped", RoofShape::Hipped},
                                                   {"half-hipped", RoofShape::HalfHipped},
                                                   {"half_hipped", RoofShape::HalfHipped},
                                                   {"hipped-and-gabled", RoofShape::HalfHipped},
                                                   {"pyramidal", RoofShape::Pyramidal},
                                                   {"tented", RoofShape::Pyramidal},
                                                   {"skillion", RoofShape::Skillion},
                                                   {"lean_to", RoofShape::Skillion},
                                                   {"gambrel", RoofShape::Gambrel},
                                                   {"mansard", RoofShape::Mansard},
                                                   {"round", RoofShape::Round},
                                                   {"dome", RoofShape::Dome},
                                                   {"onion", RoofShape::Dome},
                                                   {"cone", RoofShape::Spire},
                                                   {"conical", RoofShape::Spire},
                                                   {"spire", RoofShape::Spire}};
  std::set<RoofShape> drawn;
  for (const auto& [value, shape] : shapes)
    for (const bool is_part : {false, true})
      for (std::uint64_t own = 0; own < 8; ++own) {
        const tiler::FeatureTags tags(
            {{is_part ? "building:part" : "building", "yes"}, {"roof:shape", value}});
        EXPECT_EQ(tiler::design_building(tags, is_part, {}, std::nullopt, own, own).roof, shape)
            << value;
        drawn.insert(shape);
      }
  EXPECT_EQ(drawn.size(), 11U);  // all that there are
  // What nobody knows is as if it were not said.
  for (std::uint64_t own = 0; own < 8; ++own) {
    const tiler::FeatureTags unknown({{"building", "house"}, {"roof:shape", "many"}});
    const tiler::FeatureTags silent(
        std::vector<std::pair<std::string, std::string>>{{"building", "house"}});
    EXPECT_EQ(tiler::design_building(unknown, false, {}, std::nullopt, own, own).roof,
              tiler::design_building(silent, false, {}, std::nullopt, own, own).roof);
  }
}

/// Highest vertex of a shape over a place, m.
double top_over(const world::Shape& shape, const Vector2d& at_m) {
  double top_m = -1e9;
  for (const auto& vertex : shape.vertices_steps)
    if ((vertex.head<2>().cast<double>() * kHeightStep_m - at_m).norm() < 0.01)
      top_m = std::max(top_m, vertex.z() * kHeightStep_m);
  return top_m;
}

// Whichever way a roof falls, along walls or not, and by whatever rounding of the angle's sine: its corners lie on the
// plane that its direction, height and outline define.
TEST(BuildingShapes, SkillionsFallWhereTheirDirectionSays) {
  const Vector2d size(12.0, 20.0);
  const double roof_m = 2.4;
  std::vector<double> directions;
  for (int deg = 0; deg <= 360; deg += 5) directions.push_back(deg);
  for (const double quarter : {0.0, 90.0, 180.0, 270.0, 360.0})
    for (const double off : {1e-13, 1e-9, 1e-6, 1e-4, 1e-3, 0.003, 0.01, 0.05, 1.0})
      directions.insert(directions.end(), {quarter - off, quarter + off});
  for (const double deg : directions)
    for (const BuildingDetail detail : {BuildingDetail::Plain, BuildingDetail::Fine}) {
      BuildingDesign design;
      design.roof = RoofShape::Skillion;
      design.roof_height_m = roof_m;
      design.top_m = 9.0;
      design.roof_direction_deg = deg;
      BuildingPlan plan;
      plan.rings = rectangle(size.x(), size.y());
      plan.design = &design;
      plan.foundation_steps = steps(1.0);
      const world::Shape shape = tiler::building_shape(plan, detail);
      sound_facts(shape, "direction " + std::to_string(deg));
      const double turned = deg * 3.14159265358979323846 / 180.0;
      const Vector2d up_slope(-std::sin(turned), -std::cos(turned));
      const auto [low, high] = box_of(shape);
      EXPECT_NEAR(high.z(), design.top_m, 2 * kHeightStep_m) << deg;
      if (detail == BuildingDetail::Fine) {
        // With eaves: it slopes as well.
        double lowest_m = 1e9;
        for (const double x : {low.x(), high.x()})
          for (const double y : {low.y(), high.y()})
            lowest_m = std::min(lowest_m, top_over(shape, {x, y}));
        EXPECT_LT(lowest_m, design.top_m - roof_m + 0.02) << deg;
        continue;
      }
      double least = 1e9;
      double most = -1e9;
      std::vector<std::pair<Vector2d, double>> corners;
      for (const double x : {0.0, size.x()})
        for (const double y : {0.0, size.y()}) {
          const double along = up_slope.dot(Vector2d(x, y));
          least = std::min(least, along);
          most = std::max(most, along);
          corners.emplace_back(Vector2d(x, y), along);
        }
      // Rises below four steps are none, and all are whole steps.
      for (const auto& [at, along] : corners)
        EXPECT_NEAR(top_over(shape, at),
                    design.top_m - roof_m + roof_m * (along - least) / (most - least),
                    5 * kHeightStep_m)
            << deg << " at " << at.transpose();
    }
}

// Windows are drawn in bays and storeys of the pattern's own size: no wall may cut one.
TEST(BuildingShapes, WallsHoldWholeBaysAndStoreys) {
  for (const auto style : {world::FacadeStyle::House, world::FacadeStyle::Apartments,
                           world::FacadeStyle::Offices, world::FacadeStyle::Hall})
    for (const RoofShape roof : {RoofShape::Flat, RoofShape::Gabled, RoofShape::Hipped})
      for (std::uint64_t own = 0; own < 6; ++own) {
        BuildingDesign design;
        design.roof = roof;
        design.roof_height_m = roof == RoofShape::Flat ? 0.0 : 2.5;
        design.top_m = 11.7;
        design.wall.material = world::Material::Plaster;
        design.wall.pattern = world::facade_pattern(style, 31);
        BuildingPlan plan;
        // The last side is narrower than most bays.
        plan.rings =
            rings_of({{{0, 0}, {17.3, 0}, {17.3, 9.1}, {16.6, 9.1}, {16.6, 10.4}, {0, 10.4}}});
        plan.design = &design;
        plan.own = own;
        plan.foundation_steps = steps(1.0);
        plan.attached = {false, true, false, false, false, false};
        const world::Shape shape = tiler::building_shape(plan, BuildingDetail::Fine);
        sound_facts(shape, "facade");
        const double bay_m = world::facade_bay_m(style);
        int num_walls = 0;
        for (const auto& triangle : shape.triangles) {
          if (shape.finishes[triangle.finish].pattern == 0) continue;
          const auto height = [&](std::size_t k) {
            return shape.vertices_steps[triangle.corners[k]].z();
          };
          if (height(0) == height(1) && height(1) == height(2)) continue;  // the bottom
          double lowest_u = 1e9;
          double highest_u = -1e9;
          double highest_v = -1e9;
          double length_m = 0.0;
          for (std::size_t k = 0; k < 3; ++k) {
            const Eigen::Vector2f& uv = shape.uv[triangle.corners[k]];
            lowest_u = std::min(lowest_u, static_cast<double>(uv.x()));
            highest_u = std::max(highest_u, static_cast<double>(uv.x()));
            highest_v = std::max(highest_v, static_cast<double>(uv.y()));
            const Eigen::Vector3i& a = shape.vertices_steps[triangle.corners[k]];
            const Eigen::Vector3i& b = shape.vertices_steps[triangle.corners[(k + 1) % 3]];
            length_m = std::max(length_m, (a - b).head<2>().cast<double>().norm() * kHeightStep_m);
          }
          ++num_walls;
          EXPECT_GT(length_m, 0.5 * bay_m);
          // No window where another house stands, nor on what is too narrow for a bay.
          const auto is_on_attached = [&](std::uint32_t corner) {
            return shape.vertices_steps[corner].x() == steps(17.3);
          };
          EXPECT_FALSE(
              std::all_of(triangle.corners.begin(), triangle.corners.end(), is_on_attached));
          const auto is_whole = [](double value, double part) {
            // uv is rounded to a 64th of a metre.
            return std::abs(value - part * std::round(value / part)) < 1.0 / 64.0;
          };
          EXPECT_TRUE(is_whole(lowest_u, bay_m) && is_whole(highest_u, bay_m)) << highest_u;
          if (roof != RoofShape::Flat) {
            EXPECT_TRUE(is_whole(highest_v, 3.1)) << highest_v;
          }
          // Bays are up to a half narrower or wider, where there is one, else less.
          EXPECT_NEAR((highest_u - lowest_u) / length_m, 1.0, length_m > 4.0 * bay_m ? 0.25 : 0.7);
        }
        EXPECT_GE(num_walls, 4);
      }
}

TEST(BuildingShapes, RoofsOverAnyPolygonAreClosedAndCoverIt) {
  const RingsSteps l_shape = rings_of({{{0, 0}, {16, 0}, {16, 7}, {8, 7}, {8, 15}, {0, 15}}});
  const RingsSteps court =
      rings_of({{{0, 0}, {30, 2}, {28, 26}, {-3, 24}}, {{9, 9}, {8, 17}, {19, 18}, {20, 10}}});
  const RingsSteps t_shape =
      rings_of({{{0, 0}, {20, 0}, {20, 8}, {13, 8}, {13, 18}, {6, 18}, {6, 8}, {0, 8}}});
  std::vector<Vector2d> round;
  for (int k = 0; k < 24; ++k)
    round.push_back(9.0 * Vector2d(std::cos(k * 0.2617993878), std::sin(k * 0.2617993878)));
  for (const RingsSteps& rings : {l_shape, court, t_shape, rings_of({round}), rectangle(9, 9)})
    for (const RoofShape roof :
         {RoofShape::Flat, RoofShape::Gabled, RoofShape::Hipped, RoofShape::HalfHipped,
          RoofShape::Pyramidal, RoofShape::Skillion, RoofShape::Gambrel, RoofShape::Mansard,
          RoofShape::Round, RoofShape::Dome, RoofShape::Spire})
      for (const BuildingDetail detail : {BuildingDetail::Fine, BuildingDetail::Plain}) {
        const std::string what = std::to_string(rings.front().size()) + " corners, roof " +
                                 std::to_string(static_cast<int>(roof));
        const world::Shape mesh = plain_shape(rings, roof, 11.0, 3.0, detail);
        sound_facts(mesh, what);
        EXPECT_LE(mesh.triangles.size(), 700u) << what;
        if (detail == BuildingDetail::Plain) {
          EXPECT_NEAR(area_from_above_m2(mesh), tiler::area_m2(rings), 0.05) << what;
        }
      }
}

TEST(BuildingShapes, EavesReachBeyondWallsAndParapetsStandOnThem) {
  BuildingDesign design;
  design.top_m = 9.0;
  design.roof = RoofShape::Hipped;
  design.roof_height_m = 2.5;
  BuildingPlan plan;
  plan.rings = rectangle(16.0, 11.0);
  plan.design = &design;
  plan.foundation_steps = steps(1.0);
  const world::Shape hipped = tiler::building_shape(plan, BuildingDetail::Fine);
  sound_facts(hipped, "hipped");
  const auto [low, high] = box_of(hipped);
  // Eaves of 0.4 m, more or less by a third.
  for (const double over_m : {-low.x(), -low.y(), high.x() - 16.0, high.y() - 11.0}) {
    EXPECT_GE(over_m, 0.24 - kHeightStep_m);
    EXPECT_LE(over_m, 0.52 + kHeightStep_m);
  }
  EXPECT_NEAR(area_from_above_m2(hipped), (high - low).head<2>().prod(), 0.02);

  design.roof = RoofShape::Flat;
  const world::Shape flat = tiler::building_shape(plan, BuildingDetail::Fine);
  sound_facts(flat, "flat");
  const auto [flat_low, flat_high] = box_of(flat);
  EXPECT_EQ(Vector2d(flat_low.head<2>()), Vector2d(0.0, 0.0));
  EXPECT_EQ(Vector2d(flat_high.head<2>()), Vector2d(16.0, 11.0));
  double rim_m2 = 0.0;
  for (const auto& triangle : flat.triangles) {
    std::array<Vector3d, 3> at;
    for (std::size_t k = 0; k < 3; ++k)
      at[k] = flat.vertices_steps[triangle.corners[k]].cast<double>() * kHeightStep_m;
    const Vector3d turned = (at[1] - at[0]).cross(at[2] - at[0]);
    if (turned.z() > 0.5 * turned.norm() && std::abs(at[0].z() - 9.0) < 0.01)
      rim_m2 += 0.5 * turned.z();
  }
  EXPECT_NEAR(rim_m2, 16.0 * 11.0 - 15.4 * 10.4, 0.1);  // 0.3 m wide
}

TEST(BuildingShapes, ACanopyStandsOnPosts) {
  BuildingDesign design;
  design.kind = tiler::BuildingKind::Canopy;
  design.top_m = 3.4;
  BuildingPlan plan;
  plan.design = &design;
  plan.foundation_steps = steps(1.0);
  std::vector<Vector2d> round;
  for (int i = 0; i < 12; ++i)
    round.emplace_back(4.6 * std::cos(i * EIGEN_PI / 6.0), 4.6 * std::sin(i * EIGEN_PI / 6.0));
  const std::map<std::string, std::pair<RingsSteps, int>> canopies = {
      {"long", {rectangle(16.0, 5.0), 4}}, {"round", {rings_of({round}), 12}}};
  for (const auto& [name, canopy] : canopies)
    for (const BuildingDetail detail :
         {BuildingDetail::Fine, BuildingDetail::Plain, BuildingDetail::Block}) {
      plan.rings = canopy.first;
      const world::Shape shape = tiler::building_shape(plan, detail);
      const MeshFacts facts = sound_facts(shape, name);
      const int num_posts = detail == BuildingDetail::Block ? 4 : canopy.second;
      // A slab of 0.35 m, and posts of 0.28 m x 0.28 m from 1 m under the ground to the slab.
      EXPECT_NEAR(facts.volume_m3,
                  tiler::area_m2(plan.rings) * 0.35 + num_posts * 0.28 * 0.28 * 4.05, 0.1)
          << name;
      EXPECT_NEAR(box_of(shape).first.z(), -1.0, kHeightStep_m);
    }
}

TEST(Footprints, EdgesMoveOutwardAndInward) {
  const RingsSteps yard =
      rings_of({{{0, 0}, {10, 0}, {10, 5}, {10, 10}, {0, 10}}, {{4, 4}, {4, 6}, {6, 6}, {6, 4}}});
  for (const double by_m : {0.5, -0.5, 0.25}) {
    const auto moved = tiler::moved_edges(yard, by_m / kHeightStep_m);
    ASSERT_TRUE(moved);
    // The hole becomes smaller as its walls grow.
    EXPECT_NEAR(tiler::area_m2(*moved),
                std::pow(10.0 + 2.0 * by_m, 2) - std::pow(2.0 - 2.0 * by_m, 2), 0.05)
        << by_m;
  }
  const auto one_edge = tiler::moved_edges(rectangle(10.0, 4.0), {0.0, 1.0 / kHeightStep_m, 0, 0});
  ASSERT_TRUE(one_edge);
  EXPECT_EQ(*one_edge, rectangle(11.0, 4.0));
  EXPECT_FALSE(tiler::moved_edges(rectangle(10.0, 4.0), -2.5 / kHeightStep_m));
  EXPECT_FALSE(tiler::moved_edges(yard, 1.5 / kHeightStep_m));  // the hole would be gone
}

TEST(Footprints, WhatCrossesItselfIsRepairedToItsArea) {
  const auto footprints = [](const std::vector<tiler::PointsWorld>& rings,
                             FootprintCounts& counts) {
    std::vector<tiler::Footprint> found = tiler::footprints_of(rings, counts);
    for (const tiler::Footprint& footprint : found) EXPECT_TRUE(tiler::is_valid(footprint.rings));
    return found;
  };
  FootprintCounts counts;
  // A bow tie: two triangles of 25 m2.
  auto found = footprints({{{0, 0}, {10, 10}, {10, 0}, {0, 10}}}, counts);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_NEAR(tiler::area_m2(found[0].rings), 25.0, 0.3);
  EXPECT_NEAR(tiler::area_m2(found[1].rings), 25.0, 0.3);
  EXPECT_EQ(counts.num_repaired, 1);
  // A hole beside its shell is none; one across its border takes what it covers.
  found = footprints({{{0, 0}, {20, 0}, {20, 20}, {0, 20}}, {{30, 0}, {40, 0}, {40, 9}, {30, 9}}},
                     counts);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NEAR(tiler::area_m2(found[0].rings), 400.0, 0.6);
  found = footprints({{{0, 0}, {20, 0}, {20, 20}, {0, 20}}, {{15, 5}, {30, 5}, {30, 9}, {15, 9}}},
                     counts);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NEAR(tiler::area_m2(found[0].rings), 380.0, 0.6);
  EXPECT_EQ(counts.num_repaired, 3);
  // Points twice, a spike, points on a line: no repair, and what is left is the square.
  found = footprints({{{0, 0}, {5, 0}, {5, 0}, {10, 0}, {10, 10}, {10, 30}, {10, 10}, {0, 10}}},
                     counts);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].rings.front().size(), 4u);
  EXPECT_NEAR(tiler::area_m2(found[0].rings), 100.0, 0.3);
  EXPECT_EQ(counts.num_repaired, 3);
  EXPECT_EQ(counts.num_too_small, 0);
  // No area.
  EXPECT_TRUE(footprints({{{0, 0}, {10, 10}, {20, 20}}}, counts).empty());
  EXPECT_TRUE(footprints({{{0, 0}, {1, 0}}}, counts).empty());
  EXPECT_EQ(counts.num_too_small, 2);
  EXPECT_TRUE(footprints({{{0, 0}, {9000, 0}, {0, 9000}}}, counts).empty());
  EXPECT_TRUE(footprints({{{0, 0}, {std::nan(""), 0}, {0, 9}}}, counts).size() <= 1);
  EXPECT_EQ(counts.num_too_large, 1);
}

TEST(Footprints, AMillionCornersAndHundredsOfRingsTakeBoundedTime) {
  FootprintCounts counts;
  tiler::PointsWorld ring;
  for (int k = 0; k < 1'000'000; ++k) {
    const double angle = 2.0 * 3.14159265358979 * k / 1e6;
    const double radius = 40.0 + 4.0 * std::sin(40.0 * angle) +
                          0.5 * core::random_unit(1, 2, static_cast<std::uint64_t>(k));
    ring.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
  }
  const auto found = tiler::footprints_of({ring}, counts);
  ASSERT_FALSE(found.empty());
  EXPECT_EQ(counts.num_simplified, 1);
  // Of pi (40^2 + 4^2 / 2) m2, to what noise and fewer corners make of it.
  EXPECT_NEAR(tiler::area_m2(found[0].rings), 5100.0, 400.0);

  std::vector<tiler::PointsWorld> rings = {{{0, 0}, {200, 0}, {200, 200}, {0, 200}}};
  for (int j = 0; j < 20; ++j)
    for (int i = 0; i < 20; ++i) {
      const double x = 2.0 + 9.8 * i;
      const double y = 2.0 + 9.8 * j;
      rings.push_back({{x, y}, {x + 4, y}, {x + 4, y + 4}, {x, y + 4}});
    }
  const auto holed = tiler::footprints_of(rings, counts);
  ASSERT_FALSE(holed.empty());
  EXPECT_TRUE(tiler::is_valid(holed[0].rings));
}

TEST(Footprints, RandomRingsBecomeValidPolygons) {
  for (std::uint64_t seed = 0; seed < 150; ++seed) {
    tiler::PointsWorld ring;
    const std::uint64_t n = 4 + seed % 9;
    for (std::uint64_t k = 0; k < n; ++k)
      ring.emplace_back(core::random_between(0, 30, seed, k, 0),
                        core::random_between(0, 30, seed, k, 1));
    FootprintCounts counts;
    for (const tiler::Footprint& footprint : tiler::footprints_of({ring}, counts)) {
      EXPECT_TRUE(tiler::is_valid(footprint.rings)) << seed;
      for (const RoofShape roof : {RoofShape::Flat, RoofShape::Gabled, RoofShape::Mansard})
        sound_facts(plain_shape(footprint.rings, roof, 9.0, 0.0, BuildingDetail::Fine),
                    "seed " + std::to_string(seed));
    }
  }
}

// Seen in November 2026 in Bilbao, whose outlines are made of a raster: walls that could not stand back stayed where they
// were, in one plane with those of their neighbours, and all holes were given up where one nearly touched the border.
TEST(Footprints, CanStandBackWhateverTheirShape) {
  struct Case {
    const char* name;
    std::vector<tiler::PointsWorld> rings;
    double area_m2;  // what is left
    std::size_t num;
    std::size_t num_holes;
    std::int64_t num_narrow;
  };
  const tiler::PointsWorld square = {{0, 0}, {20, 0}, {20, 20}, {0, 20}};
  const std::vector<Case> cases = {
      {"a square", {square}, 400.0, 1, 0, 0},
      // 5.7 degrees; the tip is cut where it is narrower than walls stand back.
      {"a sharp corner", {{{0, 0}, {40, 0}, {40, 4}}}, 80.0, 1, 0, 1},
      {"a short edge", {{{0, 0}, {20, 0}, {20, 20}, {0.05, 20}, {0, 19.95}}}, 400.0, 1, 0, 1},
      // 10 x 0.12 m2 of neck are gone.
      {"a neck",
       {{{0, 0},
         {10, 0},
         {10, 4.94},
         {20, 4.94},
         {20, 0},
         {30, 0},
         {30, 10},
         {20, 10},
         {20, 5.06},
         {10, 5.06},
         {10, 10},
         {0, 10}}},
       200.0,
       2,
       0,
       1},
      {"a slit",
       {{{0, 0}, {20, 0}, {20, 9.95}, {8, 10}, {20, 10.05}, {20, 20}, {0, 20}}},
       399.4,
       1,
       0,
       1},
      // The hole opens to where it nearly touches; the other one is kept.
      {"a hole 5 cm beside the border",
       {square, {{0.05, 5}, {4, 5}, {4, 9}, {0.05, 9}}, {{10, 10}, {14, 10}, {14, 14}, {10, 14}}},
       400.0 - 16.0 - 16.0,
       1,
       1,
       1},
      {"a wall of 15 cm", {{{0, 0}, {40, 0}, {40, 0.15}, {0, 0.15}}}, 0.0, 0, 0, 1},
  };
  for (const Case& one : cases) {
    SCOPED_TRACE(one.name);
    FootprintCounts counts;
    const auto found = tiler::footprints_of(one.rings, counts);
    ASSERT_EQ(found.size(), one.num);
    EXPECT_EQ(counts.num_narrow, one.num_narrow);
    EXPECT_EQ(counts.num_too_small, one.num == 0 ? 1 : 0);
    double area_m2 = 0.0;
    std::size_t num_holes = 0;
    for (const tiler::Footprint& footprint : found) {
      area_m2 += tiler::area_m2(footprint.rings);
      num_holes += footprint.rings.size() - 1;
      for (const double by_m : {0.010, 0.040, 0.100})
        EXPECT_TRUE(tiler::moved_edges(footprint.rings, -by_m / kHeightStep_m)) << by_m;
    }
    // Tips and seams as narrow as walls stand back, and of the slit as much along both sides.
    EXPECT_NEAR(area_m2, one.area_m2, one.name == std::string("a slit") ? 2.4 : 0.5);
    EXPECT_EQ(num_holes, one.num_holes);
  }
}

TEST(Footprints, WhatLiesFartherInsideIsWhatIsFartherFromAllEdges) {
  std::int64_t num_within = 0;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    std::vector<Vector2i> ring;
    for (std::uint64_t k = 0; k < 14; ++k) {  // a jagged star
      const double angle = 2.0 * EIGEN_PI * static_cast<double>(k) / 14.0;
      const double radius = core::random_between(2000.0, 16000.0, seed, k, 0);
      ring.emplace_back((radius * Vector2d(std::cos(angle), std::sin(angle))).cast<int>());
    }
    const RingsSteps rings = {ring, {{-300, -300}, {0, 400}, {300, -300}}};
    const double by = 100.0 + 40.0 * static_cast<double>(seed);
    const std::vector<RingsSteps> inner = tiler::polygons_within(rings, by);
    for (std::uint64_t k = 0; k < 2000; ++k) {
      const Vector2d at(core::random_between(-16000.0, 16000.0, seed, k, 1),
                        core::random_between(-16000.0, 16000.0, seed, k, 2));
      const double distance = tiler::distance_to_edges(rings, at);
      const bool is_in = std::any_of(inner.begin(), inner.end(), [&](const RingsSteps& polygon) {
        return tiler::contains(polygon, at);
      });
      // Corners are rounded; where the border turns inward, inner corners are up to twice as far from it.
      if (tiler::contains(rings, at) && distance > 2.0 * by + 3.0) {
        EXPECT_TRUE(is_in) << seed << ": " << at.transpose();
        ++num_within;
      } else if (!tiler::contains(rings, at) || distance < by - 3.0) {
        EXPECT_FALSE(is_in) << seed << ": " << at.transpose();
      }
    }
  }
  EXPECT_GT(num_within, 500);
}

}  // namespace
}  // namespace terracast::test
