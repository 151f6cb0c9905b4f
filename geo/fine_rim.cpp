#include "geo/fine_rim.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace terracast::geo {

namespace {

constexpr int kPlaces = 32;  // along each side
constexpr double kFarFiner = 30.0;

/// The angle that a pixel spans in the direction in which it spans least; NaN where it sees nothing.
double angle_of_pixel_rad(const CameraModel& camera, const Eigen::Vector2d& pixel) {
  const Eigen::Vector3d here = camera.ray_from_pixel(pixel).normalized();
  Eigen::Matrix<double, 3, 2> steps;
  for (int axis = 0; axis < 2; ++axis)
    steps.col(axis) =
        camera.ray_from_pixel(pixel + Eigen::Vector2d::Unit(axis)).normalized() - here;
  const Eigen::Matrix2d squares = steps.transpose() * steps;
  const double middle = 0.5 * squares.trace();
  const double spread = std::hypot(0.5 * (squares(0, 0) - squares(1, 1)), squares(0, 1));
  return std::sqrt(middle - spread);
}

}  // namespace

std::optional<FineRim> find_fine_rim(const CameraModel& camera) {
  const double finest = camera.finest_pixels_per_radian();
  if (!(finest > 0.0)) return std::nullopt;
  const Eigen::Vector2d cell(camera.width_px() / double{kPlaces},
                             camera.height_px() / double{kPlaces});
  std::vector<double> angles_rad;
  for (int j = 0; j < kPlaces; ++j)
    for (int i = 0; i < kPlaces; ++i) {
      const double angle_rad =
          angle_of_pixel_rad(camera, cell.cwiseProduct(Eigen::Vector2d(i + 0.5, j + 0.5)));
      if (std::isfinite(angle_rad)) angles_rad.push_back(angle_rad);
    }
  if (angles_rad.empty()) return std::nullopt;
  const auto middle = angles_rad.begin() + static_cast<std::ptrdiff_t>(angles_rad.size() / 2);
  std::nth_element(angles_rad.begin(), middle, angles_rad.end());
  const double usual = 1.0 / *middle;
  if (!(finest > kFarFiner * usual)) return std::nullopt;
  return FineRim{.finest_pixels_per_radian = finest, .usual_pixels_per_radian = usual};
}

}  // namespace terracast::geo
