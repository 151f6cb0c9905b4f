#include <array>

#include "geo/cameras/distorted_pinhole.h"

namespace terracast::geo {
namespace {

constexpr std::array kParameters = {
    CameraParameter{"k1", "Radial distortion of r^2; negative pulls corners in (barrel)."},
    CameraParameter{"k2", "Radial distortion of r^4."}};

/// source   RADIAL of COLMAP (src/base/camera_models.h); plane_distortion.h
std::unique_ptr<CameraModel> make_radial(const CameraIntrinsics& intrinsics) {
  const double* own = &intrinsics.parameters[4];
  return std::make_unique<DistortedPinholeCamera>(
      intrinsics, PlaneDistortion::Coefficients{.k = {own[0], own[1]}});
}

}  // namespace

CameraModelInfo radial_camera() {
  return {.name = "radial",
          .summary = "Pinhole with radial distortion of two coefficients, as COLMAP's.",
          .parameters = kParameters,
          .make = make_radial};
}

}  // namespace terracast::geo
