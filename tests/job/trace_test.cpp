#include "job/trace.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "core/log.h"
#include "core/semantic_class.h"
#include "tests/support/test_data.h"
#include "tiler/layer_stack.h"
#include "tiler/surface.h"
#include "tiler/tile_stage.h"

namespace terracast::test {
namespace {

using core::Json;
using world::kHeightStep_m;

std::int32_t steps_of(double value_m) {
  return static_cast<std::int32_t>(std::lround(value_m / kHeightStep_m));
}

constexpr double kGround_m = 300.0;
constexpr double kBoxHeight_m = 8.0;

/// A box of 20 x 10 x 8 m whose lowest corner is at (100, 40), feature 4242 of its source, and a road of
/// 8 m along y = -60, feature 77.
class BoxAndRoad final : public tiler::Layer {
 public:
  world::LayerInfo info() const override {
    world::LayerInfo info;
    info.source = "town.gpkg";
    return info;
  }
  std::string input_hash() const override { return "box and road"; }
  void add_objects(const world::TileId& id, const tiler::LayerSite& site,
                   world::TileObjects& objects) const override {
    const Eigen::AlignedBox2d square(id.corner_world(),
                                     id.corner_world() + Eigen::Vector2d::Constant(id.side_m()));
    if (square.intersects(
            Eigen::AlignedBox2d(Eigen::Vector2d(100, 40), Eigen::Vector2d(120, 50)))) {
      world::Solid solid;
      solid.provenance = {.instance_id = 9, .layer = 0, .feature = 4242};
      solid.place_m = {110, 45};
      solid.origin_steps = {steps_of(100.0), steps_of(40.0),
                            steps_of(site.ground_z_world({110.0, 45.0}))};
      world::Shape shape;
      for (int k = 0; k < 8; ++k)
        shape.vertices_steps.emplace_back((k & 1) != 0 ? steps_of(20.0) : 0,
                                          (k & 2) != 0 ? steps_of(10.0) : 0,
                                          (k & 4) != 0 ? steps_of(kBoxHeight_m) : 0);
      constexpr std::uint32_t kFaces[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6},
                                               {0, 1, 4}, {1, 5, 4}, {2, 6, 3}, {3, 6, 7},
                                               {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
      for (const auto& face : kFaces)
        shape.triangles.push_back({.corners = {face[0], face[1], face[2]}, .finish = 0});
      shape.finishes.push_back(
          {.material = world::Material::Plain, .semantic_class = core::SemanticClass::Warehouse});
      solid.levels = {{.coarsest_level = 6, .shape = shape}};
      objects.solids.push_back(std::move(solid));
    }
    if (square.intersects(
            Eigen::AlignedBox2d(Eigen::Vector2d(-200, -64), Eigen::Vector2d(200, -56)))) {
      world::Strip strip;
      strip.coating = {.layer = 0,
                       .feature = 77,
                       .order = 0,
                       .paving = world::Paving::Asphalt,
                       .semantic_class = core::SemanticClass::Road};
      strip.half_width_steps = steps_of(4.0);
      strip.whole_m = 400.0;
      strip.points_steps = {{steps_of(-200.0), steps_of(-60.0)},
                            {steps_of(200.0), steps_of(-60.0)}};
      objects.strips.push_back(std::move(strip));
    }
  }
};

world::TileStore make_store(const std::filesystem::path& folder) {
  const core::Log log("tile", core::LogLevel::Off);
  const core::Context context{.log = log, .num_threads = 0, .events_file = {}};
  tiler::WorldOptions options;
  options.origin_lat_deg = 42.5;
  options.origin_lon_deg = 1.5;
  options.size_m = 2048.0;
  options.outside = "extend";
  tiler::ElevationOptions entry;
  entry.kind = "plane";
  entry.vertical_datum = "ellipsoid";
  entry.height_m = kGround_m;
  options.elevation = {entry};
  std::vector<std::unique_ptr<tiler::Layer>> layers;
  layers.push_back(std::make_unique<BoxAndRoad>());
  const auto surface = tiler::layered_surface(tiler::WorldSurface::prepare(options, context),
                                              tiler::LayerStack(options.size_m, std::move(layers)));
  tiler::TilePlan plan;
  plan.detail.finest_spacing_m = 2.0;
  plan.sequences.push_back(
      {{.position_world = {0.0, 0.0, kGround_m + 100.0}, .pixels_per_radian = 100.0}});
  return tiler::run_tile_stage(*surface, plan, folder, context);
}

TEST(TraceOfObjects, NamesTheFeatureThatStandsOrIsPaintedThere) {
  const ScratchFolder folder;
  const world::TileStore store = make_store(folder.path());
  const auto trace = [&](double x, double y) { return job::trace_world_place(store, {x, y}); };

  const Json roof = trace(115.0, 48.0);
  EXPECT_EQ(roof.at("surface").string(), "object") << roof.text();
  EXPECT_EQ(roof.at("class").at("name").string(), "warehouse");
  EXPECT_EQ(roof.at("instance_id").integer(), 9);
  EXPECT_EQ(roof.at("feature").integer(), 4242);
  EXPECT_EQ(roof.at("layer").at("source").string(), "town.gpkg");
  EXPECT_FALSE(roof.has("elevation"));
  // Up leans by 20 urad there, and the lattice has steps of a millimetre.
  EXPECT_NEAR(roof.at("place").at("height_m").number(), kGround_m + kBoxHeight_m, 3e-3);

  const Json road = trace(-30.0, -62.5);
  EXPECT_EQ(road.at("surface").string(), "paint") << road.text();
  EXPECT_EQ(road.at("class").at("name").string(), "road");
  EXPECT_EQ(road.at("instance_id").integer(), 0);
  EXPECT_EQ(road.at("feature").integer(), 77);
  EXPECT_EQ(road.at("layer").at("source").string(), "town.gpkg");
  EXPECT_EQ(road.at("elevation").at("source").string(), "plane");

  const Json beside = trace(-30.0, -64.5);
  EXPECT_EQ(beside.at("surface").string(), "ground");
  EXPECT_FALSE(beside.has("layer"));
  EXPECT_NEAR(beside.at("place").at("height_m").number(), kGround_m, 3e-3);
  EXPECT_EQ(trace(99.9, 45.0).at("surface").string(), "ground");

  EXPECT_NE(job::trace_text(roof).find("town.gpkg"), std::string::npos);
  EXPECT_NE(job::trace_text(road).find("77"), std::string::npos);
}

}  // namespace
}  // namespace terracast::test
