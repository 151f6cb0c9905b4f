#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string_view>
#include <vector>

#include "geo/camera_model.h"

/// Every camera model once more, from its publication, in 64-bit mantissas and without geo/cameras.
namespace terracast::test {

/// A ray of the camera's frame.
struct PublishedRay {
  Eigen::Vector3d origin_camera = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction_camera = Eigen::Vector3d::UnitZ();  ///< unit
};

/// A small camera of a model, and how its publication has it.
class PublishedCamera {
 public:
  /// Null: the model has no formula here.
  static const PublishedCamera* find(std::string_view model);

  const geo::CameraIntrinsics& intrinsics() const { return intrinsics_; }
  bool is_central() const { return is_central_; }
  /// How far off a thing fills a good part of the image.
  double near_m() const { return near_m_; }

  /// Where a point stands; nothing beyond what is sure to hold the image and a margin.
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point_camera) const;
  /// The ray of an image point; nothing where there is none. By inverting project() with Newton's method, or as the
  /// publication has rays that are known at once.
  std::optional<PublishedRay> ray(const Eigen::Vector2d& pixel) const;

  using Real = long double;
  using Plane = std::array<Real, 2>;
  using Point = std::array<Real, 3>;
  /// Of fx, fy, cx, cy and the model's own parameters the place in the image.
  using Projection = Plane (*)(const Point& point, const std::vector<double>& parameters);
  using Rays = PublishedRay (*)(const Eigen::Vector2d& pixel,
                                const std::vector<double>& parameters);

  PublishedCamera(geo::CameraIntrinsics intrinsics, Projection projection, double widest_rad,
                  double near_m, Rays rays = nullptr, bool is_central = true)
      : intrinsics_(std::move(intrinsics)),
        projection_(projection),
        widest_rad_(widest_rad),
        near_m_(near_m),
        rays_(rays),
        is_central_(is_central) {}

 private:
  geo::CameraIntrinsics intrinsics_;
  Projection projection_;
  double widest_rad_;
  double near_m_;
  Rays rays_;
  bool is_central_;
};

}  // namespace terracast::test
