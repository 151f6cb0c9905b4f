// The range to what lies below the water, held against planes: a lake of a known level over a bed of a known shape. The
// tests have the planes, the cameras' poses and their lenses by themselves.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "capture/frame_reader.h"
#include "capture/sequence_files.h"
#include "core/atomic_file.h"
#include "core/image_io.h"
#include "core/toml_reader.h"
#include "labels/label.h"
#include "render/checked_plan.h"
#include "tests/support/expect_error.h"
#include "tests/support/hills_flight.h"
#include "tests/support/test_data.h"

namespace terracast::sensors {
namespace {

namespace fs = std::filesystem;
using capture::SemanticClass;
using Eigen::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kReach_m = 2048.0;    ///< of the world, to each side
constexpr double kSpacing_m = 8.0;     ///< of its samples
constexpr double kSurface_z = 40.0;    ///< of the lake, and of the land beside it
constexpr double kFloat = 0x1.01p-24;  ///< half a step of a float, as a share, and what doubles add

/// How deep the lake is; whole steps of height at whole samples, so that triangles lie in the very plane.
struct Bed {
  const char* name;
  double depth_m;  ///< at x = y = 0
  double east, north;
  double depth_at(double x, double y) const { return depth_m + east * x + north * y; }
};

/// A lens as its publication writes it: the ray of an image point in the camera's frame. What starts elsewhere than at
/// the camera's place does so by `origin`.
struct Lens {
  geo::CameraIntrinsics intrinsics;
  std::function<Vector3d(double u, double v)> ray;
  std::function<Vector3d(double u, double v)> origin = [](double, double) {
    return Vector3d(Vector3d::Zero());
  };
};

std::vector<Lens> lenses() {
  const auto pinhole = [](double u, double v) { return Vector3d((u - 17) / 40, (v - 21) / 44, 1); };
  // Of equal angles: so many radians from the axis as pixels from the middle, over the focal length.
  const auto fisheye = [](double u, double v) {
    const double x = (u - 25) / 14, y = (v - 20) / 14, angle = std::hypot(x, y);
    const double in_image = angle > 0.0 ? std::sin(angle) / angle : 1.0;
    return Vector3d(x * in_image, y * in_image, std::cos(angle));
  };
  const auto sphere = [](double u, double v) {
    const double k = std::numbers::pi / 32, azimuth = (u - 32) * k, down = (v - 16) * k;
    return Vector3d(std::sin(azimuth) * std::cos(down), std::sin(down),
                    std::cos(azimuth) * std::cos(down));
  };
  const auto parallel = [](double, double) { return Vector3d(Vector3d::UnitZ()); };
  const double per_rad = 32 / std::numbers::pi;
  return {{{"pinhole", 48, 40, {40, 44, 17, 21}}, pinhole},
          {{"opencv_fisheye", 50, 40, {14, 14, 25, 20, 0, 0, 0, 0}}, fisheye},
          {{"equirectangular", 64, 32, {per_rad, per_rad, 32, 16}}, sphere},
          {{"orthographic", 40, 32, {0.5, 0.5, 20, 16}}, parallel, [](double u, double v) {
             return Vector3d((u - 20) / 0.5, (v - 16) / 0.5, 0.0);
           }}};
}

/// Cameras away from the body's point, turned and rolled, whose axes come down on the lake.
render::SequencePlan plan_over(const Lens& lens) {
  render::SequencePlan plan = test::small_plan(1, 40, 32);
  plan.cameras.resize(1);
  plan.cameras[0].intrinsics = lens.intrinsics;
  plan.conditions.bottom_range = true;
  plan.states[0].world_from_body.translation = {310.0, -170.0, 117.0};
  plan.states[0].world_from_body.rotation = Eigen::AngleAxisd(2.1, Vector3d::UnitZ()) *
                                            Eigen::AngleAxisd(0.3, Vector3d::UnitY()) *
                                            Eigen::AngleAxisd(-0.4, Vector3d::UnitX());
  return plan;
}

struct Lake {
  Lake(const fs::path& folder, const Bed& bed, double shore_x)
      : store(test::make_wet_world(
            folder, [](double, double) { return kSurface_z; },
            [=](double x, double y) { return x < shore_x ? 0.0 : bed.depth_at(x, y); },
            {.finest_level = 3, .coarsest_level = 3})) {
    world::WorldManifest manifest = store.manifest();
    world::LayerInfo layer;
    layer.name = layer.kind = "water";
    manifest.layers.push_back(layer);
    world::write_manifest(folder, manifest);
    store = world::TileStore::open(folder);
  }
  world::TileStore store;
};

TruthFrame truth_of(const world::TileStore& store, const render::SequencePlan& plan) {
  return test::TracedPlan(store, plan).renderer.truth(0, 0);
}

/// Where a ray comes down to a plane n . p = 1 or to nothing, as far as the world reaches.
double range_to_plane(const Vector3d& from, const Vector3d& ray, const Vector3d& normal,
                      double at_normal) {
  const double t = (at_normal - normal.dot(from)) / normal.dot(ray);
  const Vector3d point = from + t * ray;
  return t > 0.0 && std::max(std::abs(point.x()), std::abs(point.y())) < kReach_m ? t : kInfinity;
}

class BottomRange : public testing::TestWithParam<Bed> {};

TEST_P(BottomRange, IsStraightOnToTheBedOfALakeWhereThePlanesPutIt) {
  const Bed& bed = GetParam();
  const test::ScratchFolder folder;
  const Lake lake(folder / "world", bed, -kInfinity);
  const Vector3d normal(bed.east, bed.north, 1.0);
  for (const Lens& lens : lenses()) {
    SCOPED_TRACE(lens.intrinsics.model);
    const render::SequencePlan plan = plan_over(lens);
    const geo::Rigid3d world_from_camera =
        plan.states[0].world_from_body * plan.cameras[0].body_from_camera();
    const TruthFrame truth = truth_of(lake.store, plan);
    const core::ImageF& bottom = truth.facts.bottom_range_m;
    ASSERT_EQ(bottom.width(), lens.intrinsics.width_px);
    ASSERT_EQ(bottom.height(), lens.intrinsics.height_px);
    int num_wet = 0, num_sky = 0;
    for (int y = 0; y < bottom.height(); ++y)
      for (int x = 0; x < bottom.width(); ++x) {
        const Vector3d ray = world_from_camera.rotation * lens.ray(x + 0.5, y + 0.5).normalized();
        const Vector3d from = world_from_camera * lens.origin(x + 0.5, y + 0.5);
        const double surface_m = range_to_plane(from, ray, Vector3d::UnitZ(), kSurface_z);
        if (std::isinf(surface_m)) {
          ++num_sky;
          ASSERT_EQ(truth.facts.range_m(x, y), kInfinity);
          ASSERT_EQ(bottom(x, y), kInfinity);
          continue;
        }
        const double expected_m = range_to_plane(from, ray, normal, kSurface_z - bed.depth_m);
        ASSERT_EQ(truth.facts.semantic_id(x, y), static_cast<std::uint32_t>(SemanticClass::Lake));
        ASSERT_NEAR(double{truth.facts.range_m(x, y)}, surface_m, kFloat * surface_m);
        // Beyond the world there is no bed; within it the ray goes on unbent.
        if (std::isinf(expected_m))
          ASSERT_EQ(bottom(x, y), kInfinity) << x << " " << y;
        else
          ASSERT_NEAR(double{bottom(x, y)}, expected_m, kFloat * expected_m) << x << " " << y;
        num_wet += std::isinf(expected_m) ? 0 : 1;
      }
    EXPECT_GT(num_wet, bottom.width() * bottom.height() / 4);
    if (lens.intrinsics.model == "equirectangular") {
      EXPECT_GT(num_sky, 500);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Beds, BottomRange,
                         testing::Values(Bed{"level", 25.0, 0.0, 0.0},
                                         Bed{"sloped", 60.0, 1.0 / 64, -1.0 / 128}),
                         [](const auto& bed) { return std::string(bed.param.name); });

// A shore along x = 0: land to the west, and a bed that falls from it by a sixteenth to the east.
TEST(BottomRangeAtAShore, IsTheRangeOfLandAndBegins) {
  const Bed bed{"beach", 0.0, 1.0 / 16, 0.0};
  const test::ScratchFolder folder;
  const Lake lake(folder / "world", bed, 0.0);
  for (const Lens& lens : lenses()) {
    SCOPED_TRACE(lens.intrinsics.model);
    render::SequencePlan plan = plan_over(lens);
    plan.states[0].world_from_body.translation.x() = 20.0;
    const geo::Rigid3d world_from_camera =
        plan.states[0].world_from_body * plan.cameras[0].body_from_camera();
    const TruthFrame truth = truth_of(lake.store, plan);
    int num_land = 0, num_wet = 0;
    for (int y = 0; y < lens.intrinsics.height_px; ++y)
      for (int x = 0; x < lens.intrinsics.width_px; ++x) {
        const Vector3d ray = world_from_camera.rotation * lens.ray(x + 0.5, y + 0.5).normalized();
        const Vector3d from = world_from_camera * lens.origin(x + 0.5, y + 0.5);
        const double surface_m = range_to_plane(from, ray, Vector3d::UnitZ(), kSurface_z);
        if (std::isinf(surface_m)) continue;
        const double met_x = (from + surface_m * ray).x();
        const bool is_lake =
            truth.facts.semantic_id(x, y) == static_cast<std::uint32_t>(SemanticClass::Lake);
        // Cells of the shore are land or water as their samples have it.
        ASSERT_TRUE(is_lake || met_x < kSpacing_m) << met_x;
        ASSERT_TRUE(!is_lake || met_x > -kSpacing_m) << met_x;
        const float bottom = truth.facts.bottom_range_m(x, y);
        if (!is_lake) {
          ASSERT_EQ(bottom, truth.facts.range_m(x, y));
          ++num_land;
          continue;
        }
        if (met_x < 0.0) continue;  // a cell of land that is called water: there is no bed below it
        double expected_m = range_to_plane(from, ray, {bed.east, 0.0, 1.0}, kSurface_z);
        // Under water a ray to the west comes to the beach, which ends at the surface: never beyond the shore.
        ASSERT_GT((from + expected_m * ray).x(), -1e-9);
        if (std::isinf(expected_m)) continue;
        ASSERT_NEAR(double{bottom}, expected_m, kFloat * expected_m) << x << " " << y;
        ++num_wet;
      }
    EXPECT_GT(num_land, 100);
    EXPECT_GT(num_wet, 100);
  }
}

struct Captured : testing::Test {
  void render(const fs::path& to) {
    const core::Log log("test", core::LogLevel::Off);
    render::run_render_stage(lake.store, plan, {}, {}, to,
                             {.log = log, .num_threads = 2, .events_file = {}});
  }
  void label(const fs::path& captured) {
    const core::Log log("test", core::LogLevel::Off);
    std::vector<labels::LabelOptions> options = {labels::LabelOptions("bottom")};
    labels::run_label_stage(capture::SequenceReader::open(captured), lake.store, {}, options,
                            {.log = log, .num_threads = 2, .events_file = {}});
  }
  static core::ExrImage read_exr(const fs::path& file) {
    return core::decode_exr(core::read_file(file), file.string()).at(0);
  }

  test::ScratchFolder folder;
  Lake lake{folder / "world", Bed{"level", 25.0, 0.0, 0.0}, -kInfinity};
  render::SequencePlan plan = plan_over(lenses()[0]);
};

TEST_F(Captured, IsInTheFileAndInLabelsOfItsOwn) {
  render(folder / "capture" / "P000");
  const TruthFrame truth = truth_of(lake.store, plan);
  label(folder / "capture" / "P000");
  const fs::path image = fs::path(plan.cameras[0].rig) / plan.cameras[0].name / "000000.exr";
  for (const fs::path& file :
       {folder / "capture" / "P000" / image,
        folder / "capture" / "P000" / capture::kLabelsFolder / "bottom" / image}) {
    const core::ExrImage exr = read_exr(file);
    ASSERT_TRUE(exr.float_channels.contains("bottom_range_m")) << file;
    const auto held = exr.float_channels.at("bottom_range_m").data();
    const auto traced = truth.facts.bottom_range_m.data();
    EXPECT_TRUE(std::equal(held.begin(), held.end(), traced.begin(), traced.end())) << file;
  }
}

TEST_F(Captured, IsRefusedWhereThereIsNone) {
  plan.conditions.bottom_range = false;
  render(folder / "dry");
  const auto open = capture::SequenceReader::open(folder / "dry");
  EXPECT_EQ(open.read_camera(0, 0, capture::SequenceReader::kFacts).bottom_range_m.num_pixels(),
            0u);
  test::expect_error(core::ErrorKind::Input, {"conditions.bottom_range = true"},
                     [&] { label(folder / "dry"); });
}

// In the water range_m is to the bed as it is.
TEST_F(Captured, OfCamerasUnderWaterIsTheRangeItself) {
  plan.states[0].world_from_body.translation.z() = kSurface_z - 10.0;
  test::expect_error(core::ErrorKind::Config, {"bottom_range is for cameras above the water"},
                     [&] { render(folder / "refused"); });
  plan.conditions.bottom_range = false;
  render(folder / "under");
  const auto facts = capture::SequenceReader::open(folder / "under")
                         .read_camera(0, 0, capture::SequenceReader::kFacts);
  const Lens lens = lenses()[0];
  const geo::Rigid3d world_from_camera =
      plan.states[0].world_from_body * plan.cameras[0].body_from_camera();
  int num_bed = 0;
  for (int y = 0; y < lens.intrinsics.height_px; ++y)
    for (int x = 0; x < lens.intrinsics.width_px; ++x) {
      const Vector3d ray = world_from_camera.rotation * lens.ray(x + 0.5, y + 0.5).normalized();
      const Vector3d& from = world_from_camera.translation;
      const double bed_m = range_to_plane(from, ray, Vector3d::UnitZ(), kSurface_z - 25.0);
      if (std::isinf(bed_m)) continue;
      ASSERT_NEAR(double{facts.range_m(x, y)}, bed_m, kFloat * bed_m);
      ASSERT_EQ(facts.semantic_id(x, y), static_cast<std::uint32_t>(SemanticClass::Seabed));
      ++num_bed;
    }
  EXPECT_GT(num_bed, 500);
}

}  // namespace
}  // namespace terracast::sensors
