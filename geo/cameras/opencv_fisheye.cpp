#include <array>

#include "geo/cameras/equidistant_camera.h"

namespace terracast::geo {
namespace {

constexpr std::array kParameters = {
    CameraParameter{"k1", "Of t^3 in the radius, t being the angle from the axis."},
    CameraParameter{"k2", "Of t^5."}, CameraParameter{"k3", "Of t^7."},
    CameraParameter{"k4", "Of t^9."}};

/// t (1 + k1 t^2 + k2 t^4 + k3 t^6 + k4 t^8) from the centre.
/// source   J. Kannala, S. Brandt, A generic camera model and calibration method for conventional,
///          wide-angle, and fish-eye lenses, PAMI 28 (2006); cv::fisheye; OPENCV_FISHEYE of COLMAP;
///          Kalibr's pinhole-equi
std::unique_ptr<CameraModel> make_opencv_fisheye(const CameraIntrinsics& intrinsics) {
  const double* own = &intrinsics.parameters[4];
  return std::make_unique<EquidistantCamera>(
      intrinsics, PlaneDistortion::Coefficients{.k = {own[0], own[1], own[2], own[3]}});
}

}  // namespace

CameraModelInfo opencv_fisheye_camera() {
  return {.name = "opencv_fisheye",
          .summary = "Fisheye: the radius is a polynomial of the angle, Kannala-Brandt.",
          .parameters = kParameters,
          .make = make_opencv_fisheye};
}

}  // namespace terracast::geo
