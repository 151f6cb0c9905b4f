#include "tiler/apron.h"

#include <algorithm>
#include <cmath>

namespace terracast::tiler {
namespace {

constexpr int kSamplesPerSide = 512;
constexpr int kNumSmoothed = 8;
/// The square is mirrored over this distance from the border, or over this share of its side.
constexpr double kMirror_m = 14000.0;
constexpr double kMirrorShare = 0.45;
/// Over this distance land sinks into the sea that was asked for.
constexpr double kShore_m = 15000.0;
constexpr double kHillPeriod_m = 7000.0;
/// Mirrored ground up to this far above the sea is shore: what lies beyond comes down to it.
constexpr double kShoreHeight_m = 20.0;
constexpr double kSeaDepth_m = 100.0;
/// Beyond the border land comes down to its coast over this share of the distance from the border.
constexpr double kCoastShare = 0.5;
/// Land may lie beyond the border's sea so many of the border's samples from its land.
constexpr double kCoastSamples = 2.0;
/// Below the sea where land would have been mirrored: 1 in 50 from the coast.
constexpr double kShelfSlope = 0.02;

double smooth_step(double lowest, double highest, double value) {
  const double t = std::clamp((value - lowest) / (highest - lowest), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

/// The periodic profile smoothed by (1 2 1) / 4 at a stride.
std::vector<double> smoothed(const std::vector<double>& profile, std::size_t stride) {
  std::vector<double> result(profile.size());
  const std::size_t count = profile.size();
  for (std::size_t i = 0; i < count; ++i)
    result[i] = 0.25 * (profile[(i + count - stride) % count] + 2.0 * profile[i] +
                        profile[(i + stride) % count]);
  return result;
}

}  // namespace

Apron::Apron(double half_size_m, bool sinks_to_sea, std::uint64_t seed,
             const std::function<BorderSample(double x_world, double y_world)>& border)
    : half_size_m_(half_size_m),
      sinks_to_sea_(sinks_to_sea),
      step_m_(2.0 * half_size_m / kSamplesPerSide),
      hills_(seed, 0xA9B0) {
  std::vector<double> heights_m;
  std::vector<std::uint8_t> is_sea;
  double sum_of_sea_m = 0.0;
  int num_sea = 0;
  for (int side = 0; side < 4; ++side)
    for (int k = 0; k < kSamplesPerSide; ++k) {
      const double t = -half_size_m + k * step_m_;
      const Eigen::Vector2d places[4] = {
          {t, -half_size_m}, {half_size_m, t}, {-t, half_size_m}, {-half_size_m, -t}};
      const BorderSample sample = border(places[side].x(), places[side].y());
      heights_m.push_back(sample.height_m);
      is_sea.push_back(sample.is_sea ? 1 : 0);
      sea_share_.push_back(sample.is_sea ? 1.0 : 0.0);
      if (!sample.is_sea) continue;
      sum_of_sea_m += sample.height_m;
      ++num_sea;
    }
  has_sea_ = num_sea > 0;
  if (has_sea_) sea_level_m_ = sum_of_sea_m / num_sea;
  measure_inland(is_sea);
  heights_m_.push_back(heights_m);
  for (int j = 1; j < kNumSmoothed; ++j)
    heights_m_.push_back(smoothed(heights_m_.back(), std::size_t{1} << (j - 1)));
  // How far the border rises and falls about its smoothed line: the size of hills beyond.
  for (std::size_t i = 0; i < heights_m.size(); ++i)
    hill_heights_m_.push_back(std::abs(heights_m_.front()[i] - heights_m_.back()[i]));
  for (int j = 0; j < kNumSmoothed; ++j) {
    hill_heights_m_ = smoothed(hill_heights_m_, std::size_t{1} << j);
    if (j < 5) sea_share_ = smoothed(sea_share_, std::size_t{1} << j);
  }
}

void Apron::measure_inland(const std::vector<std::uint8_t>& is_sea) {
  if (std::all_of(is_sea.begin(), is_sea.end(), [&](auto sea) { return sea == is_sea.front(); }))
    return;
  const std::size_t count = is_sea.size();
  std::vector<int> num_steps(count, static_cast<int>(count));
  // Twice round, so that the border's first samples know of its last ones.
  for (const bool is_forward : {true, false})
    for (std::size_t n = 1; n < 2 * count; ++n) {
      const std::size_t i = is_forward ? n % count : (2 * count - n) % count;
      const std::size_t before = is_forward ? (n - 1) % count : (2 * count - n + 1) % count;
      num_steps[i] =
          is_sea[i] != is_sea[before] ? 1 : std::min(num_steps[i], num_steps[before] + 1);
    }
  for (std::size_t i = 0; i < count; ++i)
    inland_m_.push_back((is_sea[i] != 0 ? -1.0 : 1.0) * (num_steps[i] - 0.5) * step_m_);
}

double Apron::inland_m(double along) const {
  constexpr double kFar_m = 1e9;
  if (!inland_m_.empty()) return at(inland_m_, along);
  return has_sea_ ? -kFar_m : kFar_m;
}

Eigen::Vector2d Apron::nearest_inside(double x_world, double y_world) const {
  return {std::clamp(x_world, -half_size_m_, half_size_m_),
          std::clamp(y_world, -half_size_m_, half_size_m_)};
}

Eigen::Vector2d Apron::mirrored_inside(double x_world, double y_world) const {
  const auto mirrored = [this](double t) {
    if (t > half_size_m_) t = 2.0 * half_size_m_ - t;
    if (t < -half_size_m_) t = -2.0 * half_size_m_ - t;
    return std::clamp(t, -half_size_m_, half_size_m_);
  };
  return {mirrored(x_world), mirrored(y_world)};
}

double Apron::mirror_share(double distance_m) const {
  return 1.0 - smooth_step(0.0, std::min(kMirror_m, 2.0 * kMirrorShare * half_size_m_), distance_m);
}

double Apron::along(const Eigen::Vector2d& inside) const {
  if (inside.y() <= -half_size_m_) return (inside.x() + half_size_m_) / step_m_;
  if (inside.x() >= half_size_m_) return kSamplesPerSide + (inside.y() + half_size_m_) / step_m_;
  if (inside.y() >= half_size_m_)
    return 2 * kSamplesPerSide + (half_size_m_ - inside.x()) / step_m_;
  return 3 * kSamplesPerSide + (half_size_m_ - inside.y()) / step_m_;
}

double Apron::at(const std::vector<double>& profile, double along) {
  const double whole = std::floor(along);
  const std::size_t first = static_cast<std::size_t>(whole) % profile.size();
  const double a = profile[first];
  return a + (along - whole) * (profile[(first + 1) % profile.size()] - a);
}

BorderSample Apron::beyond(double x_world, double y_world, double distance_m,
                           const std::optional<BorderSample>& mirrored) const {
  const double place = along(nearest_inside(x_world, y_world));
  const double level =
      std::clamp(std::log2(std::max(distance_m / (3.0 * step_m_), 1.0)), 0.0, kNumSmoothed - 1.001);
  const auto level_below = static_cast<std::size_t>(level);
  const double low = at(heights_m_[level_below], place);
  const double carried_m =
      low + (level - std::floor(level)) * (at(heights_m_[level_below + 1], place) - low);
  const double sea_share = at(sea_share_, place);
  const double hills = fractal_noise(hills_, x_world / kHillPeriod_m, y_world / kHillPeriod_m, 5);
  const double land_m = carried_m + (1.0 - sea_share) * at(hill_heights_m_, place) * 1.6 * hills *
                                        smooth_step(0.0, 6000.0, distance_m);
  // Land passes into the sea's floor, so that the shore is a contour and no line of the border's.
  double sinking = smooth_step(0.3, 0.8, sea_share);
  if (sinks_to_sea_) sinking = std::max(sinking, smooth_step(0.0, kShore_m, distance_m));
  double above_sea_m = (1.0 - sinking) * (land_m - sea_level_m_) - sinking * kSeaDepth_m;
  bool is_sea = sinking > 0.0 && above_sea_m <= 0.0;
  double surface_m = sea_level_m_;  // of the sea
  double depth_m = std::max(-above_sea_m, 0.0);
  if (mirrored) {
    const double share = mirror_share(distance_m);
    const double mirrored_m = mirrored->is_sea ? 0.0 : mirrored->height_m - sea_level_m_;
    // Higher ground farther out would lift the border's bays into slopes.
    if (has_sea_ && above_sea_m > 0.0)
      above_sea_m *=
          1.0 - smooth_step(0.3, 0.6, share) * (1.0 - smooth_step(0.0, kShoreHeight_m, mirrored_m));
    above_sea_m = (1.0 - share) * above_sea_m + share * mirrored_m;
    depth_m += share * ((mirrored->is_sea ? mirrored->sea_depth_m : 0.0) - depth_m);
    is_sea = (mirrored->is_sea || sinking > 0.0) && above_sea_m <= 0.0;
    if (mirrored->is_sea) surface_m += share * (mirrored->height_m - sea_level_m_);
  }
  const double inland_m = this->inland_m(place);
  const double from_coast_m = inland_m + kCoastSamples * step_m_;
  if (from_coast_m > 0.0 && above_sea_m > 0.0) {
    above_sea_m *= smooth_step(0.0, kCoastShare * distance_m, from_coast_m);
  } else if (from_coast_m <= 0.0 && !is_sea) {
    // Land at the border that is narrower than a step of it ends within so much, and not at once.
    above_sea_m *= 1.0 - smooth_step(0.0, kCoastSamples * step_m_, distance_m);
    is_sea = above_sea_m <= 0.0;
    if (is_sea) depth_m = std::min(-inland_m * kShelfSlope, kSeaDepth_m);
  }
  return {.height_m = is_sea ? surface_m : surface_m + above_sea_m,
          .is_sea = is_sea,
          .sea_depth_m = is_sea ? depth_m : 0.0};
}

}  // namespace terracast::tiler
