#include "sensors/camera/imaging/exposure_control.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace terracast::sensors {
namespace {

/// So dark nothing counts as darker.
constexpr double kDarkest = 1e-6;

}  // namespace

double metered_luminance(const ExposureOptions& options, std::span<const scene::Color> seen) {
  TERRACAST_CHECK(!seen.empty(), "a light meter that sees nothing");
  std::vector<double> luminances;
  for (const scene::Color& color : seen)
    luminances.push_back(std::max<double>(scene::luminance_of(color), kDarkest));
  if (options.meter == "log_average") {
    double sum = 0.0;
    for (const double luminance : luminances) sum += std::log2(luminance);
    return std::exp2(sum / static_cast<double>(luminances.size()));
  }
  const auto count = static_cast<double>(luminances.size());
  const auto rank =
      static_cast<std::ptrdiff_t>(std::ceil(count * 0.01 * options.meter_percentile)) - 1;
  const auto place = luminances.begin() + std::max<std::ptrdiff_t>(rank, 0);
  std::nth_element(luminances.begin(), place, luminances.end());
  return *place;
}

double wanted_ev(const ExposureOptions& options, double luminance) {
  return std::clamp(std::log2(options.target / luminance), options.lowest_ev, options.highest_ev);
}

double followed_ev(std::span<const double> times_s, int frame, double time_constant_s,
                   const std::function<double(int)>& wanted_ev_at) {
  if (time_constant_s <= 0.0) return wanted_ev_at(frame);
  double sum = 0.0;
  double weights = 0.0;
  for (int at = frame; at >= std::max(frame - kMostEarlierFrames, 0); --at) {
    const double age =
        (times_s[static_cast<std::size_t>(frame)] - times_s[static_cast<std::size_t>(at)]) /
        time_constant_s;
    if (age > kTimeConstantsLookedAt) break;
    const double weight = std::exp(-age);
    sum += weight * wanted_ev_at(at);
    weights += weight;
  }
  return sum / weights;
}

LightMeters::Reading LightMeters::read(int frame, int camera) const {
  const std::pair key(frame, camera);
  {
    const std::lock_guard lock(mutex_);
    const auto found = readings_.find(key);
    if (found != readings_.end()) return found->second;
  }
  const ExposureOptions& options = options_[static_cast<std::size_t>(camera)];
  std::vector<scene::Color> seen = look_(frame, camera);
  // Without any light to look at the exposure stays as it is fixed.
  if (seen.empty()) seen.push_back(scene::Color::Constant(static_cast<float>(options.target)));
  Reading reading{.luminance = metered_luminance(options, seen)};
  Eigen::Array3d sum = Eigen::Array3d::Zero();
  for (const scene::Color& color : seen) sum += color.cast<double>();
  reading.mean = (sum / static_cast<double>(seen.size())).cast<float>();
  const std::lock_guard lock(mutex_);
  return readings_.emplace(key, reading).first->second;
}

}  // namespace terracast::sensors
