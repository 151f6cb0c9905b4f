#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "geo/camera_model.h"
#include "geo/rigid3.h"

/// Cameras in the YAML of Kalibr's calibrations, which OpenVINS, Basalt and others read: for rigs and for exports.
namespace terracast::capture {

/// A model with a distortion, its parameters before the focal lengths and its coefficients, and our model, whose own
/// parameters are those, in this order, the last ones left out where they are 0.
struct KalibrModel {
  std::string_view camera_model;
  std::string_view distortion_model;
  std::size_t num_leading;  ///< of intrinsics, before fu, fv, pu, pv
  std::size_t num_coefficients;
  std::string_view model;
};
/// The first one of a model of ours is what it is written as, the first one of a model of Kalibr's what it is read as.
inline constexpr std::array kKalibrModels = {
    KalibrModel{"pinhole", "none", 0, 0, "pinhole"},
    KalibrModel{"pinhole", "radtan", 0, 4, "opencv"},
    KalibrModel{"pinhole", "radtan", 0, 4, "radial"},
    KalibrModel{"pinhole", "radtan", 0, 4, "simple_radial"},
    KalibrModel{"pinhole", "equidistant", 0, 4, "opencv_fisheye"},
    KalibrModel{"pinhole", "fov", 0, 1, "fov"},
    KalibrModel{"omni", "radtan", 1, 4, "unified"},
    KalibrModel{"omni", "none", 1, 0, "unified"},
    KalibrModel{"eucm", "none", 2, 0, "extended_unified"},
    KalibrModel{"ds", "none", 2, 0, "double_sphere"},
};

/// A camera as Kalibr has it; pixels count from the first one's centre.
struct KalibrCamera {
  std::string_view camera_model, distortion_model;
  std::vector<double> intrinsics, coefficients;
  int width_px = 0, height_px = 0;

  /// camera_model, intrinsics, distortion_model, distortion_coeffs and resolution, a line each, of a map in a map.
  std::string text() const;
};

/// camera   its name, for the message
/// throws   Config: Kalibr has no such model; says which it has
KalibrCamera kalibr_camera(const geo::CameraIntrinsics& intrinsics, std::string_view camera);

/// Numbers of a list, each with a decimal point: to YAML 1.1 a number without one is an integer, or with an exponent
/// a text.
std::string yaml_numbers(const std::vector<double>& numbers);

/// The four rows of a transform, a line each, of a list in a map in a map.
std::string yaml_rows(const geo::Rigid3d& target_from_source);

}  // namespace terracast::capture
