#pragma once

#include "core/image.h"

/// Pictures for the report.
namespace terracast::validate {

/// -full to +full as blue, white, red; NaN grey.
core::Image8 diverging_picture(const core::ImageF& values, float full);
/// least to greatest as dark violet, green, yellow; NaN (sky) light blue. By the logarithm, as
/// depth is best told apart.
core::Image8 depth_picture(const core::ImageF& depth);
/// Every n-th pixel averaged so that the longer side is at most `most_px`.
core::Image8 shrunk(const core::Image8& image, int most_px);
core::ImageF shrunk_nearest(const core::ImageF& image, int most_px);

}  // namespace terracast::validate
