#pragma once

#include <Eigen/Core>

#include "core/image.h"
#include "geo/camera_model.h"
#include "sensors/camera/imaging/imaging_options.h"

/// What a lens does to light on its way to the pixels: images are linear, of three channels.
namespace terracast::sensors {

/// Where the optical axis stands in the image; its middle in models that do not see along it.
Eigen::Vector2d optical_center_px(const geo::CameraModel& model);

/// Share of the light that vignetting leaves each pixel: cos^n of the angle between the ray through the
/// pixel's centre, as the model has it, and the optical axis, times the polynomial.
/// returns   one channel; 0 where no ray comes in
core::ImageF vignetting_of(const LensFlawOptions& options, const geo::CameraModel& model);

/// Lateral chromatic aberration: red and blue of another size than green. A pixel at p shows what without
/// it stands at center + (p - center) / scale, by Catmull and Rom's cubic, kept within the four nearest
/// values so that light beside what glares is not below any of them. Beyond the image its border goes on.
void scale_colors(const LensFlawOptions& options, const Eigen::Vector2d& center_px,
                  core::ImageF& image);

/// Veiling glare spreads its share evenly over the image, bloom as a Gaussian. The light of all pixels
/// together stays what it was, to 1e-5.
void add_glare(const LensFlawOptions& options, core::ImageF& image);

}  // namespace terracast::sensors
