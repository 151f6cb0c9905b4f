#include "capture/line_bounds.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geo/rounding.h"

namespace terracast::capture {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using geo::kU;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

CameraView at_time(const CameraView& view, double offset_s) {
  return {.model = view.model, .world_from_camera = view.motion->world_from_camera(offset_s)};
}

/// A body as it stands so much later.
geo::BodyState at_time(geo::BodyState state, double offset_s) {
  state.world_from_body = state.pose_after(offset_s);
  return state;
}

/// What the pose of a body so much later makes wrong of one of its points.
double body_error_m(const geo::BodyState& state, double offset_s, const Vector3d& point_body) {
  const PoseError error =
      line_pose_error({.state = state, .body_from_camera = {}, .shutter = {}}, offset_s);
  return error.position_m + point_body.norm() * error.angle_rad;
}

/// What a view's camera sees where, and when.
struct Sight {
  double offset_s = 0.0;
  Vector2d pixel;
  Vector3d point_camera;
};

/// A world point (or a direction) in a camera, in the order of capture::flow: the centres' difference first.
Vector3d in_camera(const geo::Rigid3d& world_from_camera, const geo::Rigid3d& world_from_from,
                   const Vector3d& point_from, bool is_direction) {
  const Eigen::Quaterniond camera_from_world = world_from_camera.rotation.conjugate();
  const Vector3d turned = camera_from_world * (world_from_from.rotation * point_from);
  if (is_direction) return turned;
  return turned + camera_from_world * (world_from_from.translation - world_from_camera.translation);
}

}  // namespace

// A quaternion whose entries err by e turns by an angle that errs by 2 e. The turn's: a product of three factors, a
// sine by its angle and a cosine are right to 8 u of the half angle, and to 2 u. Each of the two products with the
// body's rotation and the mount is a sum of four products, each of which takes part in four roundings at most, and is
// divided once: 2 (4 |sums| + 1) u, where |sums| <= 2 (capture/label_bounds.cpp). The offset is a product; as it is off
// by u of itself, a sum of terms of the fifth power is off by 5 u. Sums of terms take ten roundings at most, of sizes
// that add up to most_position_m and most_turning_rad.
PoseError line_pose_error(const geo::CameraMotion& motion, double offset_s) {
  const geo::BodyState& state = motion.state;
  const double time_s = std::abs(offset_s);
  const double speed_mps =
      state.velocity_world_mps.norm() + time_s * state.acceleration_world_mps2.norm();
  const geo::MotionTerms& terms = state.terms;
  const double spin_rad = time_s * terms.spin_body_radps.norm();
  const double turn_rad =
      time_s * (state.angular_velocity_body_radps - terms.spin_body_radps).norm() + spin_rad;
  const double terms_m = terms.most_position_m(time_s), terms_rad = terms.most_turning_rad(time_s);
  const double arm_m = motion.body_from_camera.translation.norm();
  constexpr double kProduct = 18.0;
  const double products = spin_rad > 0.0 ? 2.0 * (kProduct + 4.0) : kProduct + 4.0;
  const double body_angle = kU * (products + 17.0 * turn_rad + 40.0 * terms_rad);
  PoseError error;
  error.angle_rad = body_angle + kU * kProduct;
  const geo::Rigid3d body = state.pose_after(offset_s);
  const double largest_m =
      body.translation.cwiseAbs().maxCoeff() + arm_m + state.world_from_body.translation.norm();
  // Products and sums of the way; the offset's own rounding, at the centre's speed; the mount's arm, turned; and the
  // two sums with places far from the origin, in three coordinates.
  error.position_m =
      kU * (7.0 * time_s * speed_mps + 17.0 * terms_m + (turn_rad + 5.0 * terms_rad) * arm_m +
            geo::turn_error(body.rotation) * arm_m) +
      body_angle * arm_m + 2.0 * std::sqrt(3.0) * geo::rounding_of(largest_m);
  return error;
}

LineBounds::LineBounds(const CameraView& view, const Vector2d& pixel)
    : pixel_(pixel),
      offset_s_(view.offset_of_line_s(pixel)),
      line_(at_time(view, offset_s_)),
      pose_error_(line_pose_error(*view.motion, offset_s_)),
      depth_(line_) {}

double LineBounds::range_error_m(double range_m, const Vector3d& normal_world,
                                 const BodyMotion* motion) const {
  const Vector3d along =
      line_.world_from_camera.rotation * line_.model.ray_from_pixel(pixel_).normalized();
  // The normal comes as floats.
  constexpr double kNormalRounding = 0x1.0p-23;
  const double sine = std::abs(normal_world.dot(along)) - kNormalRounding;
  if (!(sine > 0.0)) return kInfinity;
  const Vector3d start = line_.model.origin_from_pixel(pixel_);
  const double of_camera_m =
      pose_error_.position_m + (start.norm() + range_m) * pose_error_.angle_rad;
  if (motion == nullptr) return of_camera_m / sine;
  const Vector3d point_body = motion->from.pose_after(offset_s_).inverse() *
                              (line_.world_from_camera * start + range_m * along);
  return (of_camera_m + body_error_m(motion->from, offset_s_, point_body)) / sine;
}

// Where the point stands at a time is wrong by what FlowBounds says of the two poses, and by what they err by
// themselves. It is seen when that meets its line: with s the shutter's slope (seconds a pixel) and w the point's speed
// in the image, an error e of the place at a fixed time makes one of the time of s.e / (1 - s.w), and so of the place of
// e + w s.e / (1 - s.w). What the solver leaves of the time does the same.
std::optional<LabelError> LineBounds::flow_error_px(const CameraView& to, double range_m,
                                                    double range_error_m,
                                                    const BodyMotion* motion) const {
  if (motion != nullptr && !motion->to) return std::nullopt;
  const bool is_sky = std::isinf(range_m);
  if (is_sky && !to.model.is_central()) return std::nullopt;
  const Vector3d ray = line_.model.ray_from_pixel(pixel_).normalized();
  const Vector3d start = line_.model.origin_from_pixel(pixel_);
  const Vector3d point_from = is_sky ? ray : Vector3d(start + range_m * ray);
  const Vector3d point_body = motion == nullptr
                                  ? Vector3d::Zero()
                                  : Vector3d(motion->from.pose_after(offset_s_).inverse() *
                                             (line_.world_from_camera * point_from));
  const auto look = [&](double offset_s) -> std::optional<Sight> {
    const geo::Rigid3d world_from_to = to.motion->world_from_camera(offset_s);
    Sight sight{offset_s, Vector2d::Zero(),
                motion == nullptr
                    ? in_camera(world_from_to, line_.world_from_camera, point_from, is_sky)
                    : world_from_to.inverse() * (motion->to->pose_after(offset_s) * point_body)};
    const std::optional<Vector2d> pixel = to.model.pixel_from_ray(sight.point_camera);
    if (!pixel) return std::nullopt;
    sight.pixel = *pixel;
    return sight;
  };
  const auto seen = geo::find_seen(to.motion->shutter, to.model.width_px(), to.model.height_px(),
                                   [&](double offset_s) -> std::optional<Vector2d> {
                                     const std::optional<Sight> sight = look(offset_s);
                                     if (!sight) return std::nullopt;
                                     return sight->pixel;
                                   });
  if (!seen || !to.model.contains(seen->pixel)) return std::nullopt;

  const FlowBounds at_fixed_times(line_, at_time(to, seen->offset_s));
  std::optional<LabelError> error =
      motion == nullptr
          ? at_fixed_times.flow_error_px(pixel_, range_m, range_error_m)
          : at_fixed_times.flow_error_px(pixel_, range_m, range_error_m,
                                         {.from = at_time(motion->from, offset_s_),
                                          .to = at_time(*motion->to, seen->offset_s)});
  const std::optional<Sight> sight = look(seen->offset_s);
  if (!error || !sight) return std::nullopt;
  const PoseError there = line_pose_error(*to.motion, seen->offset_s);
  // A projection's Jacobian changes by less than this over such small errors.
  constexpr double kGrowth = 1.01;
  const double distance_m =
      is_sky ? 1.0 : std::max(start.norm() + range_m, sight->point_camera.norm());
  const double moved_m =
      (is_sky ? 0.0 : pose_error_.position_m + there.position_m) +
      distance_m * (pose_error_.angle_rad + there.angle_rad) +
      (motion == nullptr ? 0.0
                         : body_error_m(motion->from, offset_s_, point_body) +
                               body_error_m(*motion->to, seen->offset_s, point_body));
  error->arithmetic += kGrowth * to.model.pixel_jacobian(sight->point_camera).norm() * moved_m;

  const geo::Shutter& shutter = to.motion->shutter;
  const double step_s = shutter.line_time_s;
  const std::optional<Sight> before = look(seen->offset_s - step_s);
  const std::optional<Sight> after = look(seen->offset_s + step_s);
  if (!before || !after) return LabelError{.arithmetic = kInfinity, .rounding = kInfinity};
  const Vector2d speed_pxps = (after->pixel - before->pixel) / (2.0 * step_s);
  const auto late_s = [&](const Sight& at) {
    return shutter.offset_s(at.pixel, to.model.width_px(), to.model.height_px()) - at.offset_s;
  };
  // 1 - s.w, by the same differences.
  const double closing = (late_s(*before) - late_s(*after)) / (2.0 * step_s);
  constexpr double kLeastClosing = 0.05;
  if (!(closing > kLeastClosing)) return LabelError{.arithmetic = kInfinity, .rounding = kInfinity};
  const double size_px = std::hypot(to.model.width_px(), to.model.height_px());
  // What is left of the solver's miss, and the roundings by which it is known.
  const double miss_s = std::abs(late_s(*sight)) + 4.0 * kU * step_s * size_px;
  const double stretch = 1.0 + kGrowth * speed_pxps.norm() * step_s / closing;
  error->arithmetic = stretch * error->arithmetic + kGrowth * speed_pxps.norm() * miss_s / closing;
  error->rounding *= stretch;
  return error;
}

}  // namespace terracast::capture
