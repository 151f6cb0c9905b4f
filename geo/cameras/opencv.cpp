#include <array>

#include "geo/cameras/distorted_pinhole.h"

namespace terracast::geo {
namespace {

constexpr std::array kParameters = {
    CameraParameter{"k1", "Radial distortion of r^2; negative pulls corners in (barrel)."},
    CameraParameter{"k2", "Radial distortion of r^4."},
    CameraParameter{"p1", "Decentring along y."}, CameraParameter{"p2", "Decentring along x."}};

/// source   cv::projectPoints with four coefficients (OpenCV, module calib3d); OPENCV of COLMAP;
///          Kalibr's pinhole-radtan; plane_distortion.h
std::unique_ptr<CameraModel> make_opencv(const CameraIntrinsics& intrinsics) {
  const double* own = &intrinsics.parameters[4];
  return std::make_unique<DistortedPinholeCamera>(
      intrinsics, PlaneDistortion::Coefficients{.k = {own[0], own[1]}, .p = {own[2], own[3]}});
}

}  // namespace

CameraModelInfo opencv_camera() {
  return {.name = "opencv",
          .summary = "Pinhole with radial distortion and decentring, Brown-Conrady.",
          .parameters = kParameters,
          .make = make_opencv};
}

}  // namespace terracast::geo
