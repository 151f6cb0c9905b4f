#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "core/atomic_file.h"
#include "core/image_io.h"
#include "geo/frames.h"
#include "tests/labels/boxes_world.h"
#include "tests/support/motion_terms.h"
#include "tests/support/test_data.h"

/// A plane, boxes and four kinds of cameras (global and rolling shutters, a fisheye, parallel rays), all of which are known
/// here by closed forms.
namespace terracast::test::named_scene {

namespace fs = std::filesystem;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
inline constexpr int kWidth = 100, kHeight = 80;
inline constexpr int kWideSize = 120;
inline constexpr double kFisheyeFocal_px = 18.0;
inline constexpr double kLineTime_s = 5e-4;

/// The last is as the wall of a class that is stuff.
inline const std::vector<WorldBox> kBoxes = {
    {.instance_id = 11,
     .semantic_class = core::SemanticClass::Truck,
     .low = {100, -5, 40},
     .high = {110, 5, 60}},
    {.instance_id = 12, .low = {180, -60, 0}, .high = {200, -10, 70}},
    {.instance_id = 13,
     .semantic_class = core::SemanticClass::Building,
     .low = {-80, -30, 0},
     .high = {-60, 30, 65}},
    {.instance_id = 14,
     .semantic_class = core::SemanticClass::River,
     .low = {60, 20, 45},
     .high = {62, 30, 55}},
};
inline const WorldThing kThing{
    .instance_id = 70, .place = {50.0, -14.0, 44.0}, .heading_rad = 0.3, .scale = 3.0};

inline capture::CameraCalibration camera_of(const std::string& name, const std::string& model,
                                            int width, int height, std::vector<double> parameters) {
  return {.rig = "mcs4",
          .name = name,
          .intrinsics = {.model = model,
                         .width_px = width,
                         .height_px = height,
                         .parameters = std::move(parameters)},
          .rig_from_camera = {Eigen::Quaterniond(geo::rig_from_rdf()), Vector3d::Zero()},
          .body_from_rig = {}};
}

/// Two frames of a body that flies and turns; of the cameras two are a pair, one a pair with a rolling one.
inline render::SequencePlan plan_of_all() {
  render::SequencePlan plan = level_plan(2);
  for (std::size_t i = 0; i < plan.states.size(); ++i) {
    geo::BodyState& state = plan.states[i];
    state.world_from_body = {
        Eigen::Quaterniond(Eigen::AngleAxisd(0.1 + 0.05 * double(i), Vector3d::UnitZ()) *
                           Eigen::AngleAxisd(0.08, Vector3d::UnitY())),
        Vector3d(3.0 * double(i), 0.5, 50.0)};
    state.velocity_world_mps = {30.0, 4.0, -3.0};
    state.acceleration_world_mps2 = {0.0, 5.0, 1.0};
    state.angular_velocity_body_radps = {0.3, -0.2, 0.5};
    state.terms = lively_terms();
  }
  const std::vector<double> pinhole = {100.0, 100.0, 50.0, 40.0};
  plan.cameras = {
      camera_of("left", "pinhole", kWidth, kHeight, pinhole),
      camera_of("right", "pinhole", kWidth, kHeight, pinhole),
      camera_of("rolling", "pinhole", kWidth, kHeight, pinhole),
      camera_of("beside", "pinhole", kWidth, kHeight, pinhole),
      camera_of("fisheye", "opencv_fisheye", kWideSize, kWideSize,
                {kFisheyeFocal_px, kFisheyeFocal_px, 60.0, 60.0, 0, 0, 0, 0}),
      camera_of("map", "orthographic", kWidth, kHeight, {2.0, 2.0, 50.0, 40.0}),
  };
  plan.cameras[1].rig_from_camera.translation = {0.0, -2.0, 0.0};  // to the right
  plan.cameras[3].rig_from_camera.translation = {0.0, -1.0, 0.0};
  for (const std::size_t rolling : {2U, 3U})
    plan.cameras[rolling].shutter = {.line_time_s = kLineTime_s};
  return plan;
}

/// What a camera of the plan sees, from the definitions.
struct Truth {
  const capture::SequenceReader& sequence;
  int frame = 0;
  int camera = 0;

  const capture::CameraCalibration& calibration() const {
    return sequence.info().cameras[static_cast<std::size_t>(camera)];
  }
  bool is_rolling() const { return calibration().shutter.line_time_s > 0.0; }

  /// The camera when the line through a row is exposed.
  Eigen::Isometry3d pose(double row) const {
    const capture::FrameRecord& record = sequence.frames()[static_cast<std::size_t>(frame)];
    const double t = is_rolling() ? kLineTime_s * (row - 0.5 * kHeight) : 0.0;
    Eigen::Isometry3d body = Eigen::Isometry3d::Identity();
    const BodyThen then(record.state(), t);
    body.linear() = then.rotation;
    body.translation() = then.place;
    Eigen::Isometry3d camera_on_body = Eigen::Isometry3d::Identity();
    camera_on_body.linear() = geo::rig_from_rdf();
    camera_on_body.translation() = calibration().rig_from_camera.translation;
    return body * camera_on_body;
  }

  struct Ray {
    Vector3d origin, direction;  ///< of length 1; NaN: none comes in
  };
  Ray ray_camera(double u, double v) const {
    const Vector2d at = camera == 4 ? Vector2d(u - 60.0, v - 60.0) : Vector2d(u - 50.0, v - 40.0);
    if (camera == 5) return {{at.x() / 2.0, at.y() / 2.0, 0.0}, Vector3d::UnitZ()};
    if (camera != 4)
      return {Vector3d::Zero(), Vector3d(at.x() / 100.0, at.y() / 100.0, 1.0).normalized()};
    const double angle = at.norm() / kFisheyeFocal_px;  // r = f t
    if (angle > std::numbers::pi) return {Vector3d::Zero(), Vector3d::Constant(std::nan(""))};
    const Vector2d side = at.normalized() * std::sin(angle);
    return {Vector3d::Zero(), {side.x(), side.y(), std::cos(angle)}};
  }

  struct Hit {
    double range_m = kInfinity;
    std::uint32_t instance_id = 0;
    Vector3d normal_world = Vector3d::UnitZ();
    bool operator==(const Hit&) const = default;
  };
  /// Of boxes larger by so much on all sides.
  static Hit meet(const Ray& ray, double grown = 0.0) {
    Hit hit;
    if (ray.direction.z() < 0.0) hit.range_m = -ray.origin.z() / ray.direction.z();
    for (const WorldBox& box : kBoxes) {
      double in = -kInfinity, out = kInfinity;
      Vector3d normal = Vector3d::Zero();
      for (int axis = 0; axis < 3; ++axis) {
        const double a = (box.low[axis] - grown - ray.origin[axis]) / ray.direction[axis];
        const double b = (box.high[axis] + grown - ray.origin[axis]) / ray.direction[axis];
        if (std::min(a, b) > in) {
          in = std::min(a, b);
          normal = Vector3d::Zero();
          normal[axis] = ray.direction[axis] > 0.0 ? -1.0 : 1.0;
        }
        out = std::min(out, std::max(a, b));
      }
      if (in <= out && in > 0.0 && in < hit.range_m) hit = {in, box.instance_id, normal};
    }
    return hit;
  }
  static Ray moved(const Eigen::Isometry3d& pose, const Ray& ray) {
    return {pose * ray.origin, pose.linear() * ray.direction};
  }
};

inline core::ExrImage read_exr(const fs::path& file) {
  auto parts = core::decode_exr(core::read_file(file), file.string());
  EXPECT_EQ(parts.size(), 1U);
  return parts.at(0);
}

/// What the facts of the capture's own file hold.
inline core::ExrImage read_facts(const capture::SequenceReader& sequence, int frame, int camera) {
  return read_exr(sequence.folder() / sequence.frames()[static_cast<std::size_t>(frame)]
                                          .cameras[static_cast<std::size_t>(camera)]
                                          .facts.path);
}

/// Everything is rendered once.
struct NamedLabels : testing::Test {
  static inline std::unique_ptr<ScratchFolder> folder;
  static inline std::optional<world::TileStore> store;
  static inline std::optional<capture::SequenceReader> sequence;

  void SetUp() override {
    if (folder) return;
    folder = std::make_unique<ScratchFolder>();
    store = make_boxes_world(*folder / "world", kBoxes, {kThing});
    sequence = render_plan(*store, plan_of_all(), *folder / "boxes");
  }
  static void TearDownTestSuite() {
    sequence.reset();
    store.reset();
    folder.reset();
  }

  static fs::path labels(const std::string& kind) { return *folder / "boxes/labels" / kind; }
  static std::string image_name(int frame, int camera, const std::string& extension) {
    return fmt::format("mcs4/{}/{:06}{}",
                       sequence->info().cameras[static_cast<std::size_t>(camera)].name, frame,
                       extension);
  }
  static int num_cameras() { return static_cast<int>(sequence->info().cameras.size()); }

  /// Calls visit(frame, camera, truth) for every image.
  template <class Visit>
  static void for_each_image(const Visit& visit) {
    for (int frame = 0; frame < 2; ++frame)
      for (int camera = 0; camera < num_cameras(); ++camera) {
        SCOPED_TRACE(testing::Message() << "frame " << frame << ", camera " << camera);
        visit(frame, camera, Truth{*sequence, frame, camera});
      }
  }
};

/// What the scene says of a pixel; nothing: it is at the rim of something, on the thing, or at the world's end.
inline std::optional<Truth::Hit> sure_hit(const Truth& truth, const core::ExrImage& facts, int x,
                                          int y) {
  if (facts.uint_channels.at("instance_id")(x, y) == kThing.instance_id) return std::nullopt;
  const Truth::Ray ray = Truth::moved(truth.pose(y + 0.5), truth.ray_camera(x + 0.5, y + 0.5));
  const Truth::Hit hit = Truth::meet(ray);
  constexpr double kRim_m = 1e-6;
  for (const double grown : {kRim_m, -kRim_m}) {
    const Truth::Hit other = Truth::meet(ray, grown);
    if (other.instance_id != hit.instance_id || other.normal_world != hit.normal_world)
      return std::nullopt;
  }
  const bool is_far =
      std::isfinite(hit.range_m) &&
      (ray.origin + hit.range_m * ray.direction).head<2>().cwiseAbs().maxCoeff() > 1000.0;
  // At the horizon the world's end and its apron differ from a plane.
  if (is_far || (std::isinf(hit.range_m) && ray.direction.z() < 0.02)) return std::nullopt;
  return hit;
}

// The capture's ranges are floats: half a step is 6e-8 of them. What is derived is rounded once more.
inline constexpr double kFloat = 6e-8;

}  // namespace terracast::test::named_scene
