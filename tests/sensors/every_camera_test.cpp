// The law of ground truth, for every model in the registry: with lines at once and one after the other, of what stands
// and of what moves, facts, flow and visibility are those of the model's publication and of brute force over all
// triangles of a small scene in 113-bit arithmetic.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <optional>

#include "capture/channel.h"
#include "capture/labels.h"
#include "core/instance_id.h"
#include "sensors/camera/sight.h"
#include "sensors/moving_record.h"
#include "tests/sensors/moving_boxes.h"
#include "tests/sensors/plane_flight.h"
#include "tests/sensors/published_cameras.h"
#include "tests/support/expect_error.h"
#include "tests/support/hills_flight.h"

namespace terracast::sensors {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using test::BoxPose;
using test::Flight;
using test::kPlane_z;
using test::Pose;
using test::PublishedCamera;
using test::PublishedRay;

constexpr double kLine_s = 4e-4;
constexpr double kBaseline_m = 1.5;

/// 113 bits.
__extension__ typedef __float128 Real;
using Vector = std::array<Real, 3>;

Vector real(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }
Vector operator-(const Vector& a, const Vector& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
Real dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// A plane and the triangles of both boxes, at a frame.
class BruteScene {
 public:
  static constexpr int kNothing = -2, kPlane = -1;
  struct Hit {
    double t = std::numeric_limits<double>::infinity();
    int what = kNothing;
  };

  explicit BruteScene(std::vector<std::optional<geo::BodyState>> states)
      : states_(std::move(states)) {}

  const geo::BodyState& state(int body) const { return *states_[static_cast<std::size_t>(body)]; }

  /// The first crossing of a ray, at a time.
  Hit meet(double time_s, const Vector3d& origin, const Vector3d& direction) const {
    Hit hit;
    if (direction.z() != 0.0) {
      const auto t = static_cast<double>((Real(kPlane_z) - origin.z()) / direction.z());
      if (t > 0.0) hit = {t, kPlane};
    }
    for (int body = 0; body < 2; ++body) {
      const BoxPose pose(state(body), time_s);
      const Vector3d half_m = body == 0 ? test::kHalf_m : test::kPartHalf_m;
      // What passes far by needs no triangles.
      const Vector3d to_middle = pose.place_world - origin;
      if (to_middle.cross(direction.normalized()).norm() > half_m.norm() + 1.0) continue;
      meet_box(pose, half_m, origin, direction, body, hit);
    }
    return hit;
  }

  static int num_undecided;

 private:
  static void meet_box(const BoxPose& pose, const Vector3d& half_m, const Vector3d& origin,
                       const Vector3d& direction, int body, Hit& hit) {
    // In the box's frame, where its corners are exact.
    const auto turned = [&](const Vector& v) -> Vector {
      Vector result;
      for (int k = 0; k < 3; ++k)
        result[static_cast<std::size_t>(k)] = dot(real(pose.world_from_box.col(k)), v);
      return result;
    };
    const Vector from = turned(real(origin) - real(pose.place_world));
    const Vector along = turned(real(direction));
    for (int axis = 0; axis < 3; ++axis)
      for (const double side : {-1.0, 1.0})
        for (const bool is_upper : {false, true}) {
          const int u = (axis + 1) % 3, v = (axis + 2) % 3;
          const auto corner = [&](double a, double b) {
            Vector3d place;
            place[axis] = side * half_m[axis];
            place[u] = a * half_m[u];
            place[v] = b * half_m[v];
            return real(place);
          };
          const std::array<Vector, 3> triangle = {corner(-1, 1), corner(1, -1),
                                                  is_upper ? corner(1, 1) : corner(-1, -1)};
          const std::optional<Real> t = cross_triangle(from, along, triangle);
          if (t && *t > 0 && static_cast<double>(*t) < hit.t) hit = {static_cast<double>(*t), body};
        }
  }

  /// Signs of volumes decide, and none may be so small that 113 bits do not tell it from 0.
  static std::optional<Real> cross_triangle(const Vector& origin, const Vector& direction,
                                            const std::array<Vector, 3>& triangle) {
    std::array<bool, 3> is_left{};
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector a = triangle[k] - origin, b = triangle[(k + 1) % 3] - origin;
      const Real volume = dot(direction, cross(a, b));
      constexpr double kTold = 1e-20;
      if (std::abs(static_cast<double>(volume)) < kTold) ++num_undecided;
      is_left[k] = volume > 0;
    }
    if (is_left[0] != is_left[1] || is_left[1] != is_left[2]) return std::nullopt;
    const Vector normal = cross(triangle[1] - triangle[0], triangle[2] - triangle[0]);
    return dot(triangle[0] - origin, normal) / dot(direction, normal);
  }

  std::vector<std::optional<geo::BodyState>> states_;
};
int BruteScene::num_undecided = 0;

struct ModelCase {
  std::string model;
  geo::Shutter shutter;
};

/// With lines at once, and one after the other: another way in each model, but in panoramas, across whose seam a point
/// that columns follow may jump, by rows.
std::vector<ModelCase> every_model() {
  std::vector<ModelCase> cases;
  int way = 0;
  for (const geo::CameraModelInfo& info : geo::camera_models()) {
    const auto readout = static_cast<geo::Readout>(info.whole_view != nullptr ? way % 2 : way % 4);
    ++way;
    cases.push_back({std::string(info.name), {}});
    cases.push_back({std::string(info.name), {.line_time_s = kLine_s, .readout = readout}});
  }
  return cases;
}

/// A pair of cameras of a model over the plane, and all that tells once more what they see.
class EveryCamera : public testing::TestWithParam<ModelCase> {
 protected:
  void SetUp() override {
    published_ = PublishedCamera::find(GetParam().model);
    ASSERT_NE(published_, nullptr)
        << "the registry has the model " << GetParam().model
        << ", and tests/sensors/published_cameras.cpp has no formula of its publication";
    shutter_ = GetParam().shutter;
    plan_ = test::small_plan(2, 40, 32);
    test::set_moving(plan_.states);
    plan_.cameras.resize(2);
    for (capture::CameraCalibration& camera : plan_.cameras) {
      camera.intrinsics = published_->intrinsics();
      camera.shutter = shutter_;
      camera.rig_from_camera = plan_.cameras[0].rig_from_camera;
    }
    // Along the image's rows.
    plan_.cameras[1].rig_from_camera.translation +=
        plan_.cameras[1].rig_from_camera.rotation * Vector3d(kBaseline_m, 0.0, 0.0);
    model_ = geo::make_camera(published_->intrinsics());
    const PublishedRay axis = *published_->ray(middle());
    const Pose first = pose(0, 0, 0.0);
    plan_.moving = {test::turning_box(
        plan_, first.center_world +
                   first.world_from_camera *
                       (axis.origin_camera + published_->near_m() * axis.direction_camera))};
    for (int y = 0; y < height(); ++y)
      for (int x = 0; x < width(); ++x) rays_.push_back(published_->ray({x + 0.5, y + 0.5}));
    BruteScene::num_undecided = 0;
  }

  Vector2d middle() const { return {0.5 * width(), 0.5 * height()}; }
  int width() const { return published_->intrinsics().width_px; }
  int height() const { return published_->intrinsics().height_px; }

  Pose pose(int frame, int camera, double time_s) const {
    return {plan_.states[static_cast<std::size_t>(frame)],
            plan_.cameras[static_cast<std::size_t>(camera)].body_from_camera(), time_s};
  }

  double time_of(const Vector2d& pixel) const { return test::time_of(shutter_, *model_, pixel); }

  struct Sight {
    Vector2d pixel;
    double time_s;
    Vector3d origin_world;
  };
  /// Where, when and from where a point that may move is seen, by false position in the time.
  /// project_at   its image point in a camera at a time
  template <class ProjectAt>
  std::optional<Sight> sight(int frame, int camera, const ProjectAt& project_at) const {
    double low = -0.05, high = 0.05;
    if (shutter_.is_rolling()) {
      const auto miss = [&](double t) -> std::optional<double> {
        const std::optional<Vector2d> pixel = project_at(pose(frame, camera, t), t);
        if (!pixel) return std::nullopt;
        return time_of(*pixel) - t;
      };
      auto first = miss(low), last = miss(high);
      if (!first || !last || *first < 0.0 || *last > 0.0) return std::nullopt;
      // The line through both ends, of which the one that stays counts less and less.
      int side = 0;
      for (int i = 0; i < 60 && *first > 1e-15 && *last < -1e-15; ++i) {
        const double between = (low * *last - high * *first) / (*last - *first);
        const auto there = miss(between);
        if (!there) return std::nullopt;
        (*there > 0.0 ? low : high) = between;
        (*there > 0.0 ? first : last) = *there;
        const int moved = *there > 0.0 ? 1 : -1;
        if (moved == side) (moved == 1 ? last : first) = 0.5 * *(moved == 1 ? last : first);
        side = moved;
      }
      if (*first > -*last) low = high;
    } else {
      low = 0.0;
    }
    const Pose then = pose(frame, camera, low);
    const std::optional<Vector2d> pixel = project_at(then, low);
    if (!pixel) return std::nullopt;
    Sight seen{*pixel, low, then.center_world};
    if (!published_->is_central())
      seen.origin_world += then.world_from_camera * published_->ray(*pixel)->origin_camera;
    return seen;
  }
  template <class PointAt>
  std::optional<Sight> sight_of_point(int frame, int camera,
                                              const PointAt& point_at) const {
    return sight(frame, camera, [&](const Pose& at, double t) {
      return published_->project(at.world_from_camera.transpose() *
                                 (point_at(t) - at.center_world));
    });
  }

  bool is_near_border(const Vector2d& pixel) const {
    return std::min({std::abs(pixel.x()), std::abs(pixel.y()), std::abs(pixel.x() - width()),
                     std::abs(pixel.y() - height())}) < 1e-6;
  }
  bool is_in_image(const Vector2d& pixel) const {
    return pixel.x() >= 0.0 && pixel.y() >= 0.0 && pixel.x() < width() && pixel.y() < height();
  }

  /// The disparity of a pair is what flow there is between its cameras at one time.
  void expect_disparity_as_flow() const {
    const capture::CameraView left = capture::view_of(*model_, plan_.cameras[0], plan_.states[0]);
    const capture::CameraView right = capture::view_of(*model_, plan_.cameras[1], plan_.states[0]);
    const std::vector<double>& p = published_->intrinsics().parameters;
    int num_compared = 0;
    for (int y = 0; y < height(); ++y)
      for (int x = 0; x < width(); ++x)
        for (const double range_m : {9.0, 250.0}) {
          const Vector2d pixel(x + 0.5, y + 0.5);
          const std::optional<PublishedRay>& ray = rays_[static_cast<std::size_t>(y * width() + x)];
          if (!ray) continue;
          const Vector3d point = ray->origin_camera + range_m * ray->direction_camera;
          const std::optional<Vector2d> there =
              published_->project(point - Vector3d(kBaseline_m, 0.0, 0.0));
          if (!there) continue;
          const auto flow = capture::flow(left, right, pixel, range_m);
          ASSERT_TRUE(flow) << pixel.transpose();
          EXPECT_LT((pixel + *flow - *there).norm(), 1e-6) << pixel.transpose();
          ++num_compared;
          // In closed form, where rows of the two are the same lines.
          const std::string& model = GetParam().model;
          const bool keeps_rows =
              model == "pinhole" || model == "pushbroom" || model == "orthographic";
          if (keeps_rows) {
            const double depth_m = model == "orthographic" ? 1.0 : point.z();
            EXPECT_NEAR(-flow->x(), p[0] * kBaseline_m / depth_m, 1e-9);
            EXPECT_NEAR(flow->y(), 0.0, 1e-9);
          }
          if (model != "pinhole") continue;
          core::ImageF range(width(), height());
          range(x, y) = static_cast<float>(range_m);
          EXPECT_NEAR(
              static_cast<double>(capture::disparity_image(*model_, kBaseline_m, range)(x, y)),
              -flow->x(), 1e-5);
        }
    EXPECT_GT(num_compared, 500);
  }

  const PublishedCamera* published_ = nullptr;
  std::vector<std::optional<PublishedRay>> rays_;  ///< of the pixels' centres
  geo::Shutter shutter_;
  render::SequencePlan plan_;
  std::unique_ptr<geo::CameraModel> model_;
};

/// A level plane as far as 2048 m to each side.
const world::TileStore& plane_store() {
  static const test::ScratchFolder folder;
  static const world::TileStore store =
      test::make_tiny_world(folder / "world", [](double, double) { return kPlane_z; },
                            {.finest_level = 3, .coarsest_level = 3});
  return store;
}

TEST_P(EveryCamera, HasTheFactsFlowAndVisibilityOfItsPublication) {
  if (GetParam().model == "pushbroom" && shutter_.is_rolling()) {
    rigs::RigOptions rig;
    rig.name = "rig";
    rig.cameras = {test::camera_options("scanner", 32, 24, 28.0)};
    rig.cameras[0].model = "pushbroom";
    rig.cameras[0].fy_px = 0.8;
    EXPECT_EQ(rigs::build_cameras({rig}).size(), 1U);
    rig.cameras[0].line_time_us = 1e6 * kLine_s;
    test::expect_error(core::ErrorKind::Config, {"scanner", "line_time_us", "fy_px"},
                       [&] { rigs::build_cameras({rig}); });
    return;
  }
  // Within what 1e-4 px are promised before storage, by much.
  constexpr double kFlow_px = 1e-6;
  const test::TracedPlan scene(plane_store(), plan_);
  const auto bodies = sensors::describe_moving(plan_.moving);
  ASSERT_EQ(bodies.size(), 2U);
  struct To {
    int frame, camera;
    std::uint32_t flag;
  };
  std::array<int, 2> num_met{};
  int num_sky = 0, num_followed = 0, num_moving = 0, num_seen = 0, num_hidden = 0, num_shaded = 0;
  int num_rolled = 0, num_stereo = 0;
  for (const int frame : {0, 1}) {
    const BruteScene here(scene.renderer.moving().states(frame));
    const TruthFrame truth = scene.renderer.truth(frame, 0);
    for (const To& to :
         {To{1 - frame, 0, frame == 0 ? capture::kVisibleNext : capture::kVisiblePrevious},
          To{frame, 1, capture::visible_in_camera(1)}}) {
      const BruteScene there(scene.renderer.moving().states(to.frame));
      const auto states = [&](int at) { return scene.renderer.moving().states(at); };
      const capture::BodyMotions motions(bodies, states(frame), states(to.frame));
      const capture::CameraView from_view = capture::view_of(
          *model_, plan_.cameras[0], plan_.states[static_cast<std::size_t>(frame)]);
      const capture::CameraView to_view =
          capture::view_of(*model_, plan_.cameras[static_cast<std::size_t>(to.camera)],
                           plan_.states[static_cast<std::size_t>(to.frame)]);
      const core::ImageF stored = capture::flow_image(from_view, to_view, motions, truth.facts);
      for (int y = 0; y < height(); ++y)
        for (int x = 0; x < width(); ++x) {
          const Vector2d pixel(x + 0.5, y + 0.5);
          SCOPED_TRACE(fmt::format("pixel {} {} of frame {} to frame {} camera {}", x, y, frame,
                                   to.frame, to.camera));
          const auto index = static_cast<std::size_t>(y * width() + x);
          const std::optional<PublishedRay>& ray = rays_[index];
          if (!ray) {
            EXPECT_TRUE(std::isnan(truth.range_m[index])) << "no ray comes in";
            continue;
          }
          const double time_s = time_of(pixel);
          const Pose pose = this->pose(frame, 0, time_s);
          const Vector3d origin = pose.center_world + pose.world_from_camera * ray->origin_camera;
          const Vector3d direction = pose.world_from_camera * ray->direction_camera;
          const BruteScene::Hit hit = here.meet(time_s, origin, direction);
          const Vector3d point = origin + hit.t * direction;

          if (hit.what == BruteScene::kNothing) {
            // Beyond the plane the world's tiles end, so that a ray just below the horizon may meet nothing.
            ASSERT_TRUE(std::isinf(truth.range_m[index]));
            ++num_sky;
            const auto flow = capture::flow(from_view, to_view, pixel, truth.range_m[index]);
            if (!published_->is_central()) {
              EXPECT_FALSE(flow) << "what is infinitely far has no one image";
              continue;
            }
            const auto seen = sight(to.frame, to.camera, [&](const Pose& at, double) {
              return published_->project(at.world_from_camera.transpose() * direction);
            });
            if (seen) {
              ASSERT_TRUE(flow);
              EXPECT_LT((pixel + *flow - seen->pixel).norm(), kFlow_px);
            }
            EXPECT_EQ(truth.facts.flags(x, y) & to.flag, 0U) << "sky is never co-visible";
            continue;
          }
          if (point.head<2>().cwiseAbs().maxCoeff() > 1900.0) continue;
          const bool is_moving = hit.what >= 0;
          ASSERT_NEAR(truth.range_m[index], hit.t, 1e-8 * hit.t);
          ASSERT_LT((truth.point_world[index] - point).norm(), 1e-8 * hit.t);
          // Depth is along the axis, from where the ray starts.
          EXPECT_NEAR(capture::depth_from_range(*model_, pixel, hit.t),
                      hit.t * ray->direction_camera.z(), 1e-9 * hit.t);
          ASSERT_EQ(truth.facts.instance_id(x, y), is_moving ? core::kFirstMovingId : 0U);
          if (is_moving) {
            ++num_met[static_cast<std::size_t>(hit.what)];
            EXPECT_EQ((truth.facts.primitive_id(x, y) - capture::kObjectPrimitives) / 12,
                      static_cast<std::uint32_t>(hit.what));
          }
          // Where the same point is in the other image.
          const int body = std::max(hit.what, 0);
          const Vector3d on_box = BoxPose(here.state(body), time_s).box_from_world(point);
          const auto point_at = [&](double t) -> Vector3d {
            return is_moving ? BoxPose(there.state(body), t).world_from(on_box) : point;
          };
          const auto seen = sight_of_point(to.frame, to.camera, point_at);
          const capture::BodyMotion* motion =
              motions.find(truth.facts.instance_id(x, y), truth.facts.primitive_id(x, y));
          ASSERT_EQ(motion != nullptr, is_moving);
          const auto flow = is_moving ? capture::flow(from_view, to_view, *motion, pixel, hit.t)
                                      : capture::flow(from_view, to_view, pixel, hit.t);
          if (!seen) {
            EXPECT_FALSE(flow && is_in_image(pixel + *flow)) << "the publication has it nowhere";
            continue;
          }
          ASSERT_TRUE(flow);
          EXPECT_LT((pixel + *flow - seen->pixel).norm(), kFlow_px);
          ++num_followed;
          num_moving += is_moving ? 1 : 0;
          num_stereo += to.camera == 1 ? 1 : 0;
          const auto at_once =
              shutter_.is_rolling()
                  ? published_->project(
                        this->pose(to.frame, to.camera, 0.0).world_from_camera.transpose() *
                        (point_at(0.0) - this->pose(to.frame, to.camera, 0.0).center_world))
                  : std::nullopt;
          num_rolled += at_once && (*at_once - seen->pixel).norm() > 0.01 ? 1 : 0;
          // Stored ranges are float32, and so are what flow is made of in images.
          EXPECT_NEAR(static_cast<double>(stored(x, y, 0)), flow->x(), 1e-3);
          EXPECT_NEAR(static_cast<double>(stored(x, y, 1)), flow->y(), 1e-3);

          // Seen there: in the image, and the first thing that a ray from there meets.
          if (is_near_border(seen->pixel)) continue;
          const Vector3d to_point = point_at(seen->time_s) - seen->origin_world;
          const BruteScene::Hit first = there.meet(seen->time_s, seen->origin_world, to_point);
          const bool is_first = first.t > 1.0 - kSamePointRelative;
          const bool is_seen = is_in_image(seen->pixel) && is_first;
          ASSERT_EQ((truth.facts.flags(x, y) & to.flag) != 0, is_seen);
          num_seen += is_seen ? 1 : 0;
          num_hidden += is_in_image(seen->pixel) && !is_seen ? 1 : 0;
          num_shaded += !is_moving && is_in_image(seen->pixel) && !is_seen ? 1 : 0;
          if (!is_seen) continue;
          // And back again, from where it is seen.
          std::optional<Vector2d> back;
          if (is_moving) {
            const capture::BodyMotion backward{.from = *motion->to, .to = motion->from};
            back = capture::flow(to_view, from_view, backward, seen->pixel, to_point.norm());
          } else {
            back = capture::flow(to_view, from_view, seen->pixel, to_point.norm());
          }
          ASSERT_TRUE(back);
          EXPECT_LT((*flow + *back).norm(), kFlow_px);
        }
    }
  }
  if (!shutter_.is_rolling()) expect_disparity_as_flow();
  EXPECT_EQ(BruteScene::num_undecided, 0);
  EXPECT_GT(num_met[0], 20);
  EXPECT_GT(num_met[1], 3);
  EXPECT_GT(num_followed, 300);
  EXPECT_GT(num_moving, 40);
  EXPECT_GT(num_stereo, 100);
  EXPECT_GT(num_seen, 200);
  EXPECT_GT(num_hidden, 0);
  EXPECT_GT(num_shaded, 0) << "of the plane, by what moves";
  if (shutter_.is_rolling()) {
    EXPECT_GT(num_rolled, 100) << "a global shutter's flow is the same";
  }
}

INSTANTIATE_TEST_SUITE_P(Models, EveryCamera, testing::ValuesIn(every_model()),
                         [](const auto& example) {
                           return example.param.model +
                                  (example.param.shutter.is_rolling() ? "_rolling" : "_global");
                         });

}  // namespace
}  // namespace terracast::sensors
