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
  for (int side = 0; side < 4; ++side)
    for (int k = 0; k < kSamplesPerSide; ++k) {
      const double t = -half_size_m + k * step_m_;
      const Eigen::Vector2d places[4] = {
          {t, -half_size_m}, {half_size_m, t}, {-t, half_size_m}, {-half_size_m, -t}};
      const BorderSample sample = border(places[side].x(), places[side].y());
      heights_m.push_back(sample.height_m);
      sea_share_.push_back(sample.is_sea ? 1.0 : 0.0);
    }
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

BorderSample Apron::beyond(double x_world, double y_world, double distance_m) const {
  const double place = along(nearest_inside(x_world, y_world));
  const double level =
      std::clamp(std::log2(std::max(distance_m / (3.0 * step_m_), 1.0)), 0.0, kNumSmoothed - 1.001);
  const auto level_below = static_cast<std::size_t>(level);
  const double low = at(heights_m_[level_below], place);
  const double carried_m =
      low + (level - std::floor(level)) * (at(heights_m_[level_below + 1], place) - low);
  const double sea_share = at(sea_share_, place);
  BorderSample sample;
  const double hills = fractal_noise(hills_, x_world / kHillPeriod_m, y_world / kHillPeriod_m, 5);
  sample.height_m = carried_m + (1.0 - sea_share) * at(hill_heights_m_, place) * 1.6 * hills *
                                    smooth_step(0.0, 6000.0, distance_m);
  sample.is_sea = sea_share > 0.5;
  if (sample.is_sea) sample.height_m *= 1.0 - smooth_step(0.5, 0.9, sea_share);
  if (sinks_to_sea_) {
    sample.height_m *= 1.0 - smooth_step(0.0, kShore_m, distance_m);
    sample.is_sea = sample.is_sea || distance_m >= kShore_m;
  }
  return sample;
}

}  // namespace terracast::tiler
