// Flow, pairs and disparity of panoramas, whose left and right ends join: against both projections, written here again,
// and slabs.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <string>

#include "core/atomic_file.h"
#include "core/image_io.h"
#include "core/log.h"
#include "core/toml_reader.h"
#include "export/exporter.h"
#include "labels/label.h"
#include "tests/labels/boxes_world.h"
#include "tests/labels/moving_bodies.h"
#include "tests/support/expect_error.h"
#include "tests/support/npz_reader.h"
#include "tests/support/test_data.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using Eigen::Isometry3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using moving_bodies::kInfinity;
using moving_bodies::kRim_m;
using moving_bodies::slabs;

constexpr int kWidth = 160;
constexpr int kHeights[] = {80, 60};  // the whole sphere; a cylinder up to 50 degrees
constexpr double kPxPerRad = kWidth / (2.0 * std::numbers::pi);
const char* const kNames[] = {"sphere", "cylinder"};

/// On all sides; one reaches over the seam, one hides what is below.
const std::vector<WorldBox> kBoxes = {
    {.instance_id = 11, .low = {100, -5, 40}, .high = {110, 5, 60}},
    {.instance_id = 12, .low = {-60, -30, 0}, .high = {-40, 30, 65}},
    {.instance_id = 13, .low = {-10, 25, 30}, .high = {10, 35, 58}},
    {.instance_id = 14, .low = {20, -60, 0}, .high = {40, -30, 45}},
    {.instance_id = 15, .low = {-6, -6, 20}, .high = {6, 6, 30}},
};

struct ImageOf {
  int frame, camera;
};

Isometry3d world_from_body(int frame) {
  Isometry3d pose = Isometry3d::Identity();
  pose.translation() = Vector3d(3.0 * frame, 1.5 * frame, 50.0 + frame);
  pose.linear() = (Eigen::AngleAxisd(0.1 + 0.06 * frame, Vector3d::UnitZ()) *
                   Eigen::AngleAxisd(0.08, Vector3d::UnitY()))
                      .toRotationMatrix();
  return pose;
}
/// Cameras look along x, their x to the right and their y down; the second is beside the first and turned.
Isometry3d body_from_camera(int camera) {
  Isometry3d pose = Isometry3d::Identity();
  pose.linear() << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  if (camera == 0) return pose;
  pose.translation() = Vector3d(0.0, -3.0, 0.5);
  pose.linear() = Eigen::AngleAxisd(0.4, Vector3d::UnitZ()).toRotationMatrix() * pose.linear();
  return pose;
}
Isometry3d world_from_camera(const ImageOf& image) {
  return world_from_body(image.frame) * body_from_camera(image.camera);
}

// An angle to the right, and one down or, on the cylinder, its tangent.
Vector2d pixel_of(int camera, const Vector3d& at) {
  const double level = std::hypot(at.x(), at.z());
  const double down = camera == 0 ? std::atan2(at.y(), level) : at.y() / level;
  return {0.5 * kWidth + kPxPerRad * std::atan2(at.x(), at.z()),
          0.5 * kHeights[camera] + kPxPerRad * down};
}
Vector3d ray_of(int camera, double u_px, double v_px) {
  const double right = (u_px - 0.5 * kWidth) / kPxPerRad;
  const double down = (v_px - 0.5 * kHeights[camera]) / kPxPerRad;
  if (camera == 1) return {std::sin(right), down, std::cos(right)};
  return {std::sin(right) * std::cos(down), std::sin(down), std::cos(right) * std::cos(down)};
}

struct Hit {
  double t = kInfinity;
  std::uint32_t instance_id = 0;
};
Hit meet(const Vector3d& origin, const Vector3d& direction, double grown = 0.0) {
  Hit hit;
  if (direction.z() < 0.0) hit.t = -origin.z() / direction.z();
  const Vector3d more = Vector3d::Constant(grown);
  for (const WorldBox& box : kBoxes) {
    const double t = slabs(box.low - more, box.high + more, origin, direction);
    if (t < hit.t) hit = {t, box.instance_id};
  }
  return hit;
}

/// What a pixel shows: a point, or the direction of the sky. Nothing: the rim of a box, or the end of the world.
struct Shown {
  bool is_sky = false;
  Vector3d point;
  Vector3d direction;
};
std::optional<Shown> shown_by(const ImageOf& image, int x, int y) {
  const Isometry3d pose = world_from_camera(image);
  const Vector3d eye = pose.translation();
  const Vector3d ray = pose.linear() * ray_of(image.camera, x + 0.5, y + 0.5).normalized();
  const Hit hit = meet(eye, ray);
  if (meet(eye, ray, kRim_m).instance_id != hit.instance_id ||
      meet(eye, ray, -kRim_m).instance_id != hit.instance_id)
    return std::nullopt;
  if (std::isinf(hit.t)) {
    if (ray.z() < 0.02) return std::nullopt;
    return Shown{true, Vector3d::Zero(), ray};
  }
  const Vector3d point = eye + hit.t * ray;
  if (point.head<2>().norm() > 900.0) return std::nullopt;
  return Shown{false, point, ray};
}

/// Where it appears in another image; nothing: so near to the seam or to a pole that roundings decide.
std::optional<Vector2d> place_in(const ImageOf& image, const Shown& shown) {
  const Isometry3d camera_from_world = world_from_camera(image).inverse();
  const Vector3d at = shown.is_sky ? Vector3d(camera_from_world.linear() * shown.direction)
                                   : Vector3d(camera_from_world * shown.point);
  if (std::hypot(at.x(), at.z()) < 0.01 * at.norm()) return std::nullopt;
  const Vector2d there = pixel_of(image.camera, at);
  if (std::min(there.x(), kWidth - there.x()) < 1e-5) return std::nullopt;
  return there;
}

/// Flow is a float. Ranges are floats, whose rounding turns the direction to a point by 1e-8 at most: up to a hundred
/// times as much about a pole; on the cylinder beyond its image by the square of the tangent.
Vector2d tolerance_px(int camera, const Vector2d& there, const Vector2d& flow) {
  constexpr double kHalfFloat = 6e-8, kTurn_rad = 1e-8, kMostAtPole = 100.0;
  const double tangent = (there.y() - 0.5 * kHeights[camera]) / kPxPerRad;
  const double grown = camera == 0 ? 1.0 : 1.0 + tangent * tangent;
  return kHalfFloat * flow.cwiseAbs() + kTurn_rad * kPxPerRad * Vector2d(kMostAtPole, grown) +
         Vector2d::Constant(1e-7);
}

struct Tally {
  int seen = 0, hidden = 0, outside = 0, sky = 0, over_seam = 0, unsure = 0;
};

/// Holds a file of labels against the scene.
/// sign   of flow 1, of disparity -1
Tally check_labels_of(const fs::path& file, const ImageOf& from, const ImageOf& to,
                      const std::string& channel, double sign) {
  const auto parts = core::decode_exr(core::read_file(file), file.string());
  const core::ExrImage& image = parts.at(0);
  const auto& flow_x = image.float_channels.at(channel + ".x");
  const auto& flow_y = image.float_channels.at(channel + ".y");
  const Vector3d eye = world_from_camera(to).translation();
  Tally tally;
  for (int y = 0; y < kHeights[from.camera]; ++y)
    for (int x = 0; x < kWidth; ++x) {
      if (testing::Test::HasFailure()) return tally;
      SCOPED_TRACE(testing::Message() << file << " at " << x << " " << y);
      const std::optional<Shown> shown = shown_by(from, x, y);
      const std::optional<Vector2d> there = shown ? place_in(to, *shown) : std::nullopt;
      if (!there) {
        ++tally.unsure;
        continue;
      }
      const Vector2d flow = *there - Vector2d(x + 0.5, y + 0.5);
      const Vector2d tolerance = tolerance_px(to.camera, *there, flow);
      EXPECT_NEAR(double{flow_x(x, y)}, sign * flow.x(), tolerance.x());
      EXPECT_NEAR(double{flow_y(x, y)}, sign * flow.y(), tolerance.y());
      if (std::abs(there->x() - x) > 0.75 * kWidth) ++tally.over_seam;
      const std::uint32_t sight = image.uint_channels.at("sight")(x, y);
      if (shown->is_sky) {
        EXPECT_EQ(sight, 0U);
        ++tally.sky;
        continue;
      }
      const double to_edge = std::min(there->y(), kHeights[to.camera] - there->y());
      if (std::abs(to_edge) < 1e-5) {
        ++tally.unsure;
        continue;
      }
      if (to_edge < 0.0) {
        EXPECT_EQ(sight, 3U);
        ++tally.outside;
        continue;
      }
      const auto hider = [&](double grown) {
        const Hit hit = meet(eye, shown->point - eye, grown);
        return hit.t < 1.0 - 1e-6 ? hit.instance_id : 0;
      };
      if (hider(kRim_m) != hider(-kRim_m)) {
        ++tally.unsure;
        continue;
      }
      EXPECT_EQ(sight, hider(0.0) != 0 ? 1U : 2U);
      EXPECT_EQ(image.uint_channels.at("occluder")(x, y), hider(0.0));
      ++(sight == 2 ? tally.seen : tally.hidden);
    }
  return tally;
}

struct Panoramas : testing::Test {
  static inline std::unique_ptr<ScratchFolder> folder;
  static inline std::optional<world::TileStore> store;
  static inline std::optional<capture::SequenceReader> sequence;

  static std::vector<capture::CameraCalibration> cameras() {
    std::vector<capture::CameraCalibration> all(2, level_plan().cameras[0]);
    for (int camera = 0; camera < 2; ++camera) {
      const Isometry3d pose = body_from_camera(camera);
      capture::CameraCalibration& one = all[static_cast<std::size_t>(camera)];
      one.name = kNames[camera];
      one.intrinsics = {.model = camera == 0 ? "equirectangular" : "cylindrical",
                        .width_px = kWidth,
                        .height_px = kHeights[camera],
                        .parameters = {kPxPerRad, kPxPerRad, 0.5 * kWidth, 0.5 * kHeights[camera]}};
      one.rig_from_camera = {Eigen::Quaterniond(pose.linear()), pose.translation()};
    }
    return all;
  }
  void SetUp() override {
    if (folder) return;
    folder = std::make_unique<ScratchFolder>();
    store = make_boxes_world(*folder / "world", kBoxes);
    render::SequencePlan plan = level_plan(2);
    plan.cameras = cameras();
    for (int frame = 0; frame < 2; ++frame) {
      const Isometry3d pose = world_from_body(frame);
      plan.states[static_cast<std::size_t>(frame)].world_from_body = {
          Eigen::Quaterniond(pose.linear()), pose.translation()};
    }
    sequence = render_plan(*store, plan, *folder / "boxes");
  }
  static void TearDownTestSuite() {
    sequence.reset();
    store.reset();
    folder.reset();
  }
  static fs::path labels(const std::string& kind) { return *folder / "boxes/labels" / kind; }
};

TEST_F(Panoramas, PairsAndFlowAreThoseOfTheirProjections) {
  make_labels_with(*sequence, *store,
                   "kind = \"pairs\"\ncameras = [\"mcs4/sphere mcs4/cylinder\", \"mcs4/cylinder "
                   "mcs4/sphere\", \"mcs4/cylinder mcs4/cylinder\"]\nframes_apart = [0, 1]\n");
  make_labels(*sequence, *store, "flow");
  const auto pair = [](const ImageOf& from, const ImageOf& to) {
    return check_labels_of(
        labels("pairs") / fmt::format("mcs4/{}/mcs4/{}/{:06}_{:06}.exr", kNames[from.camera],
                                      kNames[to.camera], from.frame, to.frame),
        from, to, "flow", 1.0);
  };
  const auto flow = [](const ImageOf& from, const ImageOf& to) {
    return check_labels_of(labels("flow") / fmt::format("mcs4/{}/{:06}_{:06}.exr",
                                                        kNames[from.camera], from.frame, to.frame),
                           from, to, "flow", 1.0);
  };
  for (const Tally& tally : {flow({0, 0}, {1, 0}), flow({1, 0}, {0, 0}), pair({0, 1}, {0, 0})}) {
    EXPECT_GT(tally.seen, 3000);
    EXPECT_GT(tally.hidden, 5);
    EXPECT_EQ(tally.outside, 0);  // the sphere shows everything
    EXPECT_GT(tally.sky, 1000);
    EXPECT_GT(tally.over_seam, 30);
    EXPECT_LT(tally.unsure, 500);  // most of them the horizon
  }
  for (const Tally& tally : {pair({0, 0}, {0, 1}), pair({0, 0}, {1, 1}), pair({0, 1}, {1, 1})}) {
    EXPECT_GT(tally.seen, 1500);
    EXPECT_GT(tally.hidden, 5);
    EXPECT_GT(tally.outside, 20);
    EXPECT_GT(tally.over_seam, 30);
    EXPECT_LT(tally.unsure, 500);
  }
}

TEST_F(Panoramas, ExportedFlowIsThatOfTheirProjections) {
  exporters::ExportOptions options;
  core::TomlDocument::parse("format = \"terracast\"\nmodalities = [\"flow\"]\n", "test.toml")
      .read(options);
  const core::Log log("export", core::LogLevel::Off);
  exporters::run_export_stage({capture::SequenceReader::open(*folder / "boxes")}, {options},
                              *folder / "out", {.log = log});
  for (int camera = 0; camera < 2; ++camera) {
    const fs::path file =
        *folder /
        fmt::format("out/terracast/boxes/mcs4/{}/flow_forward/000000.npy", kNames[camera]);
    const Array flow = parse_npy(core::read_text_file(file));
    int num_sure = 0, num_over_seam = 0;
    for (int y = 0; y < kHeights[camera]; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const std::optional<Shown> shown = shown_by({0, camera}, x, y);
        const std::optional<Vector2d> there = shown ? place_in({1, camera}, *shown) : std::nullopt;
        if (!there) continue;
        ++num_sure;
        num_over_seam += std::abs(there->x() - x) > 0.75 * kWidth ? 1 : 0;
        const Vector2d own = *there - Vector2d(x + 0.5, y + 0.5);
        const Vector2d tolerance = tolerance_px(camera, *there, own);
        ASSERT_NEAR(flow.at({y, x, 0}), own.x(), tolerance.x()) << x << " " << y;
        ASSERT_NEAR(flow.at({y, x, 1}), own.y(), tolerance.y()) << x << " " << y;
      }
    EXPECT_GT(num_sure, kWidth * kHeights[camera] - 500);
    EXPECT_GT(num_over_seam, 30);
  }
}

TEST_F(Panoramas, DisparityIsOfPairsThatAreNamedAlone) {
  const core::Log log("label", core::LogLevel::Off);
  const auto check = [&](const std::string& keys,
                         const std::vector<capture::CameraCalibration>& of) {
    std::vector<labels::LabelOptions> options(1);
    core::TomlDocument::parse("kind = \"disparity\"\n" + keys, "job.toml").read(options[0]);
    const std::vector<labels::SequenceOutline> job = {
        {.name = "boxes", .cameras = of, .num_frames = 2}};
    labels::check_labels(options, job, log);
  };
  // Beside each other and turned alike, they have no rows in which f b / depth would hold.
  std::vector<capture::CameraCalibration> alike = {cameras()[0], cameras()[0]};
  alike[1].name = "beside";
  alike[1].rig_from_camera.translation = {0.0, -3.0, 0.0};
  for (const auto& of : {cameras(), alike})
    expect_error(core::ErrorKind::Config, {"rectified", "pinholes", "cameras = ["},
                 [&] { check("", of); });
  const std::string named = "cameras = [\"mcs4/sphere mcs4/cylinder\"]\n";
  check(named, cameras());

  make_labels_with(*sequence, *store, "kind = \"disparity\"\n" + named);
  for (int frame = 0; frame < 2; ++frame) {
    const Tally tally = check_labels_of(
        labels("disparity") / fmt::format("mcs4/sphere/mcs4/cylinder/{:06}.exr", frame), {frame, 0},
        {frame, 1}, "disparity", -1.0);
    EXPECT_GT(tally.seen, 1500);
    EXPECT_GT(tally.hidden, 5);
    EXPECT_GT(tally.outside, 20);
    EXPECT_GT(tally.over_seam, 30);
  }
}

}  // namespace
}  // namespace terracast::test
