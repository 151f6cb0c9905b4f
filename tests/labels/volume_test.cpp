// Volumes of what was seen, read with OpenVDB itself, against brute force over rays and voxels and against the planes of
// the scene.

#include <gtest/gtest.h>
#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>

#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <sstream>
#include <utility>

#include "capture/labels.h"
#include "core/atomic_file.h"
#include "core/hash.h"
#include "core/instance_id.h"
#include "core/json.h"
#include "geo/frames.h"
#include "tests/labels/boxes_world.h"
#include "tests/support/expect_error.h"
#include "tests/support/test_data.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;

constexpr double kVoxel_m = 1.375, kTruncation_m = 4.0, kReach_m = 130.0;
/// Its front lies in the middle of voxels: 72.5 * 1.375 = 99.6875.
const std::vector<WorldBox> kBoxes = {
    {.instance_id = 11, .low = {99.6875, -12, 30}, .high = {110, 8, 60}}};

std::map<std::string, openvdb::FloatGrid::Ptr> read_grids(const fs::path& file) {
  openvdb::initialize();
  std::istringstream in(core::read_text_file(file), std::ios_base::binary);
  openvdb::io::Stream stream(in);
  std::map<std::string, openvdb::FloatGrid::Ptr> grids;
  for (const openvdb::GridBase::Ptr& grid : *stream.getGrids())
    grids[grid->getName()] = openvdb::gridPtrCast<openvdb::FloatGrid>(grid);
  return grids;
}

/// One small image, from 4 m beside the box's middle, with something in the air that moves.
render::SequencePlan small_plan() {
  render::SequencePlan plan = level_plan(1);
  plan.states[0].world_from_body.translation = {0.3, 4.1, 50.2};
  plan.states[0].world_from_body.rotation = Eigen::AngleAxisd(0.05, Vector3d::UnitY());
  plan.cameras[0].intrinsics = {.model = "pinhole",
                                .width_px = 100,
                                .height_px = 80,
                                .parameters = {100.0, 100.0, 50.0, 40.0}};
  render::MovingThing thing{
      .name = "kite",
      .shape = moving_box({-2, -2, -2}, {2, 2, 2}, core::SemanticClass::Drone),
      .semantic_id = static_cast<std::uint32_t>(core::SemanticClass::Drone),
      .parts = {},
      .states = {body_at({60.0, -15.0, 52.0})},
      .gone_m = {0.0}};
  plan.moving = {thing};
  return plan;
}

struct Ray {
  Vector3d origin, direction;  ///< unit
  double end_m = 0.0;
  bool is_surface = false;
};

/// The rays of the image by the scene's planes and boxes; their ends are floats, as captures hold them.
std::vector<Ray> rays_of(const capture::SequenceReader& sequence) {
  const geo::Rigid3d pose = sequence.world_from_camera(0, 0);
  const auto facts = sequence.read_camera(0, 0, capture::SequenceReader::kFacts);
  std::vector<Ray> rays;
  for (int y = 0; y < 80; ++y)
    for (int x = 0; x < 100; ++x) {
      Ray ray{.origin = pose.translation,
              .direction =
                  pose.rotation *
                  Vector3d((x + 0.5 - 50.0) / 100.0, (y + 0.5 - 40.0) / 100.0, 1.0).normalized()};
      double range_m = std::numeric_limits<double>::infinity();
      if (ray.direction.z() < 0.0) range_m = -ray.origin.z() / ray.direction.z();
      const auto meet = [&](const Vector3d& low, const Vector3d& high) {
        double in = 0.0, out = std::numeric_limits<double>::infinity();
        for (int axis = 0; axis < 3; ++axis) {
          const double a = (low[axis] - ray.origin[axis]) / ray.direction[axis];
          const double b = (high[axis] - ray.origin[axis]) / ray.direction[axis];
          in = std::max(in, std::min(a, b));
          out = std::min(out, std::max(a, b));
        }
        if (in <= out && in < range_m) {
          range_m = in;
          return true;
        }
        return false;
      };
      for (const WorldBox& box : kBoxes) meet(box.low, box.high);
      const bool is_moving = meet({58, -17, 50}, {62, -13, 54});
      // The scene is what was captured; the world's ground ends far away.
      if (range_m < 800.0) {
        EXPECT_NEAR(double{facts.range_m(x, y)}, range_m, 1e-6 * range_m + 2e-3);
      }
      EXPECT_EQ(core::is_moving_id(facts.instance_id(x, y)), is_moving);
      range_m = double{facts.range_m(x, y)};
      ray.end_m = std::min(range_m, kReach_m);
      ray.is_surface = range_m <= kReach_m && !is_moving;
      rays.push_back(ray);
    }
  return rays;
}

/// Where a ray is in a voxel's cube; first >= second: nowhere.
std::pair<double, double> part_in(const Ray& ray, const openvdb::Coord& at, double grown_m) {
  double in = 0.0, out = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const double low = at[axis] * kVoxel_m - grown_m, high = (at[axis] + 1) * kVoxel_m + grown_m;
    const double a = (low - ray.origin[axis]) / ray.direction[axis];
    const double b = (high - ray.origin[axis]) / ray.direction[axis];
    in = std::max(in, std::min(a, b));
    out = std::min(out, std::max(a, b));
  }
  return {in, out};
}

struct Volumes : testing::Test {
  static inline std::unique_ptr<ScratchFolder> folder;
  static inline std::optional<world::TileStore> store;
  static inline std::optional<capture::SequenceReader> sequence;
  static inline render::SequencePlan plan;

  void SetUp() override {
    if (folder) return;
    folder = std::make_unique<ScratchFolder>();
    store = make_boxes_world(*folder / "world", kBoxes);
    plan = small_plan();
    sequence = render_plan(*store, plan, *folder / "boxes");
  }
  static void TearDownTestSuite() {
    sequence.reset();
    store.reset();
    folder.reset();
  }
  static std::string keys(const std::string& more = "") {
    return fmt::format("kind = \"volume\"\nvoxel_m = {}\ntruncation_m = {}\nreach_m = {}\n{}",
                       kVoxel_m, kTruncation_m, kReach_m, more);
  }
  static fs::path file() { return *folder / "boxes/labels/volume/volume.vdb"; }
};

TEST_F(Volumes, AreThoseOfBruteForceOverRaysAndVoxels) {
  make_labels_with(*sequence, *store, keys(), plan.moving);
  const auto grids = read_grids(file());
  ASSERT_EQ(grids.size(), 3U);
  const auto& occupancy = *grids.at("occupancy");
  const auto& tsdf = *grids.at("tsdf");
  const auto& weight = *grids.at("weight");
  EXPECT_EQ(occupancy.background(), 0.5F);
  EXPECT_EQ(tsdf.background(), static_cast<float>(kTruncation_m));
  for (const auto& [name, grid] : grids) {
    // Voxel (0, 0, 0) is the cube from the origin: its value stands at its centre.
    const openvdb::Vec3d center = grid->indexToWorld(openvdb::Vec3d(3.0, -2.0, 40.0));
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_DOUBLE_EQ(center[axis], (std::array{3.5, -1.5, 40.5})[std::size_t(axis)] * kVoxel_m);
    EXPECT_NE(grid->metaValue<std::string>("terracast_frame").find("latitude 46"),
              std::string::npos);
  }
  const std::vector<Ray> rays = rays_of(*sequence);
  std::int64_t num_of[3] = {}, num_near = 0, num_unsure = 0;
  // About the box's front, its corner and the kite, whose shadow is not known.
  for (const auto& [low, high] :
       {std::pair(openvdb::Coord(64, -18, 34), openvdb::Coord(78, 10, 46)),
        std::pair(openvdb::Coord(40, -14, 33), openvdb::Coord(52, -6, 42))})
    for (auto at = openvdb::CoordBBox(low, high).begin(); at; ++at) {
      bool is_free = false, is_occupied = false, is_unsure = false;
      double sum = 0.0;
      int count = 0;
      const Vector3d center =
          kVoxel_m * (Vector3d((*at)[0], (*at)[1], (*at)[2]) + Vector3d::Constant(0.5));
      for (const Ray& ray : rays) {
        // Most rays pass far beside.
        const Vector3d to_center = center - ray.origin;
        if ((to_center - to_center.dot(ray.direction) * ray.direction).norm() > kVoxel_m) continue;
        const auto state = [&](double grown_m) {
          const auto [in, out] = part_in(ray, *at, grown_m);
          if (!(in < out)) return 0;
          if (out <= ray.end_m) return 1;
          return in <= ray.end_m ? (ray.is_surface ? 2 : 3) : 4;
        };
        const int now = state(0.0);
        constexpr double kSure_m = 1e-9;  // roundings of places within 130 m
        if (state(kSure_m) != now || state(-kSure_m) != now) is_unsure = true;
        is_free = is_free || now == 1;
        is_occupied = is_occupied || now == 2;
        if (now == 0 || !ray.is_surface) continue;
        const double distance_m = ray.end_m - ray.direction.dot(to_center);
        if (std::abs(std::abs(distance_m) - kTruncation_m) < 1e-9) is_unsure = true;
        if (std::abs(distance_m) > kTruncation_m) continue;
        sum += distance_m;
        ++count;
      }
      if (is_unsure) {
        ++num_unsure;
        continue;
      }
      const bool is_known = is_free || is_occupied;
      ASSERT_EQ(occupancy.tree().isValueOn(*at), is_known) << *at;
      ASSERT_EQ(occupancy.tree().getValue(*at), is_occupied ? 1.0F : is_free ? 0.0F : 0.5F) << *at;
      ++num_of[is_occupied ? 2 : is_free ? 1 : 0];
      ASSERT_EQ(weight.tree().getValue(*at), static_cast<float>(count)) << *at;
      ASSERT_EQ(tsdf.tree().isValueOn(*at), count > 0);
      if (count == 0) continue;
      ++num_near;
      // Steps of the sum and a float.
      ASSERT_NEAR(double{tsdf.tree().getValue(*at)}, sum / count, 1e-6) << *at;
    }
  EXPECT_GT(num_of[0], 500);
  EXPECT_GT(num_of[1], 1000);
  EXPECT_GT(num_of[2], 100);
  EXPECT_GT(num_near, 500);
  EXPECT_LT(num_unsure, 20);
}

TEST_F(Volumes, DistancesAreThoseToTheScenesPlanes) {
  // Of the front at x = 99.6875: distances along rays differ from the plane's by what the rays pass beside the centres.
  const auto for_each_of_front = [&](const openvdb::FloatGrid& tsdf, const auto& visit) {
    int num = 0;
    for (auto at = openvdb::CoordBBox({69, -7, 28}, {76, 4, 41}).begin(); at; ++at) {
      if (!tsdf.tree().isValueOn(*at)) continue;
      ++num;
      visit(99.6875 - ((*at)[0] + 0.5) * kVoxel_m, double{tsdf.tree().getValue(*at)});
    }
    EXPECT_GT(num, 400);
  };
  make_labels_with(*sequence, *store, keys(), plan.moving);
  int num_behind = 0;
  for_each_of_front(*read_grids(file()).at("tsdf"), [&](double before_m, double value_m) {
    // No ray there is more than 0.3 rad off the front's normal: |s - z / cos| <= sqrt(3)/2 voxel tan.
    const double most_m = std::abs(before_m) * (1.0 / std::cos(0.3) - 1.0) +
                          0.5 * std::sqrt(3.0) * kVoxel_m * std::tan(0.3);
    EXPECT_NEAR(value_m, before_m, most_m);
    num_behind += value_m < 0.0 ? 1 : 0;
  });
  EXPECT_GT(num_behind, 100);
  make_labels_with(*sequence, *store, keys("distance = \"plane\"\n"), plan.moving);
  for_each_of_front(*read_grids(file()).at("tsdf"), [&](double before_m, double value_m) {
    // Ranges are floats, corners on a lattice of 2^-10 m.
    EXPECT_NEAR(value_m, std::clamp(before_m, -kTruncation_m, kTruncation_m), 1e-3);
  });
  const auto occupancy = read_grids(file()).at("occupancy");
  // A metre before the front all is free; the front's own voxels are not; within the box nothing is known.
  for (int y = -6; y <= 3; ++y)
    for (int z = 30; z <= 40; ++z) {
      EXPECT_EQ(occupancy->tree().getValue({71, y, z}), 0.0F);
      EXPECT_EQ(occupancy->tree().getValue({72, y, z}), 1.0F);
      EXPECT_EQ(occupancy->tree().getValue({75, y, z}), 0.5F);
    }
}

TEST_F(Volumes, SameBytesForAnyThreadsAndOnlyMadeOnce) {
  fs::remove_all(file().parent_path());
  make_labels_with(*sequence, *store, keys(), plan.moving, 1);
  const std::string whole = core::content_hash_of_file(file());
  const auto time = fs::last_write_time(file());
  make_labels_with(*sequence, *store, keys("memory_bytes = 1e9\n"), plan.moving, 2);
  EXPECT_EQ(fs::last_write_time(file()), time);
  fs::resize_file(file(), 1000);
  make_labels_with(*sequence, *store, keys(), plan.moving, 2);
  EXPECT_EQ(core::content_hash_of_file(file()), whole);
  const core::Json record = core::Json::read(file().parent_path() / "volume.json");
  EXPECT_GT(record.at("rays_on_what_moves").integer(), 20);
}

TEST_F(Volumes, WhatCannotBeIsRefused) {
  fs::remove_all(file().parent_path());
  expect_error(core::ErrorKind::Config, {"memory_bytes", "voxel_m larger"}, [&] {
    make_labels_with(*sequence, *store, "kind = \"volume\"\nvoxel_m = 0.05\nmemory_bytes = 1e8\n",
                     plan.moving);
  });
  EXPECT_FALSE(fs::exists(file()));
  expect_error(core::ErrorKind::Config, {"truncation_m", "between voxels"}, [&] {
    make_labels_with(*sequence, *store, "kind = \"volume\"\ntruncation_m = 0.2\n", plan.moving);
  });
}

}  // namespace
}  // namespace terracast::test
