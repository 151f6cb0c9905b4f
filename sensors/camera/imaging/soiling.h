#pragma once

#include <cstdint>

#include "core/image.h"
#include "sensors/camera/imaging/imaging_options.h"

namespace terracast::sensors {

/// What lies on a lens, by pixel; one channel each.
struct Soiling {
  core::ImageF haze;     ///< share of the light that is scattered; empty: nowhere
  core::ImageF opacity;  ///< share that is taken; empty: nowhere
};

/// Spots of random places and sizes (0.5 to 1.5 times the mean), out of focus: strongest in their middle
/// and, as (1 - d^2)^2, nothing at their radius. Where several lie the light passes one after the other.
/// stream   of the camera's draws in its sequence
Soiling draw_soiling(const SoilingOptions& options, int width_px, int height_px, std::uint64_t seed,
                     std::uint64_t stream);

/// Smudges scatter their share of the light as a Gaussian; of what comes then dirt takes its share. An image of
/// one colour loses what dirt takes, and nothing to smudges.
void lay_soiling(const SoilingOptions& options, const Soiling& soiling, core::ImageF& image);

}  // namespace terracast::sensors
