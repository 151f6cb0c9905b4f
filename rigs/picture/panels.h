#pragma once

#include "rigs/picture/drawing.h"
#include "rigs/rig_view.h"

/// The parts of a rig's picture.
namespace terracast::rigs {

/// A rectangle of a drawing.
struct Panel {
  double left = 0.0, top = 0.0, width = 0.0, height = 0.0;
};

inline constexpr Color kInk = {34, 40, 49};
inline constexpr Color kFaintInk = {120, 128, 138};
inline constexpr Color kRule = {218, 222, 227};

/// One of a row of colours that are told apart, of equal weight to the eye.
Color color_of_camera(std::size_t camera, double opacity = 1.0);

/// A ray of the camera's frame.
struct BorderRay {
  Eigen::Vector3d origin_camera;
  Eigen::Vector3d direction_camera;
};

/// Rays of the border of an image, clockwise from its upper left corner, so many a side; those that there are.
std::vector<BorderRay> border_of(const geo::CameraModel& camera, int num_a_side);

void draw_frusta(Drawing& drawing, const Panel& panel, const RigView& rig);
void draw_coverage(Drawing& drawing, const Panel& panel, const RigView& rig);
/// What height is needed follows from the number of cameras.
void draw_overlaps(Drawing& drawing, const Panel& panel, const RigView& rig);
void draw_table(Drawing& drawing, const Panel& panel, const RigView& rig);

}  // namespace terracast::rigs
