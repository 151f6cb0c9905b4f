#pragma once

#include <Eigen/Core>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>

#include "validate/geometry.h"

/// Rolling shutters: when each line of an image is exposed, and where its camera is then. Written from what
/// dataset.json says of them; it shares no code with the renderer's.
namespace terracast::validate {

/// Which way the lines of an image follow each other.
enum class Readout { Down, Up, Right, Left };
const char* name_of(Readout readout);
std::optional<Readout> readout_of(std::string_view name);
/// The same lines from the other end.
Readout opposite(Readout readout);

struct Shutter {
  double line_time_s = 0.0;  ///< from a line to the next; above 0
  Readout readout = Readout::Down;

  /// When the line through an image point is exposed, after the frame's time.
  double offset_s(const Eigen::Vector2d& pixel, const Intrinsics& camera) const;
  /// d offset_s / d pixel.
  Eigen::Vector2d slope_s() const;
  /// Of the image's first and last lines, the most that any differs from the frame's time.
  double reach_s(const Intrinsics& camera) const;
  bool operator==(const Shutter&) const = default;
};

/// A row of motion.csv: how the body moves about a frame's time, along the axes that it has then (x forward, y
/// left, z up). So much later, t, it stands at v t + a t^2 / 2 + p3 t^3 + p4 t^4 + p5 t^5, turned by
/// exp((w - s) t + r2 t^2 + r3 t^3 + r4 t^4 + r5 t^5) exp(s t). Farther away than the reach what p and r add goes on
/// along its tangent.
struct BodyMotion {
  Eigen::Vector3d velocity_mps = Eigen::Vector3d::Zero();
  Eigen::Vector3d acceleration_mps2 = Eigen::Vector3d::Zero();
  Eigen::Vector3d turn_radps = Eigen::Vector3d::Zero();
  Eigen::Matrix3d p = Eigen::Matrix3d::Zero();                          ///< columns p3, p4, p5
  Eigen::Matrix<double, 3, 4> r = Eigen::Matrix<double, 3, 4>::Zero();  ///< columns r2, …, r5
  Eigen::Vector3d spin_radps = Eigen::Vector3d::Zero();
  double reach_s = 0.0;

  /// The body's frame at the frame's time, from the body so much later.
  Pose start_from_body(double offset_s) const;
  /// The translation of that: where the body stands.
  Eigen::Vector3d place_m(double offset_s) const;
  /// A direction, or a point less place_m, of the body's frame at the frame's time: along the axes that the body has so
  /// much later.
  Eigen::Vector3d direction_at(double offset_s, const Eigen::Vector3d& direction) const;
  /// Derivatives by the time: of the place along the axes at the frame's time, and the turning along those that the
  /// body has so much later.
  Eigen::Vector3d velocity_mps_at(double offset_s) const;
  Eigen::Vector3d turn_radps_at(double offset_s) const;

 private:
  /// f of exp(f) exp(s t).
  Eigen::Vector3d turn_rad(double offset_s) const;
};

/// The columns of motion.csv and moving.csv that follow the turn rates, and how many they are. Datasets of before
/// they were there have none of them: their motions go on with constants.
inline constexpr std::string_view kTermColumns =
    "p3x_mps3,p3y_mps3,p3z_mps3,p4x_mps4,p4y_mps4,p4z_mps4,p5x_mps5,p5y_mps5,p5z_mps5,r2x_radps2,"
    "r2y_radps2,r2z_radps2,r3x_radps3,r3y_radps3,r3z_radps3,r4x_radps4,r4y_radps4,r4z_radps4,"
    "r5x_radps5,r5y_radps5,r5z_radps5,sx_radps,sy_radps,sz_radps,reach_s";
inline constexpr std::size_t kNumTermColumns = 25;
/// values   kNumTermColumns of them
/// throws   Input: a reach below 0
void set_terms(const double* values, const std::string& where, BodyMotion& motion);

/// A camera while its lines are exposed.
struct LineMotion {
  Shutter shutter;
  BodyMotion body;
  Pose body_from_camera;

  /// The camera's frame at the frame's time, from the camera so much later.
  Pose start_from_camera(double offset_s) const {
    return body_from_camera.inverse() * body.start_from_body(offset_s) * body_from_camera;
  }
  /// Of the camera's centre against the Earth so much later, along the axes that the camera has then.
  Eigen::Vector3d velocity_mps(double offset_s) const;
  /// Its turning then, along the same axes.
  Eigen::Vector3d turn_radps(double offset_s) const {
    return body_from_camera.rotation.transpose() * body.turn_radps_at(offset_s);
  }
};

/// What a line sees.
struct LineSight {
  double offset_s = 0.0;
  Eigen::Vector3d point_camera;
  Eigen::Vector2d pixel;
};

/// Finds the line that sees a point. Where a point stands in the image is a function of time, and which line is
/// exposed then another: the two meet where their difference changes its sign. It is bracketed, from where the
/// point stands at the frame's time outward, and closed in on by false position: an end that stays twice running has
/// its weight halved (the Illinois rule), and every eighth step bisects.
/// point_at   the point in the camera's frame at an offset from the frame's time; a direction will do
/// returns    nothing where the camera does not see the point on the way, where it runs along with the lines, so
///            that none meets it, or lies over 8 images away
/// accuracy   1e-9 of a line
template <class PointAt>
std::optional<LineSight> find_line(const Shutter& shutter, const Intrinsics& camera,
                                   const PointAt& point_at) {
  constexpr double kLines = 1e-9;
  constexpr double kImages = 8.0;
  constexpr int kMostSteps = 100;
  /// A place in time, and how much later than then the point's line is exposed.
  struct Look {
    LineSight sight;
    double late_s = 0.0;
  };
  const auto look = [&](double offset_s) -> std::optional<Look> {
    Look found;
    found.sight.offset_s = offset_s;
    found.sight.point_camera = point_at(offset_s);
    if (!camera.plane && !(found.sight.point_camera.z() > 0.0)) return std::nullopt;
    found.sight.pixel = camera.pixel_from_point(found.sight.point_camera);
    if (!(camera.distance_m(found.sight.point_camera, found.sight.pixel) > 0.0))
      return std::nullopt;
    found.late_s = shutter.offset_s(found.sight.pixel, camera) - offset_s;
    if (!std::isfinite(found.late_s)) return std::nullopt;
    return found;
  };
  const double near_s = kLines * shutter.line_time_s;
  const double farthest_s = kImages * shutter.reach_s(camera);
  std::optional<Look> from = look(0.0);
  if (!from) return std::nullopt;
  if (std::abs(from->late_s) <= near_s) return from->sight;
  // Outward, by twice as much each time, until the point's line is exposed earlier than then.
  std::optional<Look> to;
  for (double step_s = 1.25 * from->late_s;; step_s *= 2.0) {
    if (!(std::abs(from->sight.offset_s + step_s) < farthest_s)) return std::nullopt;
    to = look(from->sight.offset_s + step_s);
    if (!to) return std::nullopt;
    if ((to->late_s > 0.0) != (from->late_s > 0.0)) break;
    from = to;
  }
  double weight_from = from->late_s, weight_to = to->late_s;
  enum class End { None, From, To } replaced = End::None;  // by the last step
  for (int step = 0; step < kMostSteps; ++step) {
    const double a_s = from->sight.offset_s, b_s = to->sight.offset_s;
    const bool bisects = step % 8 == 7;
    const double at_s = bisects ? 0.5 * (a_s + b_s)
                                : (a_s * weight_to - b_s * weight_from) / (weight_to - weight_from);
    const std::optional<Look> middle = look(at_s);
    if (!middle) return std::nullopt;
    if (std::abs(middle->late_s) <= near_s || std::abs(b_s - a_s) <= 1e-15 * farthest_s)
      return middle->sight;
    if ((middle->late_s > 0.0) == (to->late_s > 0.0)) {
      to = middle;
      weight_to = middle->late_s;
      if (replaced == End::To) weight_from *= 0.5;
      replaced = End::To;
    } else {
      from = middle;
      weight_from = middle->late_s;
      if (replaced == End::From) weight_to *= 0.5;
      replaced = End::From;
    }
  }
  return std::nullopt;
}

}  // namespace terracast::validate
