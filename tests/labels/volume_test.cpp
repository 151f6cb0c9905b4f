// Volumes of what was seen, read with OpenVDB itself, against brute force over rays and voxels and against the planes of
// the scene.

#include <gtest/gtest.h>
#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>

#include <array>
#include <cmath>
#include <functional>
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
  scene::MovingThing thing{.name = "kite",
                           .shape = moving_box({-2, -2, -2}, {2, 2, 2}, core::SemanticClass::Drone),
                           .semantic_id = static_cast<std::uint32_t>(core::SemanticClass::Drone),
                           .parts = {},
                           .states = {body_at({60.0, -15.0, 52.0})},
                           .gone_m = {0.0}};
  plan.moving = {thing};
  return plan;
}

/// The same from a camera whose rays are parallel, two a metre, and lie along no axis of the world.
render::SequencePlan orthographic_plan() {
  render::SequencePlan plan = small_plan();
  plan.states[0].world_from_body.rotation =
      Eigen::AngleAxisd(0.05, Vector3d::UnitY()) * Eigen::AngleAxisd(0.03, Vector3d::UnitZ());
  plan.cameras[0].intrinsics.model = "orthographic";
  plan.cameras[0].intrinsics.parameters = {2.0, 2.0, 50.0, 40.0};
  return plan;
}

/// The same from a body that goes on 7 m aside and turns by 0.06 rad while the rows are read out.
constexpr double kLineTime_s = 0.001;
render::SequencePlan rolling_plan() {
  render::SequencePlan plan = small_plan();
  plan.states[0].velocity_world_mps = {20.0, -90.0, 15.0};
  plan.states[0].angular_velocity_body_radps = {0.0, 0.0, 0.75};
  plan.cameras[0].shutter = {.line_time_s = kLineTime_s};
  return plan;
}

struct Ray {
  Vector3d origin, direction;  ///< unit
  double end_m = 0.0;
  bool is_surface = false;
};

/// Where the ray of an image point starts and where it goes.
using RayRule = std::function<Ray(double x_px, double y_px)>;

/// Of a pinhole of f = 100 px with its principal point at (50, 40).
Vector3d pinhole_ray(double x_px, double y_px) {
  return Vector3d((x_px - 50.0) / 100.0, (y_px - 40.0) / 100.0, 1.0).normalized();
}

/// The rays of the image by the scene's planes and boxes; their ends are floats, as captures hold them.
std::vector<Ray> rays_of(const capture::SequenceReader& sequence, const RayRule& ray_at) {
  const auto facts = sequence.read_camera(0, 0, capture::SequenceReader::kFacts);
  std::vector<Ray> rays;
  for (int y = 0; y < 80; ++y)
    for (int x = 0; x < 100; ++x) {
      Ray ray = ray_at(x + 0.5, y + 0.5);
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

/// What rays tell of a voxel, by brute force.
struct VoxelTruth {
  bool is_free = false, is_occupied = false;
  bool is_unsure = false;  ///< roundings decide
  double sum_m = 0.0;      ///< of distances along the rays
  int count = 0;

  bool is_known() const { return is_free || is_occupied; }
};

VoxelTruth truth_of(const std::vector<Ray>& rays, const openvdb::Coord& at) {
  VoxelTruth truth;
  const Vector3d center = kVoxel_m * (Vector3d(at[0], at[1], at[2]) + Vector3d::Constant(0.5));
  for (const Ray& ray : rays) {
    // Most rays pass far beside.
    const Vector3d to_center = center - ray.origin;
    if ((to_center - to_center.dot(ray.direction) * ray.direction).norm() > kVoxel_m) continue;
    const auto state = [&](double grown_m) {
      const auto [in, out] = part_in(ray, at, grown_m);
      if (!(in < out)) return 0;
      if (out <= ray.end_m) return 1;
      return in <= ray.end_m ? (ray.is_surface ? 2 : 3) : 4;
    };
    const int now = state(0.0);
    constexpr double kSure_m = 1e-9;  // roundings of places within 130 m
    if (state(kSure_m) != now || state(-kSure_m) != now) truth.is_unsure = true;
    truth.is_free = truth.is_free || now == 1;
    truth.is_occupied = truth.is_occupied || now == 2;
    if (now == 0 || !ray.is_surface) continue;
    const double distance_m = ray.end_m - ray.direction.dot(to_center);
    if (std::abs(std::abs(distance_m) - kTruncation_m) < 1e-9) truth.is_unsure = true;
    if (std::abs(distance_m) > kTruncation_m) continue;
    truth.sum_m += distance_m;
    ++truth.count;
  }
  return truth;
}

/// Voxels between two, both among them.
using Window = std::pair<openvdb::Coord, openvdb::Coord>;
/// About the box's front and its corner.
const Window kFront = {{64, -18, 34}, {78, 10, 46}};
/// About the kite, whose shadow is not known.
const Window kKite = {{40, -14, 33}, {52, -6, 42}};

/// Compares all voxels of windows.
void expect_brute_force(const std::map<std::string, openvdb::FloatGrid::Ptr>& grids,
                        const std::vector<Ray>& rays, const std::vector<Window>& windows) {
  const auto& occupancy = grids.at("occupancy")->tree();
  const auto& tsdf = grids.at("tsdf")->tree();
  const auto& weight = grids.at("weight")->tree();
  std::int64_t num_unknown = 0, num_free = 0, num_occupied = 0, num_near = 0, num_unsure = 0;
  for (const auto& [low, high] : windows)
    for (auto at = openvdb::CoordBBox(low, high).begin(); at; ++at) {
      const VoxelTruth truth = truth_of(rays, *at);
      if (truth.is_unsure) {
        ++num_unsure;
        continue;
      }
      ASSERT_EQ(occupancy.isValueOn(*at), truth.is_known()) << *at;
      ASSERT_EQ(occupancy.getValue(*at), truth.is_occupied ? 1.0F
                                         : truth.is_free   ? 0.0F
                                                           : 0.5F)
          << *at;
      ++(truth.is_occupied ? num_occupied : truth.is_free ? num_free : num_unknown);
      ASSERT_EQ(weight.getValue(*at), static_cast<float>(truth.count)) << *at;
      ASSERT_EQ(tsdf.isValueOn(*at), truth.count > 0);
      if (truth.count == 0) continue;
      ++num_near;
      // Steps of the sum and a float.
      ASSERT_NEAR(double{tsdf.getValue(*at)}, truth.sum_m / truth.count, 1e-6) << *at;
    }
  EXPECT_GT(num_unknown, 500);
  EXPECT_GT(num_free, 1000);
  EXPECT_GT(num_occupied, 100);
  EXPECT_GT(num_near, 500);
  EXPECT_LT(num_unsure, 20);
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
  EXPECT_EQ(grids.at("occupancy")->background(), 0.5F);
  EXPECT_EQ(grids.at("tsdf")->background(), static_cast<float>(kTruncation_m));
  for (const auto& [name, grid] : grids) {
    // Voxel (0, 0, 0) is the cube from the origin: its value stands at its centre.
    const openvdb::Vec3d center = grid->indexToWorld(openvdb::Vec3d(3.0, -2.0, 40.0));
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_DOUBLE_EQ(center[axis], (std::array{3.5, -1.5, 40.5})[std::size_t(axis)] * kVoxel_m);
    EXPECT_NE(grid->metaValue<std::string>("terracast_frame").find("latitude 46"),
              std::string::npos);
  }
  const geo::Rigid3d pose = sequence->world_from_camera(0, 0);
  const auto rays = rays_of(*sequence, [&](double x_px, double y_px) {
    return Ray{.origin = pose.translation, .direction = pose.rotation * pinhole_ray(x_px, y_px)};
  });
  expect_brute_force(grids, rays, {kFront, kKite});
}

TEST_F(Volumes, OfParallelRaysStartWhereEachOfThemDoes) {
  const render::SequencePlan parallel = orthographic_plan();
  const auto seen = render_plan(*store, parallel, *folder / "parallel");
  make_labels_with(seen, *store, keys(), parallel.moving);
  const geo::Rigid3d pose = seen.world_from_camera(0, 0);
  const auto rays = rays_of(seen, [&](double x_px, double y_px) {
    return Ray{.origin = pose * Vector3d((x_px - 50.0) / 2.0, (y_px - 40.0) / 2.0, 0.0),
               .direction = pose.rotation * Vector3d::UnitZ()};
  });
  expect_brute_force(read_grids(*folder / "parallel/labels/volume/volume.vdb"), rays,
                     {kFront, kKite});
}

TEST_F(Volumes, OfARollingShutterStartWhereEachLineIsExposed) {
  const render::SequencePlan rolling = rolling_plan();
  const auto seen = render_plan(*store, rolling, *folder / "rolling");
  make_labels_with(seen, *store, keys(), rolling.moving);
  const geo::BodyState& state = rolling.states[0];
  const auto rays = rays_of(seen, [&](double x_px, double y_px) {
    // Row 40's upper edge is at the frame's time. The body turns about its own upright axis.
    const double t = kLineTime_s * (y_px - 40.0);
    const Eigen::Quaterniond world_from_body =
        state.world_from_body.rotation *
        Eigen::AngleAxisd(t * state.angular_velocity_body_radps.z(), Vector3d::UnitZ());
    return Ray{.origin = state.world_from_body.translation + t * state.velocity_world_mps,
               .direction =
                   world_from_body * (geo::rig_from_rdf() * pinhole_ray(x_px, y_px)).normalized()};
  });
  expect_brute_force(read_grids(*folder / "rolling/labels/volume/volume.vdb"), rays,
                     {kFront, kKite});
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
