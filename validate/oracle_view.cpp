#include "validate/oracle_view.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "validate/sampling.h"

namespace terracast::validate {

Pose world_from_local(const oracle::WorldFolder& world, const Sequence& sequence) {
  const oracle::WorldFolder::Origin origin = world.origin();
  const Geodetic world_origin{origin.lat_deg, origin.lon_deg, origin.height_m};
  const Eigen::Matrix3d world_from_ecef = enu_from_ecef(world_origin);
  // The difference first: turning 6 400 km would cost three digits.
  return {
      world_from_ecef * enu_from_ecef(sequence.origin).transpose(),
      world_from_ecef * (ecef_from_geodetic(sequence.origin) - ecef_from_geodetic(world_origin))};
}

oracle::WorldFromEnu world_from_enu_of(const oracle::WorldFolder& world) {
  const oracle::WorldFolder::Origin origin = world.origin();
  const Pose ecef_from_world = ecef_from_local({origin.lat_deg, origin.lon_deg, origin.height_m});
  return [ecef_from_world](const Eigen::Vector3d& place_world) -> Eigen::Matrix3d {
    const Geodetic place = geodetic_from_ecef(ecef_from_world * place_world);
    return ecef_from_world.rotation.transpose() * enu_from_ecef(place).transpose();
  };
}

PoseRounding pose_rounding(const std::string& format, double distance_m) {
  // The exporter's change of frames is good to 10 nm, ours to 4 nm, and so are sums of 100 km; the
  // renderer's crossing errs by 12 roundings of as much. A product of rotations errs by some 1e-16.
  PoseRounding rounding{.position_m = 2e-8, .angle_rad = 1e-14};
  if (format == "tartanair" || format == "tartanair_v1" || format == "euroc" || format == "tum") {
    rounding.position_m += std::sqrt(3.0) * 0.5e-9;  // nine decimals of a metre
    rounding.angle_rad += 4.0 * 0.5e-15;             // fifteen of a quaternion, doubled
  }
  const bool is_kitti = format == "kitti" || format == "kitti_raw";
  if (is_kitti || format == "kitti_object" || format == "coco") {  // by georeference.csv
    rounding.position_m += 0.5e-6;                                 // six decimals of a height
    rounding.position_m += 2.0 * 0.56e-8;  // thirteen of a degree of latitude and longitude
  }
  if (is_kitti) {
    // Thirteen digits: of a place against the first frame's; of the nine numbers of two rotations;
    // of focal length and principal point.
    rounding.position_m += std::sqrt(3.0) * 0.5e-12 * distance_m;
    rounding.angle_rad += 2.0 * 3.0 * 0.5e-12 + 2.0 * 0.5e-12;
  }
  return rounding;
}

bool OracleView::is_usable() const {
  constexpr double kEarth_m = 1e8;
  constexpr double kLongestRay = 1e3;
  const Eigen::Matrix3d& r = world_from_camera.rotation;
  if (!(world_from_camera.translation.norm() < kEarth_m) ||
      !((r * r.transpose()).eval().isIdentity(1e-3)))
    return false;
  if (intrinsics().plane) return true;  // rays of length 1 or none, and none that starts far off
  for (const double u : {0.0, static_cast<double>(intrinsics().width_px)})
    for (const double v : {0.0, static_cast<double>(intrinsics().height_px)})
      if (!(intrinsics().ray_from_pixel({u, v}).norm() < kLongestRay)) return false;
  return true;
}

Pose OracleView::world_from_line(const Eigen::Vector2d& pixel) const {
  if (!view.lines) return world_from_camera;
  return world_from_camera *
         view.lines->start_from_camera(view.lines->shutter.offset_s(pixel, intrinsics()));
}

oracle::ExactRay OracleView::ray(const Eigen::Vector2d& pixel) const {
  const Pose line = world_from_line(pixel);
  const Eigen::Vector3d direction = line.rotation * intrinsics().ray_from_pixel(pixel);
  const Eigen::Vector3d origin = line * intrinsics().origin_from_pixel(pixel);
  return {origin, origin + kThrough_m * direction};
}

std::optional<OracleView::Sighting> OracleView::sighting(const Eigen::Vector3d& point_world) const {
  const Eigen::Vector3d point_camera =
      world_from_camera.rotation.transpose() * (point_world - world_from_camera.translation);
  if (!view.lines) {
    const Eigen::Vector2d pixel = intrinsics().pixel_from_point(point_camera);
    if (!(intrinsics().distance_m(point_camera, pixel) > 0.0)) return std::nullopt;
    return Sighting{pixel, world_from_camera * intrinsics().origin_from_pixel(pixel)};
  }
  const auto sight = find_line(view.lines->shutter, intrinsics(), [&](double offset_s) {
    return Eigen::Vector3d(view.lines->start_from_camera(offset_s).inverse() * point_camera);
  });
  if (!sight) return std::nullopt;
  return Sighting{sight->pixel,
                  world_from_camera * (view.lines->start_from_camera(sight->offset_s) *
                                       intrinsics().origin_from_pixel(sight->pixel))};
}

double OracleView::sine_of_graze(const Eigen::Vector2d& pixel, const oracle::ExactHit& hit) const {
  const Eigen::Vector3d direction =
      world_from_line(pixel).rotation * intrinsics().ray_from_pixel(pixel);
  return std::abs(hit.normal_world.dot(direction)) / direction.norm();
}

namespace {

/// A model's ray is that of an image point so near: the renderer's by its header, a part in 10^12 of the image's diagonal
/// and the pixel's place together; ours by camera_plane.h, 1e-11 of its lengths.
double model_rounding_px(const Intrinsics& camera, const Eigen::Vector2d& pixel) {
  const double diagonal_px = std::hypot(camera.width_px, camera.height_px);
  return 1e-12 * (diagonal_px + pixel.norm()) + 1e-11 * std::max(camera.fx_px, camera.fy_px);
}

}  // namespace

double OracleView::depth_error_m(const Eigen::Vector2d& pixel, const oracle::ExactHit& hit) const {
  const double depth = depth_m(hit);
  const double length = intrinsics().ray_from_pixel(pixel).norm();
  const double range = depth * length;
  const double by_floats = half_float_step(range) / length + half_float_step(depth);
  double turn_rad = rounding.angle_rad;
  if (intrinsics().plane)
    turn_rad += model_rounding_px(intrinsics(), pixel) *
                unprojection_jacobian(intrinsics(), pixel, 1.0).norm();
  const double by_pose =
      (rounding.position_m + range * turn_rad) / (length * sine_of_graze(pixel, hit));
  return by_floats + by_pose;
}

double half_float_step(double value) {
  const auto nearest = static_cast<float>(std::abs(value));
  const float next = std::nextafter(nearest, std::numeric_limits<float>::infinity());
  return 0.5 * (static_cast<double>(next) - static_cast<double>(nearest));
}

// A pinhole is finest in a corner; a lens may be so anywhere.
double finest_pixels_per_radian(const Intrinsics& camera) {
  if (camera.plane && camera.plane->model() == "equirectangular")
    return std::max(camera.fx_px,
                    camera.fy_px);  // columns meet in the poles, and show no more there
  if (camera.plane && camera.plane->model() == "pushbroom") {
    // Across the fan of a row's rays it is a pinhole; along the way rows stand apart by metres.
    const double widest = std::max(camera.cx_px, camera.width_px - camera.cx_px) / camera.fx_px;
    return camera.fx_px * (1.0 + widest * widest);
  }
  if (camera.plane && !camera.plane->is_central()) return 0.0;
  const int parts = camera.lens.kind == Lens::Kind::None && !camera.plane ? 1 : 128;
  double finest = 0.0;
  for (int i = 0; i <= parts; ++i)
    for (int j = 0; j <= parts; ++j) {
      const Eigen::Vector3d ray =
          camera.ray_from_pixel({static_cast<double>(camera.width_px) * i / parts,
                                 static_cast<double>(camera.height_px) * j / parts});
      if (!ray.allFinite()) continue;
      // Of the unit ray; along the ray itself the image does not move.
      const Eigen::Matrix<double, 2, 3> jacobian = projection_jacobian(camera, ray.normalized());
      const Eigen::Matrix2d square = jacobian * jacobian.transpose();
      finest = std::max(
          finest,
          std::sqrt(Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(square).eigenvalues()[1]));
    }
  return finest;
}

}  // namespace terracast::validate
