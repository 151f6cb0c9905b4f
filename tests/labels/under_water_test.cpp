#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/atomic_file.h"
#include "core/image_io.h"
#include "tests/labels/boxes_world.h"
#include "tests/support/test_data.h"
#include "tests/support/tiny_world.h"
#include "world/sea_bed.h"

// What cameras under water see of the bed, in the image and as the label albedo, held against the
// law by which seagrass grows: in the sea, and not in a lake that stands as high.
namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kDepth_m = 8.0;
constexpr double kEyeDepth_m = 5.0;
constexpr double kFocal_px = 30.0;
constexpr int kWidth = 200, kHeight = 160;

/// The sea west of a bar of land, a lake east of it.
world::TileStore make_waters(const fs::path& folder) {
  const world::TileStore lakes = make_wet_world(
      folder, [](double, double) { return 0.0; },
      [](double x, double) { return std::abs(x) > 60.0 ? kDepth_m : 0.0; },
      {.finest_level = 2, .coarsest_level = 2});
  world::WorldManifest manifest = lakes.manifest();
  for (world::TileInfo& info : manifest.tiles) {
    world::Tile tile = lakes.load(info.id);
    for (const world::Cover cover : tile.cover)  // depths are not read with a tile
      tile.water_depth_steps.push_back(
          world::is_water(cover) ? static_cast<std::int32_t>(kDepth_m / world::kHeightStep_m) : 0);
    if (info.id.x < 0)
      std::replace(tile.cover.begin(), tile.cover.end(), world::Cover::Lake, world::Cover::Sea);
    info = world::write_tile(folder, tile);
  }
  world::LayerInfo layer;
  layer.name = layer.kind = "water";
  manifest.layers.push_back(layer);
  world::write_manifest(folder, manifest);
  return world::TileStore::open(folder);
}

/// The share of the bed that seagrass would cover in a sea of that depth.
double grown_at(const world::TileStore& store, const Vector2d& place) {
  namespace bed = world::sea_bed;
  core::Lanes3d points;
  for (int lane = 0; lane < core::kLanes; ++lane) {
    points[0][lane] = place.x();
    points[1][lane] = place.y();
    points[2][lane] = -kDepth_m;
  }
  const bed::Noise noise =
      bed::noise_at(points, bed::noise_seed(static_cast<std::uint64_t>(store.manifest().seed)));
  return static_cast<double>(
      bed::seagrass(noise.patch[0], noise.weed[0], static_cast<float>(kDepth_m), 0.0f, 0.0f));
}

/// A place round which the law has both meadows and none, by the noise.
Vector2d mixed_place(const world::TileStore& store, double west_x) {
  for (double y = -400.0; y < 400.0; y += 13.0)
    for (double x = west_x; x < west_x + 400.0; x += 13.0) {
      int num_grown = 0, num_bare = 0;
      for (double dy = -6.0; dy <= 6.0; dy += 1.5)
        for (double dx = -6.0; dx <= 6.0; dx += 1.5) {
          const double grown = grown_at(store, {x + dx, y + dy});
          num_grown += grown > 0.99 ? 1 : 0;
          num_bare += grown < 0.01 ? 1 : 0;
        }
      if (num_grown > 25 && num_bare > 25) return {x, y};  // of 81
    }
  ADD_FAILURE() << "no such place";
  return {west_x, 0.0};
}

/// Looks straight down, the image's top to the north.
render::SequencePlan plan_at(const std::vector<Vector2d>& places) {
  render::SequencePlan plan = level_plan(static_cast<int>(places.size()));
  plan.cameras[0].intrinsics.parameters = {kFocal_px, kFocal_px, kWidth / 2.0, kHeight / 2.0};
  plan.cameras[0].rig_from_camera = {};
  plan.tracks.num_points = 0;
  plan.conditions.water_visibility_m = 40.0;
  plan.conditions.sun_elevation_deg = 60.0;
  plan.conditions.sun_azimuth_deg = 180.0;
  for (std::size_t i = 0; i < places.size(); ++i)
    plan.states[i].world_from_body = {
        Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi, Vector3d::UnitX())),
        {places[i].x(), places[i].y(), -kEyeDepth_m}};
  return plan;
}

/// Where a pixel's centre shows the bed.
Vector2d bed_at(const Vector2d& camera, int x, int y) {
  const double range = (kDepth_m - kEyeDepth_m) / kFocal_px;
  return camera + range * Vector2d(x + 0.5 - kWidth / 2.0, -(y + 0.5 - kHeight / 2.0));
}

/// The transfer function of sRGB, IEC 61966-2-1.
double linear(std::uint8_t level) {
  const double share = level / 255.0;
  return share <= 0.04045 ? share / 12.92 : std::pow((share + 0.055) / 1.055, 2.4);
}

/// Of pixels where the law has a meadow, and where it has none.
struct Seen {
  double sum = 0.0, least = 1e9, most = 0.0;
  int count = 0;
  void add(double value) {
    sum += value;
    least = std::min(least, value);
    most = std::max(most, value);
    ++count;
  }
  double mean() const { return sum / count; }
};
struct BothSeen {
  Seen meadow_red, bare_red;      ///< albedo
  Seen meadow_light, bare_light;  ///< in the image, green
};

BothSeen seen_of(const world::TileStore& store, const fs::path& folder, int frame,
                 const Vector2d& camera) {
  const std::string name = fmt::format("{:06}.exr", frame);
  const fs::path file = folder / "labels/albedo/mcs4/cam0" / name;
  const core::ExrImage label = core::decode_exr(core::read_file(file), file.string()).at(0);
  const auto image =
      capture::SequenceReader::open(folder).read_camera(frame, 0, capture::SequenceReader::kColor);
  BothSeen seen;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const double grown = grown_at(store, bed_at(camera, x, y));
      const double red = double{label.float_channels.at("albedo.R")(x, y)};
      const double light = linear(image.color(x, y, 1));
      if (grown > 0.99) {
        seen.meadow_red.add(red);
        seen.meadow_light.add(light);
      } else if (grown < 0.01) {
        seen.bare_red.add(red);
        seen.bare_light.add(light);
      }
    }
  return seen;
}

TEST(UnderWater, SeagrassGrowsInTheSeaAndNotInALakeInImagesAndLabels) {
  const ScratchFolder folder;
  const auto store = make_waters(folder / "world");
  const std::vector<Vector2d> places = {mixed_place(store, -500.0), mixed_place(store, 100.0)};
  const auto sequence = render_plan(store, plan_at(places), folder / "boxes");
  make_labels(sequence, store, "albedo", 2);
  const BothSeen sea = seen_of(store, folder / "boxes", 0, places[0]);
  const BothSeen lake = seen_of(store, folder / "boxes", 1, places[1]);
  for (const BothSeen* seen : {&sea, &lake}) {
    ASSERT_GT(seen->meadow_red.count, 2000);
    ASSERT_GT(seen->bare_red.count, 2000);
  }
  // Nine tenths seagrass of 0.03 and a tenth sand of 0.245.
  EXPECT_LT(sea.meadow_red.most, 0.09);
  EXPECT_GT(sea.bare_red.least, 0.09);
  EXPECT_GT(lake.meadow_red.least, 0.09);
  // So in the image, with light of the water on the way; what else varies is a tenth.
  EXPECT_LT(sea.meadow_light.mean(), 0.6 * sea.bare_light.mean());
  EXPECT_GT(lake.meadow_light.mean(), 0.8 * lake.bare_light.mean());
}

}  // namespace
}  // namespace terracast::test
