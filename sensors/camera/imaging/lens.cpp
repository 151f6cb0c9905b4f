#include "sensors/camera/imaging/lens.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/parallel.h"
#include "sensors/camera/imaging/blur.h"

namespace terracast::sensors {
namespace {

constexpr int kRowsAtOnce = 16;
constexpr int kRed = 0;
constexpr int kBlue = 2;

/// The four samples about a place along one axis, and their weights.
struct CubicTaps {
  std::array<int, 4> at;
  std::array<float, 4> weight;
};

/// place   of sample centres at whole numbers
CubicTaps taps_at(double place, int count) {
  const double floor = std::floor(place);
  const auto t = static_cast<float>(place - floor);
  CubicTaps taps;
  for (int k = 0; k < 4; ++k)
    taps.at[static_cast<std::size_t>(k)] =
        std::clamp(static_cast<int>(floor) - 1 + k, 0, count - 1);
  taps.weight = {0.5f * t * (-1.0f + t * (2.0f - t)), 1.0f + 0.5f * t * t * (-5.0f + 3.0f * t),
                 0.5f * t * (1.0f + t * (4.0f - 3.0f * t)), 0.5f * t * t * (t - 1.0f)};
  return taps;
}

float sample(const core::ImageF& image, const CubicTaps& along_x, const CubicTaps& along_y,
             int channel) {
  float sum = 0.0f;
  for (std::size_t j = 0; j < 4; ++j) {
    float row = 0.0f;
    for (std::size_t i = 0; i < 4; ++i)
      row += along_x.weight[i] * image(along_x.at[i], along_y.at[j], channel);
    sum += along_y.weight[j] * row;
  }
  const std::array<float, 4> nearest = {
      image(along_x.at[1], along_y.at[1], channel), image(along_x.at[2], along_y.at[1], channel),
      image(along_x.at[1], along_y.at[2], channel), image(along_x.at[2], along_y.at[2], channel)};
  const auto [lowest, highest] = std::minmax_element(nearest.begin(), nearest.end());
  return std::clamp(sum, *lowest, *highest);
}

void scale_channel(double scale, int channel, const Eigen::Vector2d& center_px,
                   const core::ImageF& from, core::ImageF& to) {
  const auto taps = [&](int pixel, double center, int count) {
    return taps_at(center + (pixel + 0.5 - center) / scale - 0.5, count);
  };
  std::vector<CubicTaps> columns;
  for (int x = 0; x < from.width(); ++x) columns.push_back(taps(x, center_px.x(), from.width()));
  core::parallel_for_blocks(from.height(), kRowsAtOnce, [&](std::int64_t begin, std::int64_t end) {
    for (auto y = static_cast<int>(begin); y < end; ++y) {
      const CubicTaps row = taps(y, center_px.y(), from.height());
      for (int x = 0; x < from.width(); ++x)
        to(x, y, channel) = sample(from, columns[static_cast<std::size_t>(x)], row, channel);
    }
  });
}

}  // namespace

Eigen::Vector2d optical_center_px(const geo::CameraModel& model) {
  const std::optional<Eigen::Vector2d> center = model.pixel_from_ray(Eigen::Vector3d::UnitZ());
  return center ? *center : Eigen::Vector2d(0.5 * model.width_px(), 0.5 * model.height_px());
}

core::ImageF vignetting_of(const LensFlawOptions& options, const geo::CameraModel& model) {
  const Eigen::Vector2d center = optical_center_px(model);
  const Eigen::Vector2d size(model.width_px(), model.height_px());
  const double corner_px = center.cwiseMax(size - center).norm();
  std::vector<double> a = options.vignetting_polynomial;
  a.resize(3, 0.0);
  core::ImageF share(model.width_px(), model.height_px());
  core::parallel_for_blocks(share.height(), kRowsAtOnce, [&](std::int64_t begin, std::int64_t end) {
    for (auto y = static_cast<int>(begin); y < end; ++y)
      for (int x = 0; x < share.width(); ++x) {
        const Eigen::Vector2d place(x + 0.5, y + 0.5);
        const Eigen::Vector3d ray = model.ray_from_pixel(place).normalized();
        if (!ray.allFinite()) continue;
        const double r2 = (place - center).squaredNorm() / (corner_px * corner_px);
        share(x, y) =
            static_cast<float>(std::pow(std::max(ray.z(), 0.0), options.vignetting_exponent) *
                               (1.0 + r2 * (a[0] + r2 * (a[1] + r2 * a[2]))));
      }
  });
  return share;
}

void scale_colors(const LensFlawOptions& options, const Eigen::Vector2d& center_px,
                  core::ImageF& image) {
  if (options.red_scale_permille == 0.0 && options.blue_scale_permille == 0.0) return;
  const core::ImageF sharp = image;
  if (options.red_scale_permille != 0.0)
    scale_channel(1.0 + 1e-3 * options.red_scale_permille, kRed, center_px, sharp, image);
  if (options.blue_scale_permille != 0.0)
    scale_channel(1.0 + 1e-3 * options.blue_scale_permille, kBlue, center_px, sharp, image);
}

void add_glare(const LensFlawOptions& options, core::ImageF& image) {
  if (options.bloom > 0.0) {
    const core::ImageF spread = blurred(image, options.bloom_radius_px);
    const auto share = static_cast<float>(options.bloom);
    for (std::size_t i = 0; i < image.data().size(); ++i)
      image.data()[i] += share * (spread.data()[i] - image.data()[i]);
  }
  if (options.veiling_glare > 0.0) {
    std::array<double, 3> sums = {};
    for (std::size_t i = 0; i < image.data().size(); ++i) sums[i % 3] += double{image.data()[i]};
    std::array<float, 3> veil;
    for (std::size_t k = 0; k < 3; ++k)
      veil[k] = static_cast<float>(options.veiling_glare * sums[k] /
                                   static_cast<double>(image.num_pixels()));
    const auto left = static_cast<float>(1.0 - options.veiling_glare);
    for (std::size_t i = 0; i < image.data().size(); ++i)
      image.data()[i] = left * image.data()[i] + veil[i % 3];
  }
}

}  // namespace terracast::sensors
