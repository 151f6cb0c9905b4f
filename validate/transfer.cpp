#include "validate/transfer.h"

#include "validate/sampling.h"

namespace terracast::validate {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

Matrix3d rotation_at(const View& view, double offset_s) {
  const Matrix3d& at_frame = view.local_from_camera.rotation;
  if (!view.lines) return at_frame;
  return at_frame * view.lines->start_from_camera(offset_s).rotation;
}

/// The line of a view that sees a point, or a direction, of its camera's frame at the frame's time.
std::optional<LineSight> line_that_sees(const View& view, const Vector3d& point,
                                        bool is_direction) {
  const LineMotion& lines = *view.lines;
  const Pose& body_from_camera = lines.body_from_camera;
  const Matrix3d camera_from_body = body_from_camera.rotation.transpose();
  if (is_direction) {
    const Vector3d direction_body = body_from_camera.rotation * point;
    return find_line(lines.shutter, view.camera->intrinsics, [&](double offset_s) -> Vector3d {
      return camera_from_body * lines.body.direction_at(offset_s, direction_body);
    });
  }
  const Vector3d point_body = body_from_camera * point;
  return find_line(lines.shutter, view.camera->intrinsics, [&](double offset_s) -> Vector3d {
    const Vector3d now_body =
        lines.body.direction_at(offset_s, point_body - lines.body.place_m(offset_s));
    return camera_from_body * (now_body - body_from_camera.translation);
  });
}

/// Completes a place whose point_b is that at the frame's time.
void see_at_once(const View& b, Transfer::Place& place) {
  const Intrinsics& camera = b.camera->intrinsics;
  place.pixel = camera.pixel_from_point(place.point_b);
  place.distance_b_m = camera.distance_m(place.point_b, place.pixel);
}

/// Completes a place by the line that sees it.
std::optional<Transfer::Place> see_by_line(const View& b, const std::optional<LineSight>& sight,
                                           Transfer::Place place) {
  if (!sight) return std::nullopt;
  place.point_b = sight->point_camera;
  place.pixel = sight->pixel;
  place.distance_b_m = b.camera->intrinsics.distance_m(place.point_b, place.pixel);
  place.offset_b_s = sight->offset_s;
  return place;
}

}  // namespace

Pose pose_of_line(const View& view, const Vector2d& pixel) {
  if (!view.lines) return view.local_from_camera;
  const double offset_s = view.lines->shutter.offset_s(pixel, view.camera->intrinsics);
  return view.local_from_camera * view.lines->start_from_camera(offset_s);
}

Transfer::Transfer(const View& a, const View& b)
    : a_(a), b_(b), b_from_a_(b.local_from_camera.inverse() * a.local_from_camera) {}

void Transfer::start(const Vector2d& pixel_a, double distance_m, Place& place) const {
  place.pixel_a = pixel_a;
  place.distance_a_m = distance_m;
  place.point_a = a_.camera->intrinsics.point_from_pixel(pixel_a, distance_m);
}

Pose Transfer::b_from_a_at(const Vector2d& pixel_a, double& offset_s) const {
  if (!a_.lines) return b_from_a_;
  offset_s = a_.lines->shutter.offset_s(pixel_a, a_.camera->intrinsics);
  return b_from_a_ * a_.lines->start_from_camera(offset_s);
}

std::optional<Transfer::Place> Transfer::place(const Vector2d& pixel_a, double distance_m,
                                               bool is_direction) const {
  Place place;
  start(pixel_a, distance_m, place);
  if (is_direction) {
    place.point_a = a_.camera->intrinsics.ray_from_pixel(pixel_a) * distance_m;
    // What is infinitely far has no one image where rays start at many places.
    const auto& plane = b_.camera->intrinsics.plane;
    if (plane && !plane->is_central()) return place;
  }
  const Pose b_from_a = b_from_a_at(pixel_a, place.offset_a_s);
  place.point_b =
      is_direction ? Vector3d(b_from_a.rotation * place.point_a) : b_from_a * place.point_a;
  if (!b_.lines) {
    see_at_once(b_, place);
    return place;
  }
  return see_by_line(b_, line_that_sees(b_, place.point_b, is_direction), place);
}

bool Transfer::is_seen_at(const Vector2d& pixel_b, const Vector2d& pixel_a, double distance_m,
                          bool is_direction, double tolerance_px) const {
  const Intrinsics& camera = b_.camera->intrinsics;
  if (is_direction && camera.plane && !camera.plane->is_central()) return false;
  double offset_a_s = 0.0;
  const Pose b_from_a = b_from_a_at(pixel_a, offset_a_s);
  const Pose now_from_a =
      b_.lines
          ? b_.lines->start_from_camera(b_.lines->shutter.offset_s(pixel_b, camera)).inverse() *
                b_from_a
          : b_from_a;
  const Vector3d point =
      is_direction ? Vector3d(now_from_a.rotation * a_.camera->intrinsics.ray_from_pixel(pixel_a))
                   : now_from_a * a_.camera->intrinsics.point_from_pixel(pixel_a, distance_m);
  const Vector2d pixel = camera.pixel_from_point(point);
  return camera.distance_m(point, pixel) > 0.0 &&
         camera.way_px(pixel, pixel_b).norm() <= tolerance_px;
}

std::optional<Transfer::Place> Transfer::point_of_body(int body, const Vector2d& pixel_a,
                                                       double distance_m) const {
  const std::optional<Moving>& moving = a_.sequence->moving;
  const MovingState* now = moving ? moving->state(a_.frame, body) : nullptr;
  const MovingState* then = moving ? moving->state(b_.frame, body) : nullptr;
  if (now == nullptr || then == nullptr) return std::nullopt;
  Place place;
  start(pixel_a, distance_m, place);
  if (a_.lines) place.offset_a_s = a_.lines->shutter.offset_s(pixel_a, a_.camera->intrinsics);
  const Vector3d point_body = now->local_from_body_at(place.offset_a_s).inverse() *
                              (pose_of_line(a_, pixel_a) * place.point_a);
  const auto in_camera = [&](double offset_s) -> Vector3d {
    const Pose local_from_camera =
        b_.lines ? b_.local_from_camera * b_.lines->start_from_camera(offset_s)
                 : b_.local_from_camera;
    return local_from_camera.inverse() * (then->local_from_body_at(offset_s) * point_body);
  };
  if (!b_.lines) {
    place.point_b = in_camera(0.0);
    see_at_once(b_, place);
    return place;
  }
  return see_by_line(b_, find_line(b_.lines->shutter, b_.camera->intrinsics, in_camera), place);
}

std::optional<Transfer::Place> Transfer::of_local_point(const View& b,
                                                        const Vector3d& point_local) {
  Place place;
  place.point_b = b.local_from_camera.inverse() * point_local;
  place.point_a = place.point_b;
  if (!b.lines) {
    see_at_once(b, place);
    return place;
  }
  return see_by_line(b, line_that_sees(b, place.point_b, false), place);
}

Matrix3d Transfer::local_from_a(const Place& place) const {
  return rotation_at(a_, place.offset_a_s);
}
Matrix3d Transfer::local_from_b(const Place& place) const {
  return rotation_at(b_, place.offset_b_s);
}

// The point moves in b's frame by w a second, w = d point_b / dt, and is seen at t = s . pixel. So a change d of it
// makes one of e = d + w dt, with dt = s . J e, where J is the projection's Jacobian: e = (1 - w s^T J)^-1 d.
Matrix3d Transfer::through_time(const Place& place) const {
  if (!b_.lines) return Matrix3d::Identity();
  const Vector3d velocity = -b_.lines->velocity_mps(place.offset_b_s) -
                            b_.lines->turn_radps(place.offset_b_s).cross(place.point_b);
  const Eigen::RowVector3d time_by_point =
      b_.lines->shutter.slope_s().transpose() *
      projection_jacobian(b_.camera->intrinsics, place.point_b);
  const double along = time_by_point.dot(velocity);
  // Sherman and Morrison. A point that all but runs along with the lines tells nothing.
  constexpr double kLeast = 0.05;
  return Matrix3d::Identity() + velocity * time_by_point / std::max(1.0 - along, kLeast);
}

}  // namespace terracast::validate
