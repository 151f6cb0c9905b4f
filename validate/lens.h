#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace terracast::validate {

/// What the lenses of COLMAP's camera models do to the place x / z, y / z where a pinhole at z = 1 sees a
/// point. Written from COLMAP's definitions (src/base/camera_models.h of 3.8, src/colmap/sensor/models.h of
/// 3.12) and by another way than the program's own cameras: derivatives are differences.
struct Lens {
  enum class Kind {
    None,         ///< it leaves places where they are
    Perspective,  ///< k1 k2 p1 p2 k3 k4 k5 k6 of FULL_OPENCV
    Fisheye,      ///< k1 k2 p1 p2 k3 k4 sx1 sy1 of THIN_PRISM_FISHEYE
    Fov,          ///< omega of FOV
  };
  Kind kind = Kind::None;
  std::array<double, 8> c{};

  Eigen::Vector2d distorted(const Eigen::Vector2d& place) const;
  /// d distorted / d place; good to nine digits.
  Eigen::Matrix2d jacobian(const Eigen::Vector2d& place) const;
  /// The place that comes to lie there; NaN where there is none.
  Eigen::Vector2d undistorted(const Eigen::Vector2d& target) const;

  bool operator==(const Lens&) const = default;
};

/// A model's focal lengths, principal point and lens.
struct ColmapIntrinsics {
  double fx_px = 0.0;
  double fy_px = 0.0;
  double cx_px = 0.0;
  double cy_px = 0.0;
  Lens lens;
};

/// Nothing for a model that is not known, or another number of parameters than it has.
std::optional<ColmapIntrinsics> colmap_intrinsics(const std::string& model,
                                                  const std::vector<double>& parameters);

/// A model of COLMAP's that holds them: colmap_intrinsics of it are the same.
std::pair<std::string, std::vector<double>> colmap_model(const ColmapIntrinsics& camera);

}  // namespace terracast::validate
