#include "validate/evaluate/error_pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "validate/geometry.h"
#include "validate/pictures.h"
#include "validate/sampling.h"

namespace terracast::validate {

namespace {

constexpr int kMostPixels = 480;

using Color = std::array<double, 3>;
constexpr Color kUnjudged{190, 192, 196};
constexpr Color kMissing{214, 48, 190};

void set(core::Image8& image, int x, int y, const Color& color) {
  for (int c = 0; c < 3; ++c)
    image(x, y, c) = static_cast<std::uint8_t>(std::lround(color[static_cast<std::size_t>(c)]));
}

Color error_color(double share) {
  static constexpr std::array<Color, 5> kStops{
      {{23, 38, 92}, {32, 122, 140}, {122, 190, 90}, {250, 214, 70}, {190, 24, 32}}};
  const double at = std::clamp(share, 0.0, 1.0) * (kStops.size() - 1);
  const std::size_t index = std::min(static_cast<std::size_t>(at), kStops.size() - 2);
  Color color;
  for (std::size_t c = 0; c < 3; ++c)
    color[c] = kStops[index][c] +
               (at - static_cast<double>(index)) * (kStops[index + 1][c] - kStops[index][c]);
  return color;
}

/// Pure colours round the circle, whitened where the flow is short.
Color flow_color(double u, double v, double full) {
  const double turn = std::atan2(v, u) / (2.0 * kPi) + 0.5;
  const double strength = std::min(1.0, std::hypot(u, v) / full);
  Color color;
  for (std::size_t c = 0; c < 3; ++c) {
    const double away = std::abs(std::remainder(turn - static_cast<double>(c) / 3.0, 1.0));
    const double pure = std::clamp(2.0 - 6.0 * away, 0.0, 1.0);
    color[c] = 255.0 * (1.0 - strength * (1.0 - pure));
  }
  return color;
}

}  // namespace

core::Image8 error_picture(const core::ImageF& errors, float full) {
  core::Image8 picture(errors.width(), errors.height(), 3);
  for (int y = 0; y < errors.height(); ++y)
    for (int x = 0; x < errors.width(); ++x) {
      const float error = errors(x, y);
      set(picture, x, y,
          std::isnan(error)   ? kUnjudged
          : std::isinf(error) ? kMissing
                              : error_color(static_cast<double>(error / full)));
    }
  return picture;
}

float error_scale(const core::ImageF& errors, float least) {
  std::vector<float> finite;
  for (const float error : errors.data())
    if (std::isfinite(error)) finite.push_back(error);
  return std::max(least, static_cast<float>(quantile(finite, 0.99)));
}

core::Image8 flow_picture(const core::ImageF& flow, float full_px) {
  core::Image8 picture(flow.width(), flow.height(), 3);
  for (int y = 0; y < flow.height(); ++y)
    for (int x = 0; x < flow.width(); ++x) {
      const auto u = static_cast<double>(flow(x, y, 0)), v = static_cast<double>(flow(x, y, 1));
      set(picture, x, y,
          std::isfinite(u) ? flow_color(u, v, static_cast<double>(full_px)) : kUnjudged);
    }
  return picture;
}

float longest_flow(const core::ImageF& flow) {
  float longest = 1e-3F;
  for (int y = 0; y < flow.height(); ++y)
    for (int x = 0; x < flow.width(); ++x)
      if (std::isfinite(flow(x, y, 0)))
        longest = std::max(longest, std::hypot(flow(x, y, 0), flow(x, y, 1)));
  return longest;
}

CheckResult::Picture shown_picture(std::string title, const core::Image8& image) {
  return {std::move(title), shrunk(image, kMostPixels)};
}

CheckResult::Picture shown_errors(const std::string& what, const std::string& unit,
                                  const core::ImageF& errors, float least) {
  const float full = error_scale(errors, least);
  return {fmt::format("{}: blue 0 to red {:.3g} {}; grey not judged, magenta no result", what, full,
                      unit),
          error_picture(shrunk_nearest(errors, kMostPixels), full)};
}

}  // namespace terracast::validate
