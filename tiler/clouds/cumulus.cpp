#include "tiler/clouds/cumulus.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/parallel.h"
#include "core/random.h"

namespace terracast::tiler {
namespace {

constexpr double kPi = std::numbers::pi;

/// Numbers on a lattice, smooth between its points; -1 … 1.
class LatticeNoise {
 public:
  explicit LatticeNoise(std::uint64_t seed) : seed_(seed) {}

  double at(const Eigen::Vector3d& p) const {
    const Eigen::Array3d low = p.array().floor();
    const Eigen::Array3d t = p.array() - low;
    const Eigen::Array3d s = t * t * (3.0 - 2.0 * t);
    const auto value = [&](int i, int j, int k) {
      const auto part = [](double coordinate, int step) {
        return static_cast<std::uint64_t>(static_cast<std::int64_t>(coordinate) + step) & 0x1fffff;
      };
      const std::uint64_t index =
          part(low.x(), i) | part(low.y(), j) << 21 | part(low.z(), k) << 42;
      return core::random_between(-1.0, 1.0, seed_, 0x6e6f697365, index);
    };
    const auto along = [&](int j, int k) {
      const double first = value(0, j, k);
      return first + s.x() * (value(1, j, k) - first);
    };
    const auto plane = [&](int k) {
      const double first = along(0, k);
      return first + s.y() * (along(1, k) - first);
    };
    const double below = plane(0);
    return below + s.z() * (plane(1) - below);
  }

 private:
  std::uint64_t seed_;
};

double smooth_step(double x) {
  const double t = std::clamp(x, 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

/// Octaves of noise from a period on, each half as wide and `fall` as high as the one before.
double octaves(const LatticeNoise& noise, Eigen::Vector3d p, double period_m, int count,
               bool is_billowed, double fall = 0.55) {
  double sum = 0.0;
  double weight = 1.0;
  double all = 0.0;
  for (int octave = 0; octave < count; ++octave) {
    // Lattices that do not lie over each other.
    const double value = noise.at(p / period_m + Eigen::Vector3d(17.3, 5.9, 11.7) * octave);
    sum += weight * (is_billowed ? 2.0 * std::abs(value) - 0.7 : value);
    all += weight;
    weight *= fall;
    period_m *= 0.5;
  }
  return sum / all;
}

/// Sets a volume's densities by place, in its own frame.
template <class Density>
void fill(world::Volume& volume, const Density& density) {
  volume.density.resize(static_cast<std::size_t>(volume.size.cast<double>().prod()));
  core::parallel_for(volume.size.z(), [&](std::int64_t layer) {
    const int z = static_cast<int>(layer);
    for (int y = 0; y < volume.size.y(); ++y)
      for (int x = 0; x < volume.size.x(); ++x) {
        const Eigen::Vector3d at =
            volume.lowest_m + volume.voxel_m * (Eigen::Vector3d(x, y, z).array() + 0.5).matrix();
        volume.density[volume.index(x, y, z)] =
            static_cast<std::uint8_t>(std::clamp(density(at), 0.0, 1.0) * 255.0 + 0.5);
      }
  });
}

struct Heap {
  Eigen::Vector3d middle_m;
  double radius_m;
};

}  // namespace

world::Volume make_cumulus(std::uint64_t seed, int number) {
  const std::uint64_t own = core::stream_of(seed, static_cast<std::uint64_t>(number));
  std::uint64_t question = 0;
  const auto drawn = [&](double lowest, double highest) {
    return core::random_between(lowest, highest, own, 0x68656170, question++);
  };
  // Wide heaps below, smaller ones on them, leaning toward the tallest.
  std::vector<Heap> heaps;
  const double width_m = drawn(420.0, 620.0);
  const double stretch = drawn(0.6, 1.0);
  const int num_feet = static_cast<int>(drawn(7.0, 11.0));
  for (int i = 0; i < num_feet; ++i) {
    const double turn = drawn(0.0, 2.0 * kPi);
    const double out = std::sqrt(drawn(0.0, 1.0));
    const double radius_m = drawn(150.0, 300.0) * (1.15 - 0.55 * out);
    heaps.push_back({{out * width_m * std::cos(turn), stretch * out * width_m * std::sin(turn),
                      drawn(0.1, 0.7) * radius_m},
                     radius_m});
  }
  const int num_towers = static_cast<int>(drawn(4.0, 9.0));
  for (int i = 0; i < num_towers; ++i) {
    const Heap foot = heaps[static_cast<std::size_t>(drawn(0.0, num_feet - 0.01))];
    const double turn = drawn(0.0, 2.0 * kPi);
    const double radius_m = foot.radius_m * drawn(0.45, 0.85);
    heaps.push_back({foot.middle_m + Eigen::Vector3d(0.45 * foot.radius_m * std::cos(turn),
                                                     0.45 * foot.radius_m * std::sin(turn),
                                                     foot.radius_m * drawn(0.5, 1.0)),
                     radius_m});
  }
  world::Volume volume;
  volume.name = fmt::format("cumulus {}", number);
  volume.voxel_m = 12.0;
  volume.size = {160, 160, 96};
  volume.lowest_m = {-960.0, -960.0, -40.0};
  const LatticeNoise noise(own);
  fill(volume, [&](const Eigen::Vector3d& at) {
    // Signed distance into the union of the heaps, smoothed where they meet.
    double inside_m = -1e9;
    for (const Heap& heap : heaps) {
      const double own_m = heap.radius_m - (at - heap.middle_m).norm();
      constexpr double kBlend_m = 50.0;
      const double h = std::clamp(0.5 + 0.5 * (own_m - inside_m) / kBlend_m, 0.0, 1.0);
      inside_m = inside_m + h * (own_m - inside_m) + kBlend_m * h * (1.0 - h);
    }
    // Billows move the surface by 150 m at most.
    if (inside_m < -170.0) return 0.0;
    const double wisps = octaves(noise, at + Eigen::Vector3d(900.0, 0.0, 0.0), 90.0, 4, false);
    double edge_m = inside_m;
    if (inside_m < 220.0) edge_m += 115.0 * octaves(noise, at, 260.0, 5, true, 0.74) + 26.0 * wisps;
    // The base lies where air that rises begins to condense: lower where it is moister.
    const double lumps =
        at.z() < 90.0 ? octaves(noise, {at.x(), at.y() + 700.0, 0.5 * at.z()}, 150.0, 4, true, 0.65)
                      : 0.0;
    const double base = smooth_step((at.z() + 26.0 * lumps + 14.0 * wisps + 4.0) / 26.0);
    // Nothing reaches the volume's sides.
    const double side = smooth_step((940.0 - at.head<2>().cwiseAbs().maxCoeff()) / 120.0) *
                        smooth_step((1060.0 - at.z()) / 120.0);
    return smooth_step(edge_m / 24.0) * base * side * (0.7 + 0.3 * smooth_step(at.z() / 500.0));
  });
  return volume;
}

world::Volume make_fog(std::uint64_t seed) {
  world::Volume volume;
  volume.name = "fog";
  volume.voxel_m = 25.0;
  volume.size = {128, 128, 10};
  volume.lowest_m = {-1600.0, -1600.0, -50.0};
  const LatticeNoise noise(core::stream_of(seed, 0x666f67));
  fill(volume, [&](const Eigen::Vector3d& at) {
    const double patches = octaves(noise, {at.x(), at.y(), 0.0}, 700.0, 4, false);
    const double wisps = octaves(noise, {at.x(), at.y(), 2.0 * at.z()}, 160.0, 3, false);
    const double top_m = 95.0 + 70.0 * patches + 30.0 * wisps;
    const double rim = smooth_step((1560.0 - at.head<2>().norm()) / 700.0);
    return smooth_step((top_m - at.z()) / 60.0) * rim * (0.75 + 0.25 * wisps);
  });
  return volume;
}

}  // namespace terracast::tiler
