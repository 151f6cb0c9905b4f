#include "rigs/picture/rig_picture.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "rigs/picture/panels.h"

namespace terracast::rigs {

Color color_of_camera(std::size_t camera, double opacity) {
  // Hues a golden angle apart, in OKLCH (B. Ottosson, 2020), every second one darker.
  const double hue = 0.5 + std::numbers::pi * (3.0 - std::sqrt(5.0)) * static_cast<double>(camera);
  const double lightness = camera % 2 == 0 ? 0.62 : 0.52;
  const double a = 0.15 * std::cos(hue), b = 0.15 * std::sin(hue);
  const double l = std::pow(lightness + 0.3963377774 * a + 0.2158037573 * b, 3);
  const double m = std::pow(lightness - 0.1055613458 * a - 0.0638541728 * b, 3);
  const double s = std::pow(lightness - 0.0894841775 * a - 1.2914855480 * b, 3);
  const auto coded = [](double linear) {
    const double value =
        linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
    return static_cast<std::uint8_t>(std::lround(255.0 * std::clamp(value, 0.0, 1.0)));
  };
  return {coded(4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s),
          coded(-1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s),
          coded(-0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s), opacity};
}

std::vector<BorderRay> border_of(const geo::CameraModel& camera, int num_a_side) {
  const double w = camera.width_px(), h = camera.height_px();
  const Eigen::Vector2d corners[] = {{0.0, 0.0}, {w, 0.0}, {w, h}, {0.0, h}};
  std::vector<BorderRay> rays;
  for (int side = 0; side < 4; ++side)
    for (int k = 0; k < num_a_side; ++k) {
      const Eigen::Vector2d pixel =
          corners[side] + (corners[(side + 1) % 4] - corners[side]) * (double(k) / num_a_side);
      const Eigen::Vector3d ray = camera.ray_from_pixel(pixel);
      if (ray.allFinite()) rays.push_back({camera.origin_from_pixel(pixel), ray});
    }
  return rays;
}

Drawing draw_rig(const RigView& rig) {
  constexpr int kWidth = 1200;
  constexpr double kMargin = 30.0;
  const auto num_cameras = static_cast<double>(rig.cameras().size());
  const Panel frusta{.left = kMargin, .top = 70.0, .width = 540.0, .height = 430.0};
  const Panel coverage{.left = 600.0, .top = 70.0, .width = 570.0, .height = 430.0};
  const Panel overlaps{
      .left = kMargin, .top = 520.0, .width = 540.0, .height = 70.0 + 23.0 * num_cameras};
  const Panel table{.left = 600.0, .top = 520.0, .width = 570.0, .height = overlaps.height};
  Drawing drawing(kWidth, static_cast<int>(overlaps.top + overlaps.height + kMargin));
  drawing.add(Label{{kMargin, 42.0}, rig.name(), 24.0, Anchor::Start, kInk});
  drawing.add(
      Label{{kWidth - kMargin, 42.0},
            fmt::format("{} camera{}", rig.cameras().size(), rig.cameras().size() == 1 ? "" : "s"),
            15.0,
            Anchor::End,
            kFaintInk});
  draw_frusta(drawing, frusta, rig);
  draw_coverage(drawing, coverage, rig);
  draw_overlaps(drawing, overlaps, rig);
  draw_table(drawing, table, rig);
  return drawing;
}

}  // namespace terracast::rigs
