#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "geo/camera_model.h"
#include "rigs/yaml_file.h"

/// What YAML of OpenCV's FileStorage and ROS's camera_info have in common.
namespace terracast::rigs {

/// Where a file states a camera's lens.
struct OpencvLensValues {
  YamlValue camera_matrix;
  std::optional<YamlValue> coefficients;
  YamlValue width;
  YamlValue height;
};

/// camera       for messages of coefficients that are not there
/// is_fisheye   whether the coefficients are a fisheye's
/// throws       as intrinsics_of_opencv(), and as is_fisheye
geo::CameraIntrinsics read_opencv_lens(
    const YamlValue& camera, const OpencvLensValues& values,
    const std::function<bool(const std::vector<double>& coefficients)>& is_fisheye);

/// Whether a file has keys that ROS writes beside the camera matrix, and OpenCV does not.
bool has_ros_keys(const YamlValue& file);

}  // namespace terracast::rigs
