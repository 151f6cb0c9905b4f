#pragma once

#include <optional>

#include "geo/camera_model.h"

namespace terracast::geo {

/// Pixels a radian of a camera's image where they are most, and where half of its image has more and half has less.
struct FineRim {
  double finest_pixels_per_radian = 0.0;
  double usual_pixels_per_radian = 0.0;
};

/// Says of a camera whose pixels see next to no angle somewhere, as at the end of a wide lens's formula. The level of
/// detail serves the finest pixel, wherever a camera looks, so that such an image asks for all of a world at its finest.
/// returns   something where the finest pixels are more than 30 times as fine as the usual ones: of a row of a pinhole's
///           image they are never 4 times as fine. Nothing for cameras whose pixels span no angle (orthographic ones)
/// accuracy  usual: the median of 32 x 32 places, between neighbouring pixels
std::optional<FineRim> find_fine_rim(const CameraModel& camera);

}  // namespace terracast::geo
