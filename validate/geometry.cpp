#include "validate/geometry.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace terracast::validate {

void Intrinsics::find_reach() {
  reach = std::numeric_limits<double>::infinity();
  if (plane || lens.kind == Lens::Kind::None || !is_sound()) return;
  // On the image's side of a fold, radius grows from the axis to the border: the border's farthest place is the
  // farthest of all, but for what lies between the points that are looked at and lenses that lean, 2 % at most.
  constexpr int kParts = 32;
  constexpr double kMargin = 1.02;
  double farthest = 0.0;
  for (int part = 0; part <= kParts; ++part)
    for (const bool is_far : {false, true}) {
      const double along = static_cast<double>(part) / kParts;
      for (const Eigen::Vector2d& pixel :
           {Eigen::Vector2d(along * width_px, is_far ? height_px : 0.0),
            Eigen::Vector2d(is_far ? width_px : 0.0, along * height_px)}) {
        const Eigen::Vector2d place = lens.undistorted(place_from_pixel(pixel));
        if (!place.allFinite()) return;
        farthest = std::max(farthest, place.norm());
      }
    }
  reach = kMargin * farthest;
}

Eigen::Vector3d Pose::operator*(const Eigen::Vector3d& point) const {
  return rotation * point + translation;
}

Pose Pose::operator*(const Pose& other) const {
  return {rotation * other.rotation, rotation * other.translation + translation};
}

Pose Pose::inverse() const { return {rotation.transpose(), -(rotation.transpose() * translation)}; }

double rotation_angle_rad(const Eigen::Matrix3d& rotation) {
  const Eigen::Vector3d twice_sine_axis(rotation(2, 1) - rotation(1, 2),
                                        rotation(0, 2) - rotation(2, 0),
                                        rotation(1, 0) - rotation(0, 1));
  return std::atan2(0.5 * twice_sine_axis.norm(), 0.5 * (rotation.trace() - 1.0));
}

Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& rotation) {
  const Eigen::AngleAxisd turn{Eigen::Quaterniond(rotation)};
  return turn.angle() * turn.axis();
}

Eigen::Matrix3d halfway(const Eigen::Matrix3d& from, const Eigen::Matrix3d& to) {
  const Eigen::Vector3d half_turn = 0.5 * rotation_vector(from.transpose() * to);
  if (half_turn.isZero()) return from;
  return from * Eigen::AngleAxisd(half_turn.norm(), half_turn.normalized()).toRotationMatrix();
}

}  // namespace terracast::validate
