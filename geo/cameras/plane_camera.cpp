#include "geo/cameras/plane_camera.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace terracast::geo {

using Eigen::Vector2d;
using Eigen::Vector3d;

PlaneCamera::PlaneCamera(const CameraIntrinsics& intrinsics, const PlaneDistortion& distortion)
    : CameraModel(intrinsics),
      fx_(intrinsics.parameters[0]),
      fy_(intrinsics.parameters[1]),
      cx_(intrinsics.parameters[2]),
      cy_(intrinsics.parameters[3]),
      distortion_(distortion) {}

Vector3d PlaneCamera::ray_from_pixel(const Vector2d& pixel) const {
  return ray_from_plane(distortion_.undistorted(plane_from_pixel(pixel)));
}

std::optional<Vector2d> PlaneCamera::pixel_from_ray(const Vector3d& ray_camera) const {
  const std::optional<Vector2d> place = plane_from_ray(ray_camera);
  if (!place || !distortion_.holds(*place)) return std::nullopt;
  const Vector2d moved = distortion_.distorted(*place);
  return Vector2d(fx_ * moved.x() + cx_, fy_ * moved.y() + cy_);
}

Eigen::Matrix<double, 2, 3> PlaneCamera::pixel_jacobian(const Vector3d& ray_camera) const {
  Eigen::Matrix<double, 2, 3> jacobian =
      distortion_.jacobian(*plane_from_ray(ray_camera)) * plane_jacobian(ray_camera);
  jacobian.row(0) *= fx_;
  jacobian.row(1) *= fy_;
  return jacobian;
}

// At a unit ray the Jacobian's null space is the ray: its largest singular value is pixels a radian in the
// direction that spreads most.
double PlaneCamera::pixels_per_radian(const Vector2d& pixel) const {
  const Vector3d ray = ray_from_pixel(pixel);
  if (!ray.allFinite()) return 0.0;
  const Eigen::Matrix<double, 2, 3> j = pixel_jacobian(ray.normalized());
  const Eigen::Matrix2d square = j * j.transpose();
  const double middle = 0.5 * (square(0, 0) + square(1, 1));
  return std::sqrt(middle + std::hypot(0.5 * (square(0, 0) - square(1, 1)), square(0, 1)));
}

void PlaneCamera::measure_finest() {
  constexpr int kCells = 32;
  constexpr std::size_t kBest = 8;
  struct Place {
    Vector2d pixel;
    double value;
  };
  const Vector2d size(width_px(), height_px());
  const Vector2d cell = size / kCells;
  std::vector<Place> places;
  for (int j = 0; j <= kCells; ++j) {
    for (int i = 0; i <= kCells; ++i) {
      const Vector2d pixel = cell.cwiseProduct(Vector2d(i, j));
      places.push_back({pixel, pixels_per_radian(pixel)});
    }
  }
  std::partial_sort(places.begin(), places.begin() + kBest, places.end(),
                    [](const Place& a, const Place& b) { return a.value > b.value; });
  places.resize(kBest);
  for (Place& best : places) {
    constexpr double kLeastStep = 1e-4;  // of a cell: where it is finest, 1e-8 of the value
    // A few steps of each length are enough, but for coefficients so large that rounding alone has ups and downs.
    int num_left = 2000;
    for (double step = 0.5; step > kLeastStep && num_left > 0; --num_left) {
      const Place before = best;
      for (const Vector2d& way :
           {Vector2d(1, 0), Vector2d(-1, 0), Vector2d(0, 1), Vector2d(0, -1), Vector2d(1, 1),
            Vector2d(-1, 1), Vector2d(1, -1), Vector2d(-1, -1)}) {
        const Vector2d pixel = (before.pixel + step * cell.cwiseProduct(way))
                                   .cwiseMax(Vector2d::Zero())
                                   .cwiseMin(size);
        const double value = pixels_per_radian(pixel);
        if (value > best.value) best = {pixel, value};
      }
      if (best.value <= before.value) step *= 0.5;
    }
    set_finest(std::max(finest_pixels_per_radian_, best.value));
  }
}

}  // namespace terracast::geo
