#include "rigs/opencv_yaml.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "rigs/opencv_lens.h"

namespace terracast::rigs {

geo::CameraIntrinsics read_opencv_lens(
    const YamlValue& camera, const OpencvLensValues& values,
    const std::function<bool(const std::vector<double>& coefficients)>& is_fisheye) {
  const std::vector<double> coefficients =
      values.coefficients ? values.coefficients->matrix() : std::vector<double>{};
  const OpencvLens lens{.camera_matrix = values.camera_matrix.matrix(9),
                        .coefficients = coefficients,
                        .is_fisheye = is_fisheye(coefficients),
                        .width_px = values.width.size_px(),
                        .height_px = values.height.size_px()};
  return intrinsics_of_opencv(lens, values.camera_matrix.where(),
                              values.coefficients ? values.coefficients->where() : camera.where());
}

bool has_ros_keys(const YamlValue& file) {
  static constexpr std::array<std::string_view, 4> kKeys = {
      "distortion_model", "camera_model", "rectification_matrix", "projection_matrix"};
  return std::any_of(kKeys.begin(), kKeys.end(),
                     [&](std::string_view key) { return file.has(key); });
}

}  // namespace terracast::rigs
