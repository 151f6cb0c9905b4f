#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "core/parallel.h"
#include "core/random.h"
#include "core/toml_reader.h"
#include "tests/support/mesh_checks.h"
#include "tests/tiler/raster_files.h"
#include "tests/tiler/vector_files.h"
#include "tiler/buildings/building_mesh.h"
#include "tiler/buildings/footprint.h"
#include "tiler/buildings/height_raster.h"
#include "tiler/buildings/roof.h"
#include "tiler/buildings/town.h"
#include "tiler/instance_ids.h"
#include "tiler/layer_stack.h"
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
using world::Solid;
using world::TileId;

int steps(double value_m) { return static_cast<int>(std::lround(value_m / kHeightStep_m)); }

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

MeshFacts sound_facts(const world::Shape& shape, const std::string& what) {
  const MeshFacts facts = mesh_facts(shape);
  EXPECT_EQ(facts.problem, "") << what;
  EXPECT_FALSE(facts.meets_itself) << what;
  return facts;
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

/// Of what is turned upward, seen from above, m2.
double area_from_above_m2(const world::Shape& shape) {
  double sum = 0.0;
  for (const auto& triangle : shape.triangles) {
    std::array<Vector2d, 3> at;
    for (std::size_t k = 0; k < 3; ++k)
      at[k] = shape.vertices_steps[triangle.corners[k]].head<2>().cast<double>() * kHeightStep_m;
    const Vector2d u = at[1] - at[0];
    const Vector2d v = at[2] - at[0];
    sum += std::max(0.5 * (u.x() * v.y() - u.y() * v.x()), 0.0);
  }
  return sum;
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

/// The box about what a shape shows.
std::pair<Vector3d, Vector3d> box_of(const world::Shape& shape) {
  Vector3d low = Vector3d::Constant(1e9), high = -low;
  for (const Eigen::Vector3i& vertex : shape.vertices_steps) {
    low = low.cwiseMin(vertex.cast<double>() * kHeightStep_m);
    high = high.cwiseMax(vertex.cast<double>() * kHeightStep_m);
  }
  return {low, high};
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

tiler::LayerOptions layer_of(const std::string& text) {
  tiler::LayerOptions options;
  core::TomlDocument::parse("kind = \"buildings\"\n" + text, "layer.toml").read(options);
  return options;
}

/// A slope, without anything on it.
struct Land final : tiler::LayerSite {
  double slope = 0.0;
  double ground_z_world(const Vector2d& place) const override { return 300.0 + slope * place.x(); }
  world::Cover cover(const Vector2d&) const override { return world::Cover::Land; }
  bool is_free(const Vector2d&, double) const override { return true; }
};

struct Built {
  explicit Built(const std::string& text, tiler::WorldOptions options = world_of("plane"),
                 core::LogLevel level = core::LogLevel::Off) {
    options.elevation[0].height_m = 300.0;
    surface = prepare(options);
    const core::Log log("tile", level);
    tiler::InstanceIds ids;
    layer = layer_of(text).kind_options().make({.frame = surface->frame(),
                                                .size_m = options.size_m,
                                                .seed = 1,
                                                .surface = *surface,
                                                .earlier = {},
                                                .ids = ids,
                                                .country = {},
                                                .licence = {},
                                                .accuracy = {},
                                                .context = {.log = log, .num_threads = 0}});
  }
  std::int64_t count(const std::string& name) const {
    for (const auto& [key, value] : layer->info().counts)
      if (key == name) return value;
    return 0;
  }
  std::vector<Solid> on(const TileId& id, const Land& land) const {
    world::TileObjects objects;
    layer->add_objects(id, land, objects);
    return objects.solids;
  }
  /// All of the world by number, as they stand on the finest tiles that hold their places.
  std::map<std::uint32_t, Solid> all(const Land& land, int level = 0) const {
    std::map<std::uint32_t, Solid> solids;
    const int side = static_cast<int>(surface->options().size_m) / (256 << level);
    for (int j = -side / 2; j < side / 2; ++j)
      for (int i = -side / 2; i < side / 2; ++i) {
        const TileId id =
            world::tile_at(level, (i + 0.5) * (256 << level), (j + 0.5) * (256 << level));
        for (Solid& solid : on(id, land))
          if (world::tile_at(level, solid.place_m.x(), solid.place_m.y()) == id)
            solids.emplace(solid.provenance.instance_id, std::move(solid));
      }
    return solids;
  }

  std::shared_ptr<const tiler::WorldSurface> surface;
  std::unique_ptr<tiler::Layer> layer;
};

std::string files_key(const std::filesystem::path& file) {
  return "files = [\"" + file.string() + "\"]\n";
}

/// A rectangle in metres about the tests' origin.
std::string wkt(double x, double y, double length, double width) {
  const Vector2d at = utm31(kOriginLat_deg, kOriginLon_deg) + Vector2d(x, y);
  return fmt::format(
      "POLYGON(({0:.3f} {1:.3f},{2:.3f} {1:.3f},{2:.3f} {3:.3f},{0:.3f} {3:.3f},{0:.3f} {1:.3f}))",
      at.x(), at.y(), at.x() + length, at.y() + width);
}

/// Above the ground of the slope, of the shape for a level.
double height_of(const Solid& solid, int level = 0) {
  const world::Shape& shape = *world::shape_at(solid.levels, level);
  int top = -1 << 30;
  for (const auto& vertex : shape.vertices_steps) top = std::max(top, vertex.z());
  return top * kHeightStep_m;
}

TEST(Buildings, HeightsComeFromTagsAndAreCounted) {
  ScratchFolder folder;
  write_vectors(folder / "a.gpkg", "GPKG",
                {{wkt(0, 0, 12, 9), {{"building", "house"}, {"height", "9.5"}}},
                 {wkt(40, 0, 12, 9),
                  {{"building", "apartments"}, {"building:levels", "5"}, {"roof:shape", "flat"}}},
                 {wkt(80, 0, 12, 9), {{"building", "yes"}, {"height", "1e9"}}},
                 {wkt(120, 0, 12, 9), {{"building", "yes"}, {"height", "nan"}}},
                 {wkt(160, 0, 12, 9), {{"building", "no"}}}},
                "EPSG:32631");
  const Built built(files_key(folder / "a.gpkg"));
  EXPECT_EQ(built.count("buildings"), 4);
  EXPECT_EQ(built.count("heights from height"), 2);
  EXPECT_EQ(built.count("heights from levels"), 1);
  EXPECT_EQ(built.count("heights guessed"), 1);
  EXPECT_EQ(built.count("absurd heights clamped"), 1);
  int num_seen = 0;
  for (const auto& [id, solid] : built.all({})) {
    for (const auto& level : solid.levels)
      sound_facts(level.shape, "building " + std::to_string(id));
    const double height = height_of(solid, 2);
    if (solid.place_m.x() < 20) {
      EXPECT_NEAR(height, 9.5, 2 * kHeightStep_m);
      ++num_seen;
    } else if (solid.place_m.x() < 60) {
      // Storeys of flats are 2.9 to 3.1 m high; the parapet ends 0.4 m above the last.
      EXPECT_GT(height, 5 * 2.9 + 0.39);
      EXPECT_LT(height, 5 * 3.1 + 0.41);
      ++num_seen;
    }
  }
  EXPECT_EQ(num_seen, 2);
}

TEST(Buildings, PiersAreLeftToALayerOfRoadsAndTold) {
  ScratchFolder folder;
  const auto area = [](double x, const char* man_made) {
    return VectorSpec{wkt(x, 0, 12, 9), {{"building", "yes"}, {"man_made", man_made}}};
  };
  write_vectors(folder / "a.gpkg", "GPKG",
                {area(0, "pier"),
                 area(40, "breakwater"),
                 area(80, "quay"),
                 area(120, "storage_tank"),
                 {wkt(160, 0, 12, 9), {{"man_made", "pier"}}}},
                "EPSG:32631");
  const auto build = [&](const std::string& keys, tiler::WorldOptions options) {
    testing::internal::CaptureStderr();
    const Built built(files_key(folder / "a.gpkg") + keys, std::move(options),
                      core::LogLevel::Warn);
    return std::tuple(built.count("buildings"),
                      built.count("piers, breakwaters and quays left to a layer of roads"),
                      testing::internal::GetCapturedStderr());
  };
  const auto [num_alone, num_left, told] = build("", world_of("plane"));
  EXPECT_EQ(num_alone, 1);
  EXPECT_EQ(num_left, 3);
  EXPECT_NE(told.find("3 areas tagged building are piers"), std::string::npos) << told;
  tiler::WorldOptions with_roads = world_of("plane");
  core::TomlDocument::parse("kind = \"roads\"\n" + files_key(folder / "a.gpkg"), "layer.toml")
      .read(with_roads.layers.emplace_back());
  const auto [num_built, num_left_to_roads, quiet] = build("", with_roads);
  EXPECT_EQ(num_built, 1);
  EXPECT_EQ(num_left_to_roads, 3);
  EXPECT_EQ(quiet, "");
  const auto [num_all, num_none, of_all] = build("every_area = true\n", world_of("plane"));
  EXPECT_EQ(num_all, 5);
  EXPECT_EQ(num_none, 0);
  EXPECT_EQ(of_all, "");
}

TEST(Buildings, WallsReachIntoTheGroundAndStandAlongUp) {
  ScratchFolder folder;
  write_vectors(
      folder / "a.gpkg", "GPKG",
      {{wkt(12000, -9000, 30, 12), {{"building", "yes"}, {"height", "9"}, {"roof:shape", "flat"}}}},
      "EPSG:32631");
  const Built built(files_key(folder / "a.gpkg"), world_of("plane", 32768.0));
  Land land;
  land.slope = 0.2;
  const auto solids = built.all(land, 5);
  ASSERT_EQ(solids.size(), 1u);
  const Solid& block = solids.begin()->second;
  const auto fine_on = built.on(world::tile_at(0, block.place_m.x(), block.place_m.y()), land);
  ASSERT_EQ(fine_on.size(), 1u);
  const Solid& solid = fine_on[0];
  const world::Shape& shape = solid.levels.front().shape;
  const Vector3d origin = solid.origin_steps.cast<double>() * kHeightStep_m;
  const Vector3d up = built.surface->frame().up_world(origin);
  EXPECT_GT(std::abs(up.x()), 1e-3);
  double lowest = 1e9;
  double highest = -1e9;
  for (const auto& triangle : shape.triangles) {
    std::array<Vector3d, 3> at;
    for (std::size_t k = 0; k < 3; ++k)
      at[k] = origin + shape.vertices_steps[triangle.corners[k]].cast<double>() * kHeightStep_m;
    const Vector3d normal = (at[1] - at[0]).cross(at[2] - at[0]).normalized();
    // Level or upright; a rounded corner turns a wall of 8 m by 0.1 mrad, a parapet of 0.3 m by 3.
    const double leaning = normal.dot(up);
    EXPECT_LT(std::min(std::abs(leaning), 1.0 - std::abs(leaning)), 4e-3);
    for (const Vector3d& corner : at) {
      const double above = corner.z() - land.ground_z_world(corner.head<2>());
      lowest = std::min(lowest, above);
      highest = std::max(highest, above);
      if (leaning < -0.9) {
        EXPECT_LT(above, -1.0) << "the bottom comes out of the ground";
      }
    }
  }
  // 9 m above the lowest of the ground, which is 6 m below the highest.
  EXPECT_NEAR(highest, 9.0, 0.1);
}

/// A ring of places in the world, in degrees.
std::string polygon(const std::vector<Vector2d>& ring) {
  const geo::WorldFrame frame(
      {.lat_deg = kOriginLat_deg, .lon_deg = kOriginLon_deg, .height_m = 0.0});
  std::string text;
  for (std::size_t i = 0; i <= ring.size(); ++i) {
    const Vector2d& place = ring[i % ring.size()];
    const geo::Geodetic at = frame.geodetic_from_world({place.x(), place.y(), 0.0});
    text += fmt::format("{}{:.11f} {:.11f}", i == 0 ? "" : ",", at.lon_deg, at.lat_deg);
  }
  return "POLYGON((" + text + "))";
}

/// Cuttings 7 m wide and 30 m deep towards the north, 512 m apart.
struct Cutting final : tiler::LayerSite {
  double ground_z_world(const Vector2d& place) const override {
    return std::abs(std::remainder(place.x(), 512.0)) < 3.5 ? 270.0 : 300.0;
  }
  world::Cover cover(const Vector2d&) const override { return world::Cover::Land; }
  bool is_free(const Vector2d&, double) const override { return true; }
};

TEST(Buildings, ReachDownToTheGroundThatCoarseTilesShowBesideCuttings) {
  // Seen in Andorra in November 2026: on tiles of 16 m the ground falls from a house to a cutting 10 m away.
  ScratchFolder folder;
  std::vector<VectorSpec> specs;
  for (int k = 0; k < 16; ++k) {
    const Vector2d low(512.0 * (k % 4) - 1024.0 + 4.0 + k, 100.0 * k - 800.0);
    const Vector2d high = low + Vector2d(14.0 + 3.0 * k, 12.0);
    specs.push_back({polygon({low, {high.x(), low.y()}, high, {low.x(), high.y()}}),
                     {{"building", "apartments"}}});
  }
  write_vectors(folder / "a.gpkg", "GPKG", specs);
  const Built built(files_key(folder / "a.gpkg"));
  world::TileObjects objects;
  for (const int x : {-1, 0})
    for (const int y : {-1, 0}) built.layer->add_objects({4, x, y}, Cutting(), objects);
  int num_deep = 0;
  for (const Solid& solid : objects.solids)
    for (const int level : {3, 4, 5}) {
      const world::Shape* shape = world::shape_at(solid.levels, level);
      if (shape == nullptr) continue;
      int low = 0;
      for (const auto& vertex : shape->vertices_steps) low = std::min(low, vertex.z());
      for (const auto& vertex : shape->vertices_steps) {
        if (vertex.z() > low + 512) continue;
        const Eigen::Vector3d foot = (solid.origin_steps + vertex).cast<double>() * kHeightStep_m;
        // Samples in the cutting's middle alone are low: ground falls evenly from those beside them.
        const double spacing_m = std::exp2(level);
        const double from_m = std::abs(std::remainder(foot.x(), 512.0));
        const double shown_z = 300.0 - 30.0 * std::max(1.0 - from_m / spacing_m, 0.0);
        EXPECT_LT(foot.z(), shown_z) << "level " << level << " at " << foot.transpose();
        num_deep += shown_z < 290.0 ? 1 : 0;
      }
    }
  EXPECT_GT(num_deep, 20);
}

TEST(Buildings, AreInAllTilesIntoWhichTheirBlocksReach) {
  // Seen in Archipelago in November 2026. A block is a rectangle of its building's area, about the middle of the one
  // round it: it reaches into the corner that stairs leave free.
  ScratchFolder folder;
  std::vector<VectorSpec> specs;
  const std::vector<Vector2d> stairs = {{0, 0},     {3, 0},   {3, 1}, {1.5, 1},
                                        {1.5, 1.5}, {1, 1.5}, {1, 3}, {0, 3}};
  for (int k = 0; k < 24; ++k) {
    // Steps look west: they end 10 / sqrt(2) = 7.1 m from the middle, the block of 525 m2 sqrt(525 / 2) m = 16.2 m.
    const Vector2d middle(6.0 + 0.45 * k, 70.0 * k - 800.0);
    std::vector<Vector2d> ring;
    for (const Vector2d& at : stairs) {
      const Vector2d from_middle = 10.0 * (at - Vector2d(1.5, 1.5));
      ring.emplace_back(middle + std::sqrt(0.5) * Vector2d(-from_middle.x() - from_middle.y(),
                                                           from_middle.x() - from_middle.y()));
    }
    specs.push_back({polygon(ring), {{"building", "apartments"}}});
  }
  write_vectors(folder / "a.gpkg", "GPKG", specs);
  const Built built(files_key(folder / "a.gpkg"));
  for (const int level : {2, 4, 5}) {
    std::map<int, std::set<std::uint32_t>> held;  // by the tile's column
    std::map<std::uint32_t, double> low_x;
    for (const int x : {-1, 0})
      for (int y = -4; y < 4; ++y) {
        const TileId id{level, x, y};
        for (const Solid& solid : built.on(id, Land())) {
          held[x].insert(solid.provenance.instance_id);
          const world::Shape* shape = world::shape_at(solid.levels, level);
          if (shape == nullptr) continue;
          for (const auto& vertex : shape->vertices_steps) {
            const double at = (solid.origin_steps + vertex).x() * kHeightStep_m;
            double& low = low_x.try_emplace(solid.provenance.instance_id, at).first->second;
            low = std::min(low, at);
          }
        }
      }
    int num_over = 0;
    for (const auto& [id, low] : low_x)
      if (low < 0.0) {
        ++num_over;
        EXPECT_TRUE(held[-1].contains(id)) << "level " << level << ", " << low << " m";
      }
    EXPECT_GE(num_over, level == 2 ? 2 : 21) << level;  // 0.45 m from each to the next
    EXPECT_LT(num_over, 24) << level;
  }
}

TEST(Buildings, WhatStandsInTheSeaIsNoBlockOfFlats) {
  // Seen in Monaco in November 2026: the dike of its harbour, building=yes and no more, was eight storeys high.
  const auto design_beside = [](double shore_x, const std::string& building) {
    tiler::VectorFeature dike;
    dike.number = 1;
    dike.kind = tiler::FeatureKind::Area;
    dike.tags = tiler::FeatureTags({{"building", building}});
    tiler::PointsWorld ring = {{0, 0}, {350, 0}};  // of too many corners for a hall by its shape
    for (int k = 0; k < 8; ++k) {
      ring.emplace_back(350.0 - 40.0 * k, k % 2 == 0 ? 28.0 : 24.0);
      ring.emplace_back(320.0 - 40.0 * k, k % 2 == 0 ? 28.0 : 24.0);
    }
    ring.emplace_back(0, 24);
    dike.parts_world = {{ring}};
    const auto is_land = [&](const Vector2d& at) {
      return at.x() < shore_x || (at.x() > -5 && at.x() < 355 && at.y() > -5 && at.y() < 33);
    };
    const tiler::Town town =
        tiler::build_town({dike}, nullptr,
                          {.is_water = [](const Vector2d&) { return false; },
                           .is_sea = [&](const Vector2d& at) { return !is_land(at); },
                           .is_taken = [](const Vector2d&) { return false; },
                           .height_m = [](const Vector2d&) { return 50.0; }},
                          4096.0, 1);
    return town.buildings.at(0).design;
  };
  EXPECT_EQ(design_beside(50.0, "yes").kind, tiler::BuildingKind::Hall);
  EXPECT_LT(design_beside(50.0, "yes").top_m, 8.0);  // one storey of a hall
  EXPECT_EQ(design_beside(400.0, "yes").kind, tiler::BuildingKind::Apartments);
  EXPECT_EQ(design_beside(50.0, "apartments").kind, tiler::BuildingKind::Apartments);
}

TEST(Buildings, PartsReplaceTheirOutlineAndTwinsStandOnce) {
  ScratchFolder folder;
  write_vectors(
      folder / "a.gpkg", "GPKG",
      {{wkt(0, 0, 40, 20), {{"building", "yes"}, {"height", "10"}}},
       {wkt(0, 0, 20, 20), {{"building:part", "yes"}, {"height", "30"}, {"building", ""}}},
       {wkt(20, 0, 20, 20), {{"building:part", "yes"}, {"height", "12"}, {"min_height", "6"}}},
       {wkt(100, 0, 20, 20), {{"building", "yes"}, {"height", "10"}}},
       {wkt(100, 0, 20, 20), {{"building", "yes"}, {"height", "10"}}},
       {wkt(105, 5, 5, 5), {{"building", "yes"}, {"height", "10"}}},
       {wkt(119, 10, 20, 20), {{"building", "yes"}, {"height", "10"}}},
       {wkt(118, 40, 20, 20), {{"building", "yes"}, {"height", "10"}}},
       {wkt(130, 40, 20, 20), {{"building", "yes"}, {"height", "10"}}}},
      "EPSG:32631");
  const Built built(files_key(folder / "a.gpkg"));
  EXPECT_EQ(built.count("outlines replaced by parts"), 1);
  EXPECT_EQ(built.count("footprints in others left out"), 2);
  EXPECT_EQ(built.count("footprints across others"), 1);
  EXPECT_EQ(built.count("buildings"), 6);
  const auto solids = built.all({});
  ASSERT_EQ(solids.size(), 6u);
  bool has_raised = false;
  for (const auto& [id, solid] : solids) {
    int lowest = 1 << 30;
    for (const auto& vertex : solid.levels.front().shape.vertices_steps)
      lowest = std::min(lowest, vertex.z());
    has_raised = has_raised || std::abs(lowest - steps(6.0)) < 3;
  }
  EXPECT_TRUE(has_raised);
}

TEST(Buildings, WhatBeginsAboveTheGroundIsCarriedOrComesDown) {
  ScratchFolder folder;
  const std::vector<std::pair<std::string, std::string>> raised = {
      {"building", "yes"}, {"height", "8"}, {"min_height", "4"}, {"roof:shape", "flat"}};
  write_vectors(folder / "a.gpkg", "GPKG",
                {{wkt(0, 0, 10, 10), raised},
                 {wkt(100, 0, 10, 10), raised},  // between two others
                 {wkt(90, 0, 10, 10), {{"building", "yes"}, {"height", "8"}}},
                 {wkt(110, 0, 10, 10), {{"building", "yes"}, {"height", "8"}}}},
                "EPSG:32631");
  const Built built(files_key(folder / "a.gpkg"));
  EXPECT_EQ(built.count("raised bodies that nothing carries"), 1);
  for (const auto& [id, solid] : built.all({})) {
    const double low_m = box_of(solid.levels.front().shape).first.z();
    if (solid.place_m.x() >= 100 && solid.place_m.x() < 110) {
      EXPECT_NEAR(low_m, 4.0, 2 * kHeightStep_m);
    } else {
      EXPECT_LT(low_m, -1.0) << solid.place_m.x();
    }
  }
}

TEST(Buildings, HoldTheirFootprintsAndCourtyardsAreFree) {
  ScratchFolder folder;
  const Vector2d at = utm31(kOriginLat_deg, kOriginLon_deg);
  write_vectors(folder / "a.gpkg", "GPKG",
                {{fmt::format("POLYGON(({0} {1},{2} {1},{2} {3},{0} {3},{0} {1}),({4} {5},{6} "
                              "{5},{6} {7},{4} {7},{4} {5}))",
                              at.x(), at.y(), at.x() + 40, at.y() + 40, at.x() + 10, at.y() + 10,
                              at.x() + 30, at.y() + 30),
                  {{"building", "apartments"}}}},
                "EPSG:32631");
  const Built built(files_key(folder / "a.gpkg"));
  // The grid is turned by a degree against the world here: 0.35 m over 20 m.
  EXPECT_TRUE(built.layer->holds({5, 5}, 0.0));
  EXPECT_FALSE(built.layer->holds({20, 20}, 9.5));
  EXPECT_TRUE(built.layer->holds({20, 20}, 10.5));
  EXPECT_FALSE(built.layer->holds({-3, 20}, 2.5));
  EXPECT_TRUE(built.layer->holds({-3, 20}, 3.5));
  EXPECT_FALSE(built.layer->holds({-3, -4}, 4.8));
  EXPECT_TRUE(built.layer->holds({-3, -4}, 5.2));
  const auto solids = built.all({});
  ASSERT_EQ(solids.size(), 1u);
  // Less its inset.
  EXPECT_NEAR(area_from_above_m2(*world::shape_at(solids.begin()->second.levels, 2)), 1200.0, 4.5);
}

TEST(Buildings, TheOrderOfTheSourceAndOfTilesDoesNotMatter) {
  ScratchFolder folder;
  std::vector<VectorSpec> specs;
  for (int j = 0; j < 12; ++j)
    for (int i = 0; i < 12; ++i) {
      const auto key = static_cast<std::uint64_t>(12 * j + i);
      specs.push_back(
          {wkt(core::random_between(-500, 500, 7, key, 0),
               core::random_between(-500, 500, 7, key, 1), core::random_between(4, 40, 7, key, 2),
               core::random_between(4, 25, 7, key, 3)),
           {{"building", "yes"}, {"osm_way_id", std::to_string(1000 + key)}}});
    }
  write_vectors(folder / "a.geojson", "GeoJSON", specs, "EPSG:32631");
  std::reverse(specs.begin(), specs.end());
  write_vectors(folder / "b.geojson", "GeoJSON", specs, "EPSG:32631");
  const Built one(files_key(folder / "a.geojson") + "number_field = \"osm_way_id\"\n");
  const Built other(files_key(folder / "b.geojson") + "number_field = \"osm_way_id\"\n");
  EXPECT_GT(one.count("buildings"), 90);
  Land land;
  land.slope = 0.05;
  std::vector<TileId> tiles;
  for (int level : {-1, 0, 1, 2, 4})
    for (int k = 0; k < 4; ++k)
      tiles.push_back(
          world::tile_at(level, (k & 1) != 0 ? 60.0 : -60.0, (k & 2) != 0 ? 60.0 : -60.0));
  const auto sorted = [&](const Built& built, const TileId& id) {
    std::vector<Solid> solids = built.on(id, land);
    std::sort(solids.begin(), solids.end(), [](const Solid& a, const Solid& b) {
      return a.provenance.instance_id < b.provenance.instance_id;
    });
    return solids;
  };
  std::vector<std::vector<Solid>> at_once(tiles.size());
  core::parallel_for(static_cast<std::int64_t>(tiles.size()), [&](std::int64_t k) {
    at_once[static_cast<std::size_t>(k)] = sorted(one, tiles[static_cast<std::size_t>(k)]);
  });
  std::map<std::pair<std::uint32_t, int>, world::Shape> known;
  for (std::size_t k = tiles.size(); k-- > 0;) {
    EXPECT_EQ(at_once[k], sorted(other, tiles[k])) << tiles[k].name();
    // Each level of a building is the same from any tile.
    for (const Solid& solid : at_once[k])
      for (const auto& level : solid.levels) {
        const auto [found, is_new] =
            known.try_emplace({solid.provenance.instance_id, level.coarsest_level}, level.shape);
        EXPECT_EQ(found->second, level.shape);
      }
  }
}

/// All real footprints of a file, on a slope.
void check_all(const Built& built, const Land& land, std::size_t stride, double flat_share_below) {
  const auto solids = built.all(land, 0);
  std::vector<const Solid*> sample;
  for (const auto& [id, solid] : solids) sample.push_back(&solid);
  std::vector<std::string> problems(sample.size());
  std::vector<double> num_triangles(sample.size(), 0.0);
  core::parallel_for(static_cast<std::int64_t>(sample.size()), [&](std::int64_t k) {
    const auto i = static_cast<std::size_t>(k);
    num_triangles[i] = static_cast<double>(sample[i]->levels.front().shape.triangles.size());
    if (i % stride != 0) return;
    for (const auto& level : sample[i]->levels) {
      const MeshFacts facts = mesh_facts(level.shape);
      if (!facts.problem.empty() || facts.meets_itself)
        problems[i] += fmt::format("level {}: {} {} ", level.coarsest_level, facts.problem,
                                   facts.meets_itself ? "meets itself" : "");
    }
  });
  std::size_t num_bad = 0;
  for (std::size_t i = 0; i < sample.size(); ++i)
    if (!problems[i].empty() && ++num_bad < 20)
      ADD_FAILURE() << "feature " << (sample[i]->provenance.feature & 0xfffffffffffULL) << ": "
                    << problems[i];
  EXPECT_EQ(num_bad, 0u);
  std::sort(num_triangles.begin(), num_triangles.end());
  EXPECT_LE(num_triangles[num_triangles.size() / 2], flat_share_below);
}

TEST(RealBuildings, OfMonacoAreClosedAndMeetNothingOfThemselves) {
  TERRACAST_NEEDS_SHARED_DATA("monaco/monaco.osm.pbf");
  tiler::WorldOptions options = world_of("plane", 8192.0);
  options.origin_lat_deg = 43.7375;
  options.origin_lon_deg = 7.4225;
  const Built built(files_key(shared_data() / "monaco/monaco.osm.pbf"), options);
  EXPECT_GT(built.count("buildings"), 1100);
  Land land;
  land.slope = 0.15;
  check_all(built, land, 1, 150.0);
}

TEST(RealBuildings, OfAndorraAreClosedAndMeetNothingOfThemselves) {
  TERRACAST_NEEDS_SHARED_DATA("andorra/andorra.osm.pbf");
  tiler::WorldOptions options = world_of("plane", 8192.0);
  options.origin_lat_deg = 42.51;
  options.origin_lon_deg = 1.53;
  const Built built(files_key(shared_data() / "andorra/andorra.osm.pbf"), options);
  EXPECT_GT(built.count("buildings"), 1000);
  Land land;
  land.slope = 0.3;
  check_all(built, land, 3, 150.0);
}

/// By GDAL alone: pixel centres a metre within the footprints, in the rasters' own grid.
TEST(RealBuildings, OfAlexandriaAreAsHighAsTheSurfaceLessTheTerrain) {
  TERRACAST_NEEDS_SHARED_DATA("alexandria/alexandria_dsm_2m.tif");
  const std::filesystem::path folder = shared_data() / "alexandria";
  tiler::WorldOptions options = world_of("plane", 1024.0);
  options.origin_lat_deg = 38.8106;
  options.origin_lon_deg = -77.0526;
  const auto surface = prepare(options);
  const auto raster = tiler::HeightRaster::open(path_of(folder / "alexandria_dsm_2m.tif"),
                                                path_of(folder / "alexandria_dtm_2m.tif"),
                                                "declared", *surface, 1024.0);
  GDALAllRegister();
  using Dataset = std::unique_ptr<GDALDataset>;
  const Dataset high(GDALDataset::Open((folder / "alexandria_dsm_2m.tif").c_str(), GDAL_OF_RASTER));
  const Dataset ground(
      GDALDataset::Open((folder / "alexandria_dtm_2m.tif").c_str(), GDAL_OF_RASTER));
  const Dataset file(
      GDALDataset::Open((folder / "alexandria_buildings.geojson").c_str(), GDAL_OF_VECTOR));
  ASSERT_TRUE(high && ground && file);
  const auto value = [](GDALDataset& from, double u, double v) {
    std::array<double, 6> gt = {};
    from.GetGeoTransform(gt.data());
    const int i = static_cast<int>(std::floor((u - gt[0]) / gt[1]));
    const int j = static_cast<int>(std::floor((v - gt[3]) / gt[5]));
    double at = std::nan("");
    if (i >= 0 && j >= 0 && i < from.GetRasterXSize() && j < from.GetRasterYSize() &&
        from.GetRasterBand(1)->RasterIO(GF_Read, i, j, 1, 1, &at, 1, 1, GDT_Float64, 0, 0) !=
            CE_None)
      return std::nan("");
    return at < -1000.0 ? std::nan("") : at;
  };
  OGRSpatialReference utm;
  ASSERT_EQ(utm.SetFromUserInput("EPSG:26918"), OGRERR_NONE);
  utm.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  std::vector<double> differences;
  for (const auto& feature : *file->GetLayer(0)) {
    const OGRGeometry* whole = feature->GetGeometryRef();
    if (whole == nullptr || wkbFlatten(whole->getGeometryType()) != wkbMultiPolygon) continue;
    const OGRPolygon* polygon = whole->toMultiPolygon()->getGeometryRef(0);
    tiler::PointsWorld ring;
    for (const auto& point : *polygon->getExteriorRing())
      ring.push_back(surface->frame()
                         .world_from_geodetic(
                             {.lat_deg = point.getY(), .lon_deg = point.getX(), .height_m = 0.0})
                         .head<2>());
    ring.pop_back();
    std::vector<tiler::PointsWorld> rings = {ring};
    FootprintCounts counts;
    const auto footprints = tiler::footprints_of(rings, counts);
    if (footprints.size() != 1 || polygon->getNumInteriorRings() > 0) continue;
    const std::optional<double> median = raster->median_m(footprints[0]);
    OGRPolygon in_utm(*polygon);
    if (in_utm.transformTo(&utm) != OGRERR_NONE) continue;
    const std::unique_ptr<OGRGeometry> inside(in_utm.Buffer(-1.0));
    OGREnvelope box;
    inside->getEnvelope(&box);
    std::vector<double> heights;
    for (double v = std::floor(box.MinY) + 0.5; v < box.MaxY; v += 1.0)
      for (double u = std::floor(box.MinX) + 0.5; u < box.MaxX; u += 1.0) {
        const OGRPoint at(u, v);
        const double height = value(*high, u, v) - value(*ground, u, v);
        if (std::isfinite(height) && inside->Contains(&at)) heights.push_back(height);
      }
    if (heights.size() < 60 || !median) continue;
    std::nth_element(heights.begin(),
                     heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 2),
                     heights.end());
    differences.push_back(std::abs(*median - heights[heights.size() / 2]));
  }
  ASSERT_GT(differences.size(), 30u);
  std::sort(differences.begin(), differences.end());
  // Bilinear here and nearest there: pixels of 2 m on roofs that lean by up to 0.5 m a pixel.
  EXPECT_LT(differences[differences.size() / 2], 0.15);
  EXPECT_LT(differences[differences.size() * 9 / 10], 0.6);
}

}  // namespace
}  // namespace terracast::test
