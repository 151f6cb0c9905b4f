#include "sensors/camera/imaging/blur.h"

#include <cmath>
#include <vector>

#include "core/parallel.h"

namespace terracast::sensors {
namespace {

constexpr int kRowsAtOnce = 16;

/// Weights of the places -radius … radius, of sum 1.
std::vector<float> gaussian(double sd_px) {
  const int radius = static_cast<int>(std::ceil(3.0 * sd_px));
  std::vector<double> weights;
  double sum = 0.0;
  for (int k = -radius; k <= radius; ++k) {
    weights.push_back(std::exp(-0.5 * k * k / (sd_px * sd_px)));
    sum += weights.back();
  }
  std::vector<float> kernel;
  for (const double weight : weights) kernel.push_back(static_cast<float>(weight / sum));
  return kernel;
}

/// The pixel of 0 … count - 1 that stands at a place, mirrors standing at both ends.
int mirrored(int place, int count) {
  const int period = 2 * count;
  const int within = ((place % period) + period) % period;
  return within < count ? within : period - 1 - within;
}

template <class Body>
void for_each_row(int num_rows, const Body& body) {
  core::parallel_for_blocks(num_rows, kRowsAtOnce, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t y = begin; y < end; ++y) body(static_cast<int>(y));
  });
}

void add(float weight, const float* from, std::size_t count, float* to) {
  for (std::size_t i = 0; i < count; ++i) to[i] += weight * from[i];
}

}  // namespace

core::ImageF blurred(const core::ImageF& image, double sd_px) {
  const std::vector<float> kernel = gaussian(sd_px);
  const int radius = static_cast<int>(kernel.size() / 2);
  const auto channels = static_cast<std::size_t>(image.channels());
  core::ImageF across(image.width(), image.height(), image.channels());
  for_each_row(image.height(), [&](int y) {
    std::vector<float> widened;
    widened.reserve(image.row_size() + 2 * static_cast<std::size_t>(radius) * channels);
    for (int x = -radius; x < image.width() + radius; ++x)
      for (int k = 0; k < image.channels(); ++k)
        widened.push_back(image(mirrored(x, image.width()), y, k));
    for (std::size_t k = 0; k < kernel.size(); ++k)
      add(kernel[k], widened.data() + k * channels, across.row_size(), across.row(y).data());
  });
  core::ImageF both(image.width(), image.height(), image.channels());
  for_each_row(image.height(), [&](int y) {
    for (std::size_t k = 0; k < kernel.size(); ++k) {
      const int from = mirrored(y - radius + static_cast<int>(k), image.height());
      add(kernel[k], across.row(from).data(), across.row_size(), both.row(y).data());
    }
  });
  return both;
}

}  // namespace terracast::sensors
