#include <array>

#include "geo/cameras/distorted_pinhole.h"

namespace terracast::geo {
namespace {

constexpr std::array kParameters = {
    CameraParameter{"k1", "Radial distortion of r^2; negative pulls corners in (barrel)."}};

/// source   SIMPLE_RADIAL of COLMAP (src/base/camera_models.h), whose k is k1; plane_distortion.h
std::unique_ptr<CameraModel> make_simple_radial(const CameraIntrinsics& intrinsics) {
  const double* own = &intrinsics.parameters[4];
  return std::make_unique<DistortedPinholeCamera>(intrinsics,
                                                  PlaneDistortion::Coefficients{.k = {own[0]}});
}

}  // namespace

CameraModelInfo simple_radial_camera() {
  return {.name = "simple_radial",
          .summary = "Pinhole with radial distortion of one coefficient, as COLMAP's.",
          .parameters = kParameters,
          .make = make_simple_radial};
}

}  // namespace terracast::geo
