#include "capture/label_bounds.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "capture/channel.h"
#include "capture/frame.h"
#include "capture/line_bounds.h"
#include "core/error.h"
#include "core/parallel.h"
#include "geo/rounding.h"

namespace terracast::capture {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector2d;
using Eigen::Vector3d;

using geo::kU;
using geo::length_error;
using geo::rounding_of;
using geo::turn_error;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// rounding_of() the difference of a number and one whose bits are no finer: while it is below the number's next
/// power of two, it is exact.
double rounding_of_difference(double from, double largest) {
  const double next = 2.0 * geo::power_of_two(geo::exponent_of(from));
  return largest * (1.0 + 0x1.0p-30) <= next ? 0.0 : rounding_of(largest);
}
Vector3d rounding_of(const Vector3d& value) {
  const Vector3d largest = value.cwiseAbs();
  return {rounding_of(largest.x()), rounding_of(largest.y()), rounding_of(largest.z())};
}

/// Error of the direction of (a b).normalized(), in u of a unit vector that it turns: a component is a sum of four
/// products, each of which takes part in four roundings at most, and is divided once; a quaternion's error counts
/// twice.
double product_error(const Quaterniond& a, const Quaterniond& b) {
  const Eigen::Vector4d p = a.coeffs().cwiseAbs(), q = b.coeffs().cwiseAbs();
  const Eigen::Vector4d sums(p[3] * q[0] + p[0] * q[3] + p[1] * q[2] + p[2] * q[1],
                             p[3] * q[1] + p[1] * q[3] + p[2] * q[0] + p[0] * q[2],
                             p[3] * q[2] + p[2] * q[3] + p[0] * q[1] + p[1] * q[0],
                             p[3] * q[3] + p[0] * q[0] + p[1] * q[1] + p[2] * q[2]);
  return 2.0 * (4.0 * sums.norm() + 1.0);
}

/// Errors of the entries of Quaterniond::toRotationMatrix. Beside the diagonal a sum of two products, 2xy and 2wz;
/// on it 1 less a sum of two squares. A quaternion whose square is 1 + e gives R + e (R - 1).
Matrix3d rotation_error(const Quaterniond& q, const Matrix3d& rotation) {
  const double lengths = kU * length_error(q);
  const auto product = [](double a, double b) { return rounding_of(2.0 * std::abs(a * b)); };
  const auto beside = [&](int i, int j, double products) {
    return products + rounding_of(std::abs(rotation(i, j))) + lengths * std::abs(rotation(i, j));
  };
  const auto diagonal = [&](int i, double products) {
    const double left = 1.0 - rotation(i, i);
    return products + rounding_of(left) + lengths * left + rounding_of(std::abs(rotation(i, i)));
  };
  const double xx = product(q.x(), q.x()), yy = product(q.y(), q.y()), zz = product(q.z(), q.z());
  const double xy = product(q.x(), q.y()), xz = product(q.x(), q.z()), yz = product(q.y(), q.z());
  const double wx = product(q.w(), q.x()), wy = product(q.w(), q.y()), wz = product(q.w(), q.z());
  Matrix3d error;
  error << diagonal(0, yy + zz), beside(0, 1, xy + wz), beside(0, 2, xz + wy),  //
      beside(1, 0, xy + wz), diagonal(1, xx + zz), beside(1, 2, yz + wx),       //
      beside(2, 0, xz + wy), beside(2, 1, yz + wx), diagonal(2, xx + yy);
  return error;
}

/// The first two coordinates of a pixel's ray: a difference and a quotient. The third is 1.
constexpr double kRay = 2.0;
/// Length of a vector (squares and two sums, of which the root halves the error; the root) and its product with
/// t, or the quotient by it.
constexpr double kLength = 3.5;
/// Where a walk was clamped to its cell, t is that of the cell's side: the lines of the grid (3) and the clearance
/// there (2). The right t is in the right cell: it is no farther than either error.
constexpr double kClamped = 5.0;
/// How far a tile's centre may be from the middle between its lowest and highest sample.
constexpr double kCenterReach_m = 1.0;
/// A point of a kept range: length and quotient, product, ray.
constexpr double kPoint = kLength + 1.0 + kRay;
/// A lens's Jacobian changes by less than so many times itself over a radian.
constexpr double kBend = 1000.0;

/// Models whose rays, their origins and image points are sums, products and quotients, each of which is rounded
/// once. Others say what they round by.
bool is_plain(const geo::CameraModel& model) {
  const std::string& name = model.intrinsics().model;
  return name == "pinhole" || name == "orthographic" || name == "pushbroom";
}

/// What a model that is not plain rounds an image point by, px (geo/camera_model.h).
double lens_rounding_px(const geo::CameraModel& model, const Vector2d& pixel) {
  if (is_plain(model)) return 0.0;
  return geo::kPixelRounding * (std::hypot(model.width_px(), model.height_px()) + pixel.norm());
}

/// By how much the ray of an image point errs for it, rad: what the point is rounded by, over the pixels that a
/// radian spans in the direction in which it spans fewest.
double ray_error_rad(const geo::CameraModel& model, const Vector2d& pixel, const Vector3d& ray) {
  if (is_plain(model)) return 0.0;
  if (!model.pixel_from_ray(ray)) return kInfinity;
  const Eigen::Matrix<double, 2, 3> jacobian = model.pixel_jacobian(ray.normalized());
  const Eigen::Matrix2d square = jacobian * jacobian.transpose();
  const double fewest = square.determinant() / square.trace();
  return fewest > 0.0 ? lens_rounding_px(model, pixel) / std::sqrt(fewest) : kInfinity;
}

}  // namespace

double float_rounding(double value) {
  if (!std::isfinite(value) || value == 0.0) return 0.0;
  constexpr int kFractionBits = 24;
  constexpr int kLeastExponent = -126;  // of normal floats
  return geo::power_of_two(std::max(geo::exponent_of(value), kLeastExponent) - kFractionBits);
}

DepthBounds::DepthBounds(const CameraView& view)
    : model_(view.model),
      origin_world_(view.world_from_camera.translation),
      rotation_(view.world_from_camera.rotation.toRotationMatrix()),
      rotation_error_(rotation_error(view.world_from_camera.rotation, rotation_)) {}

// The ray's clearance above the plane is a + b t with, about the triangle's vertex v and the tile's centre c,
//   a = (o_z - c_z) - (v_z - c_z) - s_x (o_x - v_x) - s_y (o_y - v_y),   b = d_z - s_x d_x - s_y d_y
// and t = -a / b (world/triangle_plane.h). With errors e_a and e_b, t errs by (e_a + |t| e_b) / |b| and its own
// rounding. Each product and each sum, in this order, is rounded once; a difference o - v twice, in metres and in
// cells. v is within a cell of the hit, where the clearance is 0: so a = -b t, and partial sums are what is still
// to be subtracted.
double DepthBounds::range_error_m(const Vector2d& pixel, double range_m,
                                  const Vector3d& normal_world, const TileScale& tile) const {
  const Aim aim = aim_at(pixel);
  const Vector3d& direction = aim.direction;
  const double t = range_m / aim.length;

  const double slope_x = std::abs(normal_world.x() / normal_world.z());
  const double slope_y = std::abs(normal_world.y() / normal_world.z());
  // The slopes come as quotients of two floats each: so much of the closing rate is not known.
  constexpr double kSlopeRounding = 2.25 * 0x1.0p-24;
  const double rate = std::abs(normal_world.dot(direction) / normal_world.z());
  const double least_rate = rate - kSlopeRounding * (slope_x * std::abs(direction.x()) +
                                                     slope_y * std::abs(direction.y()));
  if (!(least_rate > 0.0)) return kInfinity;

  const Vector3d way = t * direction.cwiseAbs();
  const double clearance = t * rate;
  const double gap_x = way.x() + tile.spacing_m, gap_y = way.y() + tile.spacing_m;
  const double cell = (slope_x + slope_y) * tile.spacing_m;
  // The centre is the middle of the ground's heights; what stands on it only makes the highest higher.
  const double middle_z = 0.5 * (tile.lowest_z_world + tile.highest_z_world);
  const Vector3d& origin = aim.origin;
  const double from_center =
      std::max(std::abs(origin.z() - middle_z), std::abs(origin.z() - tile.lowest_z_world)) +
      kCenterReach_m;
  // Vertices and centres stand on a lattice that is coarser than the steps of any place of a camera.
  const double center_error = rounding_of_difference(origin.z(), from_center);
  const double clearance_error =
      center_error +
      (center_error > 0.0 ? rounding_of(way.z() + cell)
                          : rounding_of_difference(origin.z(), way.z() + cell)) +
      rounding_of(clearance + slope_y * gap_y) + rounding_of(clearance) +
      rounding_of(slope_x * gap_x) + rounding_of(slope_y * gap_y) +
      2.0 * (slope_x * rounding_of_difference(origin.x(), gap_x) +
             slope_y * rounding_of_difference(origin.y(), gap_y));
  const double fall_x = slope_x * std::abs(direction.x());
  const double fall_y = slope_y * std::abs(direction.y());
  const double rate_error =
      rounding_of(fall_x) + rounding_of(fall_y) + rounding_of(rate + fall_y) + rounding_of(rate);
  const double aim_error = aim.error.z() + slope_x * aim.error.x() + slope_y * aim.error.y();
  const double start_error =
      aim.origin_error.z() + slope_x * aim.origin_error.x() + slope_y * aim.origin_error.y();
  const double crossing_error =
      (clearance_error + start_error + t * (rate_error + aim_error)) / least_rate;
  return aim.range_error_m(t, std::max(crossing_error + rounding_of(t), kClamped * kU * t));
}

double DepthBounds::object_range_error_m(const Vector2d& pixel, double range_m,
                                         const Vector3d& normal_world,
                                         double crossing_error) const {
  const Aim aim = aim_at(pixel);
  const double t = range_m / aim.length;
  // The normal comes as floats.
  constexpr double kNormalRounding = 0x1.0p-23;
  const double least_rate =
      std::abs(normal_world.dot(aim.direction)) - kNormalRounding * aim.direction.cwiseAbs().sum();
  if (!(least_rate > 0.0)) return kInfinity;
  const Vector3d largest_normal = normal_world.cwiseAbs() + Vector3d::Constant(kNormalRounding);
  const double aim_error = largest_normal.dot(aim.error);
  const double start_error = largest_normal.dot(aim.origin_error);
  return aim.range_error_m(t,
                           crossing_error + t * aim_error / least_rate + start_error / least_rate);
}

DepthBounds::Aim DepthBounds::aim_at(const Vector2d& pixel) const {
  const Vector3d ray = model_.ray_from_pixel(pixel);
  // Products of a row with the ray (the third is one with 1, exact), their first sum and their second.
  const Vector3d by_x = rotation_.col(0) * ray.x(), by_y = rotation_.col(1) * ray.y();
  const Vector3d direction = by_x + by_y + rotation_.col(2) * ray.z();
  Aim aim{.length = ray.norm(),
          .direction = direction,
          .error = rotation_error_ * ray.cwiseAbs() + kU * (by_x.cwiseAbs() + by_y.cwiseAbs()) +
                   rounding_of(std::abs(ray.x())) * rotation_.col(0).cwiseAbs() +
                   rounding_of(std::abs(ray.y())) * rotation_.col(1).cwiseAbs() +
                   rounding_of(by_x) + rounding_of(by_y) + rounding_of(by_x + by_y) +
                   rounding_of(direction)};
  set_origin(pixel, aim);
  if (!is_plain(model_)) {
    // The third product is one like the others; at depth 1 an angle moves a ray by up to its length squared.
    const double moved = ray_error_rad(model_, pixel, ray) * ray.squaredNorm();
    aim.error += (rotation_.cwiseAbs() * Vector3d::Constant(moved)) +
                 2.0 * kU * std::abs(ray.z()) * rotation_.col(2).cwiseAbs();
  }
  return aim;
}

// The camera's own place is given. Else as a ray: a difference and a quotient, which are turned and added to it.
void DepthBounds::set_origin(const Vector2d& pixel, Aim& aim) const {
  aim.origin = origin_world_;
  aim.origin_error = Vector3d::Zero();
  if (model_.is_central()) return;
  const Vector3d start = model_.origin_from_pixel(pixel);
  const Vector3d by_x = rotation_.col(0) * start.x(), by_y = rotation_.col(1) * start.y();
  aim.origin += by_x + by_y + rotation_.col(2) * start.z();
  aim.origin_error = rotation_error_ * start.cwiseAbs() +
                     2.0 * kU * (by_x.cwiseAbs() + by_y.cwiseAbs()) + rounding_of(by_x) +
                     rounding_of(by_y) + rounding_of(by_x + by_y) + rounding_of(aim.origin);
}

double DepthBounds::Aim::range_error_m(double t, double t_error) const {
  const double stretch_error = t * direction.cwiseAbs().dot(error) / length;
  return length * t_error + kU * kLength * t * length + stretch_error;
}

LabelError DepthBounds::depth_error_m(const Vector2d& pixel, double range_m,
                                      double range_error_m) const {
  const Vector3d ray = model_.ray_from_pixel(pixel);
  const double along = std::abs(ray.z()) / ray.norm();
  const double turned = ray_error_rad(model_, pixel, ray) * range_m;
  return {.arithmetic = along * (range_error_m + kU * range_m * kPoint) + turned,
          .rounding = along * float_rounding(range_m) + float_rounding(along * range_m)};
}

FlowBounds::FlowBounds(const CameraView& from, const CameraView& to)
    : from_(from),
      to_(to),
      to_from_from_(to_from(to, from)),
      turn_error_(product_error(to.world_from_camera.rotation, from.world_from_camera.rotation) +
                  turn_error(to_from_from_.rotation)),
      // A difference, which is turned.
      translation_error_((1.0 + turn_error(to.world_from_camera.rotation)) *
                         to_from_from_.translation.norm()) {}

// Where the ray starts is right to kRay, and the way is added to it.
FlowBounds::Carried FlowBounds::carry(const Vector2d& pixel, double range_m) const {
  const Vector3d ray = from_.model.ray_from_pixel(pixel).normalized();
  const Vector3d along = to_from_from_.rotation * ray;
  if (std::isinf(range_m)) return {along, along, kU * (turn_error_ + kPoint)};
  const Vector3d point = along * range_m + to_from_from_.translation;
  const double error = range_m * (turn_error_ + kPoint) + translation_error_ + point.norm();
  if (from_.model.is_central()) return {along, point, kU * error};
  const Vector3d start = from_.model.origin_from_pixel(pixel);
  const Vector3d turned = to_from_from_.rotation * start;
  return {
      along, point + turned,
      kU * (error + start.norm() * (turn_error_ + kRay + 1.0) + (start + range_m * ray).norm())};
}

// In the order of capture::flow(): into the world, into the body, with the body, into the other camera. A sum is
// rounded by u of it, a rotation by the error of its turning; pose_after(0) normalises a body's quaternion again.
FlowBounds::Carried FlowBounds::carry(const Vector2d& pixel, double range_m,
                                      const BodyMotion& motion) const {
  const Vector3d ray = from_.model.ray_from_pixel(pixel).normalized();
  const Vector3d start = from_.model.origin_from_pixel(pixel);
  const auto turned = [](const Quaterniond& rotation) {
    return turn_error(rotation) + product_error(rotation, Quaterniond::Identity());
  };
  const geo::Rigid3d& from = motion.from.world_from_body;
  const geo::Rigid3d& to = motion.to->world_from_body;
  const Quaterniond to_from_world = to_.world_from_camera.rotation.conjugate();
  const Vector3d there = from_.world_from_camera * (start + ray * range_m);
  const Vector3d in_body = from.rotation.conjugate() * (there - from.translation);
  const Vector3d then = to * in_body;
  const Vector3d point = to_from_world * (then - to_.world_from_camera.translation);
  const Vector3d along =
      to_from_world *
      (to.rotation * (from.rotation.conjugate() * (from_.world_from_camera.rotation * ray)));
  const double of_start =
      from_.model.is_central()
          ? 0.0
          : start.norm() * (turn_error(from_.world_from_camera.rotation) + kRay) +
                (start + ray * range_m).norm();
  const double error = range_m * (turn_error(from_.world_from_camera.rotation) + kPoint) +
                       of_start + there.norm() +
                       in_body.norm() * (1.0 + turned(from.rotation) + turned(to.rotation)) +
                       then.norm() + point.norm() * (1.0 + turn_error(to_from_world));
  return {along, point, kU * error};
}

std::optional<LabelError> FlowBounds::flow_error_px(const Vector2d& pixel, double range_m,
                                                    double range_error_m) const {
  return error_px(pixel, range_m, range_error_m, carry(pixel, range_m));
}

std::optional<LabelError> FlowBounds::flow_error_px(const Vector2d& pixel, double range_m,
                                                    double range_error_m,
                                                    const BodyMotion& motion) const {
  if (!motion.to) return std::nullopt;
  return error_px(pixel, range_m, range_error_m, carry(pixel, range_m, motion));
}

std::optional<LabelError> FlowBounds::error_px(const Vector2d& pixel, double range_m,
                                               double range_error_m, const Carried& carried) const {
  const bool is_sky = std::isinf(range_m);
  if (is_sky && !to_.model.is_central()) return std::nullopt;
  const Vector3d& along = carried.along;
  const Vector3d& point_to = carried.point;
  const std::optional<Vector2d> target = to_.model.pixel_from_ray(point_to);
  if (!target || !to_.model.contains(*target)) return std::nullopt;

  const double aim_error =
      ray_error_rad(from_.model, pixel, from_.model.ray_from_pixel(pixel).normalized());
  const double point_error = carried.error + (is_sky ? 1.0 : range_m) * aim_error;
  const double moved = is_sky ? 0.0 : range_error_m;
  const double rounded = is_sky ? 0.0 : float_rounding(range_m);
  // The projection is a quotient by depth: over a shift e at depth z its slope grows by (1 - e / z)^-2. Another
  // lens's does not grow by more at the nearness of its bend.
  const double nearness = is_plain(to_.model) ? point_to.z() : point_to.norm() / kBend;
  const double share = (point_error + moved + rounded) / nearness;
  if (!(share < 0.5)) return LabelError{.arithmetic = kInfinity, .rounding = kInfinity};
  const double growth = 1.0 / ((1.0 - share) * (1.0 - share));
  const Eigen::Matrix<double, 2, 3> jacobian = growth * to_.model.pixel_jacobian(point_to);
  const double by_range = (jacobian * along).norm();
  const double by_point = jacobian.norm();
  // The projection's quotient, product and sum, and the difference from the pixel.
  const double size = std::hypot(to_.model.width_px(), to_.model.height_px());
  const double projection = kU * (3.0 * (*target).norm() + 2.0 * size + (*target - pixel).norm()) +
                            lens_rounding_px(to_.model, *target);
  const Vector2d motion = *target - pixel;
  const double kept = std::hypot(float_rounding(motion.x()), float_rounding(motion.y()));
  return LabelError{.arithmetic = by_range * moved + by_point * point_error + projection,
                    .rounding = by_range * rounded + kept};
}

namespace {

void raise(std::optional<LabelError>& largest, const LabelError& error) {
  if (!largest) largest = LabelError{};
  largest->arithmetic = std::max(largest->arithmetic, error.arithmetic);
  largest->rounding = std::max(largest->rounding, error.rounding);
}

bool is_unbounded(const std::optional<LabelError>& error) {
  return error && std::isinf(error->arithmetic);
}

}  // namespace

LabelBounds bounds_of_labels(const CameraView& view, const std::optional<CameraView>& next,
                             const std::optional<CameraView>& previous, const CameraFrame& facts,
                             std::span<const double> crossing_errors,
                             std::span<const TileScale> tiles, const BodyMotions& motions_next,
                             const BodyMotions& motions_previous) {
  TERRACAST_CHECK(crossing_errors.size() == facts.range_m.data().size(),
                  "{} errors of crossings for {} pixels", crossing_errors.size(),
                  facts.range_m.data().size());
  const DepthBounds of_one_pose(view);
  std::optional<FlowBounds> to_next, to_previous;
  if (next && !view.motion) to_next.emplace(view, *next);
  if (previous && !view.motion) to_previous.emplace(view, *previous);

  const auto add_pixel = [&](int x, int y, LabelBounds& bounds) {
    if (std::isnan(facts.range_m(x, y))) return;
    if ((facts.flags(x, y) & kEdge) != 0) {
      ++bounds.num_left_out;
      return;
    }
    const Vector2d pixel = pixel_center(x, y);
    const auto range_m = static_cast<double>(facts.range_m(x, y));
    double range_error_m = 0.0;
    std::optional<LineBounds> of_line;
    if (view.motion) of_line.emplace(view, pixel);
    const DepthBounds& depth = of_line ? of_line->depth() : of_one_pose;
    if (!std::isinf(range_m)) {
      const Vector3d normal(facts.normal_world(x, y, 0), facts.normal_world(x, y, 1),
                            facts.normal_world(x, y, 2));
      if (facts.primitive_id(x, y) >= kObjectPrimitives) {
        const std::size_t at =
            static_cast<std::size_t>(y) * static_cast<std::size_t>(facts.range_m.width()) +
            static_cast<std::size_t>(x);
        range_error_m = depth.object_range_error_m(pixel, range_m, normal, crossing_errors[at]);
      } else {
        const std::size_t tile = facts.primitive_id(x, y) >> kPrimitiveTileShift;
        TERRACAST_CHECK(tile < tiles.size(), "tile {} of {}", tile, tiles.size());
        range_error_m = depth.range_error_m(pixel, range_m, normal, tiles[tile]);
      }
      if (of_line)
        range_error_m +=
            of_line->range_error_m(range_m, normal,
                                   (next ? motions_next : motions_previous)
                                       .find(facts.instance_id(x, y), facts.primitive_id(x, y)));
      if (std::isinf(range_error_m)) {
        ++bounds.num_left_out;
        return;
      }
    }
    const auto flow_error = [&](const std::optional<CameraView>& to,
                                const std::optional<FlowBounds>& of_one_pose_each,
                                const BodyMotions& motions) -> std::optional<LabelError> {
      if (!to) return std::nullopt;
      const BodyMotion* motion = motions.find(facts.instance_id(x, y), facts.primitive_id(x, y));
      if (of_line) return of_line->flow_error_px(*to, range_m, range_error_m, motion);
      return motion == nullptr
                 ? of_one_pose_each->flow_error_px(pixel, range_m, range_error_m)
                 : of_one_pose_each->flow_error_px(pixel, range_m, range_error_m, *motion);
    };
    const std::optional<LabelError> there = flow_error(next, to_next, motions_next);
    const std::optional<LabelError> back = flow_error(previous, to_previous, motions_previous);
    if (is_unbounded(there) || is_unbounded(back)) {
      ++bounds.num_left_out;
      return;
    }
    if (!std::isinf(range_m))
      raise(bounds.depth_m, depth.depth_error_m(pixel, range_m, range_error_m));
    if (there) raise(bounds.flow_next_px, *there);
    if (back) raise(bounds.flow_previous_px, *back);
  };

  const int width = facts.range_m.width(), height = facts.range_m.height();
  std::vector<LabelBounds> rows(static_cast<std::size_t>(height));
  core::parallel_for_blocks(height, 8, [&](std::int64_t begin, std::int64_t end) {
    for (auto y = static_cast<int>(begin); y < end; ++y)
      for (int x = 0; x < width; ++x) add_pixel(x, y, rows[static_cast<std::size_t>(y)]);
  });
  LabelBounds bounds;
  for (const LabelBounds& row : rows) {
    if (row.depth_m) raise(bounds.depth_m, *row.depth_m);
    if (row.flow_next_px) raise(bounds.flow_next_px, *row.flow_next_px);
    if (row.flow_previous_px) raise(bounds.flow_previous_px, *row.flow_previous_px);
    bounds.num_left_out += row.num_left_out;
  }
  return bounds;
}

}  // namespace terracast::capture
