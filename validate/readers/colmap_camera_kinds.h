#pragma once

#include <array>

namespace terracast::validate {

/// A camera model of COLMAP's; its number is its place in the table.
struct ColmapCameraKind {
  const char* name;
  int num_parameters;
};
inline constexpr std::array<ColmapCameraKind, 11> kColmapCameraKinds = {
    {{"SIMPLE_PINHOLE", 3},
     {"PINHOLE", 4},
     {"SIMPLE_RADIAL", 4},
     {"RADIAL", 5},
     {"OPENCV", 8},
     {"OPENCV_FISHEYE", 8},
     {"FULL_OPENCV", 12},
     {"FOV", 5},
     {"SIMPLE_RADIAL_FISHEYE", 4},
     {"RADIAL_FISHEYE", 5},
     {"THIN_PRISM_FISHEYE", 12}}};

}  // namespace terracast::validate
