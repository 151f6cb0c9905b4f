#include "tiler/clouds/cumulus.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/parallel.h"
#include "core/random.h"

namespace terracast::tiler {
namespace {

constexpr double kPi = std::numbers::pi;

/// Gradient noise on a lattice (Perlin 2002): smooth, without the lattice's cubes in it; about -1 … 1.
class LatticeNoise {
 public:
  explicit LatticeNoise(std::uint64_t seed) : seed_(seed) {}

  double at(const Eigen::Vector3d& p) const {
    const Eigen::Array3d low = p.array().floor();
    const Eigen::Array3d t = p.array() - low;
    const Eigen::Array3d s = t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    const auto value = [&](int i, int j, int k) {
      const auto part = [](double coordinate, int step) {
        return static_cast<std::uint64_t>(static_cast<std::int64_t>(coordinate) + step) & 0x1fffff;
      };
      const std::uint64_t index =
          part(low.x(), i) | part(low.y(), j) << 21 | part(low.z(), k) << 42;
      return slope_along(core::random_bits(seed_, 0x6e6f697365, index), t.x() - i, t.y() - j,
                         t.z() - k);
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
  /// Rise along (x, y, z) of one of the twelve slopes toward the middles of a cube's edges.
  static double slope_along(std::uint64_t bits, double x, double y, double z) {
    const unsigned edge = static_cast<unsigned>(bits >> 32) % 12U;
    const double first = edge < 8U ? x : y;
    const double second = edge < 4U ? y : z;
    return ((edge & 1U) != 0 ? -first : first) + ((edge & 2U) != 0 ? -second : second);
  }

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
    sum += weight * (is_billowed ? 2.4 * std::abs(value) - 0.6 : 1.3 * value);
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

struct Range {
  double lowest, highest;
};

/// What clouds of one kind have in common.
struct Form {
  Range width_m;      ///< from the middle to the outermost feet
  Range stretch;      ///< of the narrow side against the wide one
  Range num_feet;     ///< heaps that stand on the base
  Range foot_m;       ///< radius of them
  Range num_towers;   ///< heaps on others, each smaller than what bears it
  Range tower_share;  ///< of its radius
  double billow_m;    ///< by how much billows move the surface, about
  double edge_m;      ///< over which it thins out where it is sharpest
  double torn_m;      ///< by how much dry air eats into it in places
  double density;     ///< in its middle
};

/// From towering to torn: congestus, two of mediocris, two of humilis, fractus.
constexpr std::array<Form, 6> kForms = {{
    {{330.0, 450.0},
     {0.7, 1.0},
     {8.0, 11.0},
     {260.0, 400.0},
     {10.0, 16.0},
     {0.55, 0.90},
     170.0,
     15.0,
     20.0,
     1.0},
    {{380.0, 520.0},
     {0.6, 1.0},
     {8.0, 12.0},
     {240.0, 370.0},
     {7.0, 12.0},
     {0.45, 0.85},
     160.0,
     15.0,
     30.0,
     1.0},
    {{400.0, 560.0},
     {0.5, 0.8},
     {8.0, 12.0},
     {230.0, 350.0},
     {5.0, 9.0},
     {0.45, 0.80},
     150.0,
     16.0,
     40.0,
     1.0},
    {{440.0, 600.0},
     {0.5, 0.9},
     {9.0, 13.0},
     {190.0, 310.0},
     {3.0, 6.0},
     {0.50, 0.80},
     130.0,
     18.0,
     45.0,
     0.9},
    {{440.0, 620.0},
     {0.3, 0.6},
     {9.0, 13.0},
     {180.0, 290.0},
     {2.0, 5.0},
     {0.45, 0.75},
     120.0,
     20.0,
     55.0,
     0.85},
    {{400.0, 600.0},
     {0.3, 0.7},
     {9.0, 14.0},
     {165.0, 270.0},
     {1.0, 3.0},
     {0.40, 0.70},
     130.0,
     30.0,
     90.0,
     0.6},
}};

struct Heap {
  Eigen::Vector3d middle_m;
  double radius_m;
};

/// Wide heaps on the base, smaller ones on them and on each other, leaning outward and up.
/// draw   draw(lowest, highest), another number each time
template <class Draw>
std::vector<Heap> pile_up(const Form& form, const Draw& draw) {
  const auto within = [&](const Range& range) { return draw(range.lowest, range.highest); };
  std::vector<Heap> heaps;
  const double width_m = within(form.width_m);
  const double stretch = within(form.stretch);
  const int num_feet = static_cast<int>(within(form.num_feet));
  for (int i = 0; i < num_feet; ++i) {
    const double turn = draw(0.0, 2.0 * kPi);
    const double out = std::sqrt(draw(0.0, 1.0));
    const double radius_m = within(form.foot_m) * (1.15 - 0.6 * out);
    heaps.push_back({{out * width_m * std::cos(turn), stretch * out * width_m * std::sin(turn),
                      draw(0.05, 0.6) * radius_m},
                     radius_m});
  }
  const int num_towers = static_cast<int>(within(form.num_towers));
  for (int i = 0; i < num_towers; ++i) {
    // Of two the nearer to the middle bears it: towers stand in the middle.
    const auto one = [&] {
      return heaps[static_cast<std::size_t>(draw(0.0, static_cast<double>(heaps.size()) - 0.01))];
    };
    const Heap first = one();
    const Heap second = one();
    const Heap foot =
        first.middle_m.head<2>().norm() < second.middle_m.head<2>().norm() ? first : second;
    const double turn = draw(0.0, 2.0 * kPi);
    const double aside_m = draw(0.2, 0.6) * foot.radius_m;
    heaps.push_back(
        {foot.middle_m + Eigen::Vector3d(aside_m * std::cos(turn), aside_m * std::sin(turn),
                                         foot.radius_m * draw(0.45, 0.9)),
         foot.radius_m * within(form.tower_share)});
  }
  return heaps;
}

/// Signed distance into the union of heaps, smoothed where they meet.
double distance_into(const std::vector<Heap>& heaps, const Eigen::Vector3d& at) {
  double inside_m = -1e9;
  for (const Heap& heap : heaps) {
    const double own_m = heap.radius_m - (at - heap.middle_m).norm();
    constexpr double kBlend_m = 40.0;
    const double h = std::clamp(0.5 + 0.5 * (own_m - inside_m) / kBlend_m, 0.0, 1.0);
    inside_m = inside_m + h * (own_m - inside_m) + kBlend_m * h * (1.0 - h);
  }
  return inside_m;
}

}  // namespace

world::Volume make_cumulus(std::uint64_t seed, int number) {
  const std::uint64_t own = core::stream_of(seed, static_cast<std::uint64_t>(number));
  std::uint64_t question = 0;
  const auto draw = [&](double lowest, double highest) {
    return core::random_between(lowest, highest, own, 0x68656170, question++);
  };
  const Form& form = kForms[static_cast<std::size_t>(number) % kForms.size()];
  const std::vector<Heap> heaps = pile_up(form, draw);
  world::Volume volume;
  volume.name = fmt::format("cumulus {}", number);
  volume.voxel_m = 12.0;
  volume.size = {160, 160, 96};
  volume.lowest_m = {-960.0, -960.0, -40.0};
  const LatticeNoise noise(own);
  fill(volume, [&](const Eigen::Vector3d& at) {
    const double inside_m = distance_into(heaps, at);
    // Farther out than that billows hardly ever reach.
    if (inside_m < -1.5 * form.billow_m) return 0.0;
    const double wisps = octaves(noise, at + Eigen::Vector3d(900.0, 0.0, 0.0), 90.0, 3, false);
    double edge_m = inside_m;
    double soft = 0.0;  // 1 where dry air comes in
    if (inside_m < 260.0) {
      soft = smooth_step(
          0.5 + 1.1 * octaves(noise, at + Eigen::Vector3d(0.0, 0.0, 1700.0), 420.0, 2, false));
      edge_m += form.billow_m * octaves(noise, at, 280.0, 5, true, 0.60) + 14.0 * wisps -
                form.torn_m * soft * (0.6 + 0.8 * wisps);
    }
    // The base lies where air that rises begins to condense: lower where it is moister.
    const double lumps =
        at.z() < 90.0 ? octaves(noise, {at.x(), at.y() + 700.0, 0.5 * at.z()}, 150.0, 3, true, 0.6)
                      : 0.0;
    const double base = smooth_step((at.z() + 22.0 * lumps + 12.0 * wisps + 4.0) / 26.0);
    // Nothing reaches the volume's sides.
    const double side = smooth_step((940.0 - at.head<2>().cwiseAbs().maxCoeff()) / 120.0) *
                        smooth_step((1060.0 - at.z()) / 120.0);
    return form.density * smooth_step(edge_m / (form.edge_m * (1.0 + 2.5 * soft))) * base * side *
           (0.7 + 0.3 * smooth_step(at.z() / 500.0));
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
