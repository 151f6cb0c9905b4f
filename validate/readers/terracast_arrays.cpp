#include "validate/readers/terracast_arrays.h"

#include <cmath>
#include <limits>

namespace terracast::validate {

namespace {

/// Whether a ray comes in: images are of the cameras as they are, also where the tables of rays are of what is believed.
bool has_ray(const Intrinsics& camera, std::size_t index) {
  const auto columns = static_cast<std::size_t>(camera.width_px);
  return camera
      .ray_from_pixel(
          {static_cast<double>(index % columns) + 0.5, static_cast<double>(index / columns) + 0.5})
      .allFinite();
}

}  // namespace

std::string pixel_text(const std::string& path, std::size_t index, int width) {
  const auto columns = static_cast<std::size_t>(width);
  return fmt::format("{}: pixel ({}, {})", path, index % columns, index / columns);
}

core::ImageF read_range(const Dataset& dataset, const std::string& path, const Intrinsics& camera) {
  const std::vector<float> values = read_array<float>(dataset, path, camera, 0, 'f');
  core::ImageF range(camera.width_px, camera.height_px);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const float value = values[i];
    const bool is_seen = has_ray(camera, i);
    if (std::isnan(value) == is_seen)
      core::fail(core::ErrorKind::Input, "{}: range {} where {}",
                 pixel_text(path, i, camera.width_px), value,
                 is_seen ? "a ray comes in" : "no ray comes in");
    if (!std::isnan(value) && !(value > 0.0F))
      core::fail(core::ErrorKind::Input, "{}: range {}; above 0, or +inf for sky, is right",
                 pixel_text(path, i, camera.width_px), value);
    range.data()[i] = std::isinf(value) ? std::numeric_limits<float>::quiet_NaN() : value;
  }
  return range;
}

}  // namespace terracast::validate
