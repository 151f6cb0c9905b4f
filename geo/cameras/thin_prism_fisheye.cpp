#include <array>

#include "geo/cameras/equidistant_camera.h"

namespace terracast::geo {
namespace {

constexpr std::array kParameters = {
    CameraParameter{"k1", "Of t^3 in the radius, t being the angle from the axis."},
    CameraParameter{"k2", "Of t^5."},
    CameraParameter{"p1", "Decentring along y."},
    CameraParameter{"p2", "Decentring along x."},
    CameraParameter{"k3", "Of t^7."},
    CameraParameter{"k4", "Of t^9."},
    CameraParameter{"sx1", "Thin prism along x, of t^2."},
    CameraParameter{"sy1", "Thin prism along y, of t^2."}};

/// source   THIN_PRISM_FISHEYE of COLMAP (src/base/camera_models.h), ETH3D's; J. Weng, P. Cohen,
///          M. Herniou, PAMI 14 (1992); plane_distortion.h
std::unique_ptr<CameraModel> make_thin_prism_fisheye(const CameraIntrinsics& intrinsics) {
  const double* own = &intrinsics.parameters[4];
  return std::make_unique<EquidistantCamera>(
      intrinsics,
      PlaneDistortion::Coefficients{
          .k = {own[0], own[1], own[4], own[5]}, .p = {own[2], own[3]}, .prism = {own[6], own[7]}});
}

}  // namespace

CameraModelInfo thin_prism_fisheye_camera() {
  return {.name = "thin_prism_fisheye",
          .summary = "Fisheye with decentring and thin prisms, as COLMAP's.",
          .parameters = kParameters,
          .make = make_thin_prism_fisheye};
}

}  // namespace terracast::geo
