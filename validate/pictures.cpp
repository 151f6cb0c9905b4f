#include "validate/pictures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace terracast::validate {

namespace {

using Color = std::array<double, 3>;

/// Between stops that are evenly spaced over 0 to 1.
template <std::size_t count>
Color blend(const std::array<Color, count>& stops, double t) {
  const double at = std::clamp(t, 0.0, 1.0) * static_cast<double>(count - 1);
  const auto index = std::min(static_cast<std::size_t>(at), count - 2);
  const double fraction = at - static_cast<double>(index);
  Color color;
  for (std::size_t c = 0; c < 3; ++c)
    color[c] = stops[index][c] + fraction * (stops[index + 1][c] - stops[index][c]);
  return color;
}

void set(core::Image8& image, int x, int y, const Color& color) {
  for (int c = 0; c < 3; ++c)
    image(x, y, c) = static_cast<std::uint8_t>(std::lround(color[static_cast<std::size_t>(c)]));
}

int step_for(int width, int height, int most_px) {
  return std::max(1, (std::max(width, height) + most_px - 1) / most_px);
}

}  // namespace

core::Image8 diverging_picture(const core::ImageF& values, float full) {
  static constexpr std::array<Color, 5> kStops{
      {{33, 82, 160}, {146, 183, 222}, {247, 247, 244}, {240, 160, 128}, {178, 34, 40}}};
  core::Image8 picture(values.width(), values.height(), 3);
  for (int y = 0; y < values.height(); ++y)
    for (int x = 0; x < values.width(); ++x) {
      const float value = values(x, y);
      set(picture, x, y,
          std::isfinite(value) ? blend(kStops, 0.5 + 0.5 * static_cast<double>(value / full))
                               : Color{190, 192, 196});
    }
  return picture;
}

core::Image8 depth_picture(const core::ImageF& depth) {
  static constexpr std::array<Color, 6> kStops{
      {{253, 231, 80}, {122, 207, 92}, {36, 165, 134}, {44, 113, 142}, {66, 64, 134}, {52, 8, 76}}};
  std::vector<float> logarithms;
  for (const float value : depth.data())
    if (std::isfinite(value) && value > 0.0F) logarithms.push_back(std::log(value));
  core::Image8 picture(depth.width(), depth.height(), 3);
  double least = 0.0;
  double greatest = 1.0;
  if (!logarithms.empty()) {  // the outermost percent would leave too few colours for the rest
    std::sort(logarithms.begin(), logarithms.end());
    least = static_cast<double>(logarithms[logarithms.size() / 100]);
    greatest =
        std::max(least + 1e-3,
                 static_cast<double>(logarithms[logarithms.size() - 1 - logarithms.size() / 100]));
  }
  for (int y = 0; y < depth.height(); ++y)
    for (int x = 0; x < depth.width(); ++x) {
      const float value = depth(x, y);
      set(picture, x, y,
          std::isfinite(value) && value > 0.0F
              ? blend(kStops, (std::log(static_cast<double>(value)) - least) / (greatest - least))
              : Color{214, 230, 244});
    }
  return picture;
}

core::Image8 shrunk(const core::Image8& image, int most_px) {
  const int step = step_for(image.width(), image.height(), most_px);
  core::Image8 small(image.width() / step, image.height() / step, image.channels());
  for (int y = 0; y < small.height(); ++y)
    for (int x = 0; x < small.width(); ++x)
      for (int c = 0; c < image.channels(); ++c) {
        int sum = 0;
        for (int dy = 0; dy < step; ++dy)
          for (int dx = 0; dx < step; ++dx) sum += image(step * x + dx, step * y + dy, c);
        small(x, y, c) = static_cast<std::uint8_t>((sum + step * step / 2) / (step * step));
      }
  return small;
}

core::ImageF shrunk_nearest(const core::ImageF& image, int most_px) {
  const int step = step_for(image.width(), image.height(), most_px);
  core::ImageF small(image.width() / step, image.height() / step, image.channels());
  for (int y = 0; y < small.height(); ++y)
    for (int x = 0; x < small.width(); ++x)
      for (int c = 0; c < image.channels(); ++c)
        small(x, y, c) = image(step * x + step / 2, step * y + step / 2, c);
  return small;
}

}  // namespace terracast::validate
