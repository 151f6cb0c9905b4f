#include <array>

#include "geo/cameras/distorted_pinhole.h"

namespace terracast::geo {
namespace {

constexpr std::array kParameters = {
    CameraParameter{"k1", "Radial distortion of r^2; negative pulls corners in (barrel)."},
    CameraParameter{"k2", "Radial distortion of r^4."},
    CameraParameter{"p1", "Decentring along y."},
    CameraParameter{"p2", "Decentring along x."},
    CameraParameter{"k3", "Radial distortion of r^6."},
    CameraParameter{"k4", "Of r^2 in the divisor of the radial distortion."},
    CameraParameter{"k5", "Of r^4 in the divisor."},
    CameraParameter{"k6", "Of r^6 in the divisor."}};

/// source   cv::projectPoints with eight coefficients, in the order of its distCoeffs (OpenCV, module
///          calib3d, CALIB_RATIONAL_MODEL); FULL_OPENCV of COLMAP; plane_distortion.h
std::unique_ptr<CameraModel> make_full_opencv(const CameraIntrinsics& intrinsics) {
  const double* own = &intrinsics.parameters[4];
  return std::make_unique<DistortedPinholeCamera>(
      intrinsics,
      PlaneDistortion::Coefficients{
          .k = {own[0], own[1], own[4]}, .d = {own[5], own[6], own[7]}, .p = {own[2], own[3]}});
}

}  // namespace

CameraModelInfo full_opencv_camera() {
  return {.name = "full_opencv",
          .summary = "Pinhole with rational radial distortion and decentring, Brown-Conrady.",
          .parameters = kParameters,
          .make = make_full_opencv};
}

}  // namespace terracast::geo
