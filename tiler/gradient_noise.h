#pragma once

#include <cmath>
#include <cstdint>

#include "core/random.h"

namespace terracast::tiler {

/// Gradient noise (Perlin 2002, with eight unit gradients and the quintic fade): zero, exactly,
/// where both coordinates are whole; twice continuously differentiable; about within [-0.8, 0.8].
/// stream   of the lattice's gradients
class GradientNoise {
 public:
  explicit GradientNoise(std::uint64_t seed, std::uint64_t stream)
      : key_(core::random_bits(seed, 0x6e6f697365ULL, stream)) {}

  double operator()(double x, double y) const {
    const double x0 = std::floor(x);
    const double y0 = std::floor(y);
    const double fx = x - x0;
    const double fy = y - y0;
    const auto ix = static_cast<std::int64_t>(x0);
    const auto iy = static_cast<std::int64_t>(y0);
    const double a = corner(ix, iy, fx, fy);
    const double b = corner(ix + 1, iy, fx - 1.0, fy);
    const double c = corner(ix, iy + 1, fx, fy - 1.0);
    const double d = corner(ix + 1, iy + 1, fx - 1.0, fy - 1.0);
    const double u = fade(fx);
    const double v = fade(fy);
    const double south = a + u * (b - a);
    const double north = c + u * (d - c);
    return south + v * (north - south);
  }

 private:
  static double fade(double t) { return t * t * t * (t * (t * 6.0 - 15.0) + 10.0); }

  double corner(std::int64_t ix, std::int64_t iy, double dx, double dy) const {
    std::uint64_t h = key_ ^ (static_cast<std::uint64_t>(ix) * 0x9e3779b97f4a7c15ULL);
    h = (h ^ (h >> 29)) * 0xbf58476d1ce4e5b9ULL;
    h ^= static_cast<std::uint64_t>(iy) * 0xd6e8feb86659fd93ULL;
    h = (h ^ (h >> 32)) * 0x94d049bb133111ebULL;
    const unsigned k = static_cast<unsigned>(h >> 60);
    return kGradients[k][0] * dx + kGradients[k][1] * dy;
  }

  // Sixteen directions, turned off the axes so that no ridge runs along the lattice.
  static constexpr double kGradients[16][2] = {
      {0.980785, 0.195090},   {0.831470, 0.555570},   {0.555570, 0.831470},
      {0.195090, 0.980785},   {-0.195090, 0.980785},  {-0.555570, 0.831470},
      {-0.831470, 0.555570},  {-0.980785, 0.195090},  {-0.980785, -0.195090},
      {-0.831470, -0.555570}, {-0.555570, -0.831470}, {-0.195090, -0.980785},
      {0.195090, -0.980785},  {0.555570, -0.831470},  {0.831470, -0.555570},
      {0.980785, -0.195090}};

  std::uint64_t key_;
};

/// Octaves of gradient noise, each of half the period and `gain` times the height of the one
/// before.
inline double fractal_noise(const GradientNoise& noise, double x, double y, int num_octaves,
                            double gain = 0.5) {
  double sum = 0.0;
  double amplitude = 1.0;
  for (int i = 0; i < num_octaves; ++i) {
    // Octaves are shifted, so that their zeros do not pile up at the lattice of the first.
    sum += amplitude * noise(x + 17.31 * i, y - 9.73 * i);
    x *= 2.0;
    y *= 2.0;
    amplitude *= gain;
  }
  return sum;
}

}  // namespace terracast::tiler
