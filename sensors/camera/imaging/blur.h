#pragma once

#include "core/image.h"

namespace terracast::sensors {

/// Spreads each pixel's light as a Gaussian, cut off at three standard deviations. What would leave the
/// image is mirrored at its sides, so that the light of each channel stays the same in all: to 1e-5.
/// cost      2 (6 sd_px + 1) multiplications a value
/// threads   parallel by rows; the result does not depend on how many
core::ImageF blurred(const core::ImageF& image, double sd_px);

}  // namespace terracast::sensors
