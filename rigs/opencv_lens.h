#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "geo/camera_model.h"

namespace terracast::rigs {

/// Our model for so many distortion coefficients of OpenCV: k1 k2 p1 p2 [k3 [k4 k5 k6]], of a fisheye k1 k2 k3 k4.
struct OpencvModel {
  std::string_view model;
  std::size_t num_coefficients;
  bool is_fisheye;
};
inline constexpr std::array kOpencvModels = {
    OpencvModel{"pinhole", 0, false},
    OpencvModel{"opencv", 4, false},
    OpencvModel{"full_opencv", 8, false},
    OpencvModel{"opencv_fisheye", 4, true},
};

/// A camera as OpenCV's functions take it.
struct OpencvLens {
  std::vector<double> camera_matrix;  ///< fx 0 cx / 0 fy cy / 0 0 1, row by row; pixels count from
                                      ///< the first one's centre
  std::vector<double> coefficients;   ///< k1 k2 p1 p2 [k3 [k4 k5 k6 [s1 s2 s3 s4 [tx ty]]]], of a
                                      ///< fisheye k1 k2 k3 k4
  bool is_fisheye = false;
  int width_px = 0;
  int height_px = 0;
};

/// Our model of a lens: the smallest of pinhole, opencv and full_opencv that holds its coefficients, or opencv_fisheye.
/// where_matrix, where_coefficients   name the file, line and key
/// throws   Input: another matrix, as of a skewed sensor; another number of coefficients; thin prisms or a tilted
///          sensor, which no model has
geo::CameraIntrinsics intrinsics_of_opencv(const OpencvLens& lens, std::string_view where_matrix,
                                           std::string_view where_coefficients);

/// Whether a distortion model, by the names that ROS has for OpenCV's, is a fisheye's; "" is plumb_bob.
/// throws   Input: it is not known, or "none" beside coefficients that are not 0
bool is_fisheye_model(std::string_view name, const std::vector<double>& coefficients,
                      std::string_view where);

}  // namespace terracast::rigs
