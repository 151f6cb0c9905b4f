#include "tiler/vegetation/plant.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace terracast::tiler {

Eigen::Vector3d Draws::direction() {
  const double z = between(-1.0, 1.0);
  const double angle_rad = between(0.0, 2.0 * std::numbers::pi);
  const double r = std::sqrt(1.0 - z * z);
  return {r * std::cos(angle_rad), r * std::sin(angle_rad), z};
}

Foot spread_foot(int k, int count, double reach_m, double sunk_m, double astray_rad, Draws& draws) {
  const double out_m = reach_m * std::sqrt((k + draws.unit()) / count);
  double angle_rad = k * kGoldenAngle_rad;
  if (astray_rad > 0.0) angle_rad += draws.about(0.0, astray_rad);
  return {out_m, {out_m * std::cos(angle_rad), out_m * std::sin(angle_rad), -sunk_m}};
}

Eigen::Vector3d across(const Eigen::Vector3d& direction) {
  const Eigen::Vector3d helper =
      std::abs(direction.z()) < 0.9 ? Eigen::Vector3d::UnitZ() : Eigen::Vector3d::UnitX();
  return direction.cross(helper).normalized();
}

Leaf make_leaf(const Eigen::Vector3d& base_m, const Eigen::Vector3d& tip_m, double width_m,
               const Eigen::Vector3d& up, LeafForm form, double lift_m, std::uint8_t finish) {
  Eigen::Vector3d side = tip_m.cross(up);
  const double length = side.norm();
  side = length > 1e-6 * tip_m.norm() ? Eigen::Vector3d(side / length) : across(tip_m.normalized());
  return {base_m, tip_m, 0.5 * width_m * side, lift_m, form, finish};
}

}  // namespace terracast::tiler
