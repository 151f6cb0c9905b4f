#include "sensors/camera/imaging/soiling.h"

#include <algorithm>
#include <cmath>

#include "core/random.h"
#include "sensors/camera/imaging/blur.h"

namespace terracast::sensors {
namespace {

/// What is drawn of a spot.
enum Draw : std::uint64_t { kPlaceX, kPlaceY, kSize, kNumDraws };

/// Draws spots into what is left of the light.
/// mean_radius_px, strength   of their middle
core::ImageF draw_spots(std::int64_t count, double mean_radius_px, double strength, int width_px,
                        int height_px, std::uint64_t seed, std::uint64_t stream) {
  if (count == 0) return {};
  core::ImageF left(width_px, height_px, 1, 1.0f);
  for (std::int64_t spot = 0; spot < count; ++spot) {
    const auto draw = [&](Draw which) {
      return core::random_unit(seed, stream, static_cast<std::uint64_t>(spot) * kNumDraws + which);
    };
    const double center_x = draw(kPlaceX) * width_px;
    const double center_y = draw(kPlaceY) * height_px;
    const double radius = std::max(mean_radius_px * (0.5 + draw(kSize)), 0.5);
    const auto first = [&](double center) {
      return std::max(static_cast<int>(std::floor(center - radius)), 0);
    };
    const auto end = [&](double center, int size) {
      return std::min(static_cast<int>(std::ceil(center + radius)), size);
    };
    for (int y = first(center_y); y < end(center_y, height_px); ++y)
      for (int x = first(center_x); x < end(center_x, width_px); ++x) {
        const double dx = (x + 0.5 - center_x) / radius;
        const double dy = (y + 0.5 - center_y) / radius;
        const double within = std::max(1.0 - dx * dx - dy * dy, 0.0);
        left(x, y) *= static_cast<float>(1.0 - strength * within * within);
      }
  }
  for (float& value : left.data()) value = 1.0f - value;
  return left;
}

}  // namespace

Soiling draw_soiling(const SoilingOptions& options, int width_px, int height_px, std::uint64_t seed,
                     std::uint64_t stream) {
  constexpr std::uint64_t kSmudges = 0x736d75646765;  // "smudge"
  constexpr std::uint64_t kDirt = 0x64697274;         // "dirt"
  return {
      .haze = draw_spots(options.smudges, options.smudge_size * width_px, options.smudge_haze,
                         width_px, height_px, seed, core::stream_of(stream, kSmudges)),
      .opacity = draw_spots(options.dirt_spots, options.dirt_size * width_px, options.dirt_opacity,
                            width_px, height_px, seed, core::stream_of(stream, kDirt))};
}

void lay_soiling(const SoilingOptions& options, const Soiling& soiling, core::ImageF& image) {
  if (!soiling.haze.empty()) {
    const core::ImageF scattered = blurred(image, options.smudge_radius_px);
    for (std::size_t i = 0; i < image.data().size(); ++i)
      image.data()[i] += soiling.haze.data()[i / 3] * (scattered.data()[i] - image.data()[i]);
  }
  if (!soiling.opacity.empty())
    for (std::size_t i = 0; i < image.data().size(); ++i)
      image.data()[i] *= 1.0f - soiling.opacity.data()[i / 3];
}

}  // namespace terracast::sensors
