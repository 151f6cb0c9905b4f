#include <algorithm>
#include <cmath>
#include <numbers>

#include "geo/units.h"
#include "scene/ground/ground.h"
#include "scene/media/medium.h"

/// Haze whose density falls off exponentially with the height above the sea: haze over a sea or a plain, mist in a
/// valley. Light is lost by Beer and Lambert's law and scattered once: the sun's by Henyey and Greenstein's phase
/// function, dimmed by the haze above; that of sky and ground evenly from all sides.
namespace terracast::scene {
namespace {

/// Contrast that a dark object keeps at the meteorological range: Koschmieder's law with the 2 % of the air's own.
constexpr double kRangeDepth = 3.912;
/// Nothing is followed farther: the air hides it.
constexpr double kFarthest_m = 300e3;
/// Pieces of a ray, each longer than the one before it by kGrowth; the height changes linearly within a piece: over
/// 3 km, the last of 60, it is off by 0.2 m at most.
constexpr int kPieces = 96;
constexpr double kGrowth = 1.05;
/// The sun's rays are followed as if the haze were level; lower than this the sun is taken to stand here.
constexpr double kLeastSunSine = 0.02;

/// Mean of e^-x between two values.
double mean_exponential(double a, double b) {
  const double difference = b - a;
  if (std::abs(difference) < 1e-6) return std::exp(-0.5 * (a + b));
  return (std::exp(-a) - std::exp(-b)) / difference;
}

struct HazeOptions : MediumOptions {
  double visibility_km = 5.0;
  double base_m = 0.0;
  double scale_height_m = 200.0;
  double albedo = 0.95;
  double anisotropy = 0.7;

  void describe(core::SchemaVisitor& visit) override {
    visit.key("visibility_km", visibility_km,
              "Meteorological range in the haze alone, at its base and below.",
              core::between(0.02, 1000.0));
    visit.key("base_m", base_m, "Height above the sea up to which it is as dense as at its base.",
              core::between(-500.0, 9000.0));
    visit.key("scale_height_m", scale_height_m,
              "Height over which its density falls to 1/e, above its base.",
              core::between(1.0, 10000.0));
    visit.key("albedo", albedo, "Share of the lost light that is scattered, not absorbed.",
              core::between(0.0, 1.0));
    visit.key("anisotropy", anisotropy,
              "Mean cosine of the angle by which it scatters; 0: to all sides alike.",
              core::between(-0.95, 0.95));
  }
  std::unique_ptr<MediumOptions> clone() const override {
    return std::make_unique<HazeOptions>(*this);
  }
  std::unique_ptr<Medium> make(const MediumSite& site) const override;
};

class Haze : public Medium {
 public:
  Haze(const HazeOptions& options, const MediumSite& site)
      : options_(options),
        sea_level_m_(site.sea_level_m),
        extinction_per_m_(kRangeDepth / (1e3 * options.visibility_km)),
        sun_world_(site.sky.daylight().sun_direction_world),
        sun_sine_(std::max(sun_world_.dot(site.sky.daylight().up_world), kLeastSunSine)),
        sun_irradiance_(site.sky.sun_irradiance()) {
    // The mean radiance from all sides: half of it from above, half from below.
    const Eigen::Vector3f up = site.sky.daylight().up_world.cast<float>();
    around_ = 0.5f * (site.sky.ambient().irradiance(up) + site.sky.ambient().irradiance(-up)) /
              std::numbers::pi_v<float>;
  }

  double sun_transmittance(const Eigen::Vector3d& point_world) const override {
    return std::exp(-depth_above(height_m(point_world)) / sun_sine_);
  }

  SeenMedium look(const MediumRay& ray) const override {
    const double until_m = std::min(ray.until_m, kFarthest_m);
    const double g = options_.anisotropy;
    const double cos_sun = ray.direction_world.dot(sun_world_);
    const double below = 1.0 + g * g - 2.0 * g * cos_sun;
    const auto phase =
        static_cast<float>((1.0 - g * g) / (4.0 * std::numbers::pi * below * std::sqrt(below)));
    const auto albedo = static_cast<float>(options_.albedo);

    double depth = 0.0;
    double weighted_m = 0.0;
    Color radiance = Color::Zero();
    double from_m = 0.0;
    double from_height_m = height_m(ray.origin_world);
    double length_m = until_m * (kGrowth - 1.0) / (std::pow(kGrowth, kPieces) - 1.0);
    for (int piece = 0; piece < kPieces; ++piece, length_m *= kGrowth) {
      const double to_m = piece + 1 == kPieces ? until_m : from_m + length_m;
      const double to_height_m = height_m(ray.origin_world + to_m * ray.direction_world);
      const double piece_depth =
          extinction_per_m_ * (to_m - from_m) * mean_density(from_height_m, to_height_m);
      const double taken = std::exp(-depth) * -std::expm1(-piece_depth);
      const double middle_height_m = 0.5 * (from_height_m + to_height_m);
      const auto sun = static_cast<float>(std::exp(-depth_above(middle_height_m) / sun_sine_));
      radiance += static_cast<float>(taken) * albedo * (phase * sun * sun_irradiance_ + around_);
      weighted_m += taken * 0.5 * (from_m + to_m);
      depth += piece_depth;
      from_m = to_m;
      from_height_m = to_height_m;
    }
    const double lost = -std::expm1(-depth);
    return {.transmittance = Color::Constant(static_cast<float>(std::exp(-depth))),
            .radiance = radiance,
            .distance_m = lost > 0.0 ? weighted_m / lost : 0.0};
  }

 private:
  double height_m(const Eigen::Vector3d& point_world) const {
    return approximate_height_m(point_world) - sea_level_m_;
  }

  /// Share of the density at the base, averaged over a piece whose height changes linearly.
  double mean_density(double a_m, double b_m) const {
    const double low = (std::min(a_m, b_m) - options_.base_m) / options_.scale_height_m;
    const double high = (std::max(a_m, b_m) - options_.base_m) / options_.scale_height_m;
    if (low >= 0.0) return mean_exponential(low, high);
    if (high <= 0.0) return 1.0;
    return (-low + high * mean_exponential(0.0, high)) / (high - low);
  }

  /// Optical depth straight up from a height.
  double depth_above(double height_m) const {
    const double above = (height_m - options_.base_m) / options_.scale_height_m;
    return extinction_per_m_ * options_.scale_height_m *
           (above >= 0.0 ? std::exp(-above) : 1.0 - above);
  }

  HazeOptions options_;
  double sea_level_m_;
  double extinction_per_m_;
  Eigen::Vector3d sun_world_;
  double sun_sine_;
  Color sun_irradiance_;
  Color around_ = Color::Zero();
};

std::unique_ptr<Medium> HazeOptions::make(const MediumSite& site) const {
  return std::make_unique<Haze>(*this, site);
}

}  // namespace

MediumInfo exponential_haze_medium() {
  return {.name = "exponential_haze",
          .summary = "haze or mist that thins out exponentially with height",
          .make = [] { return std::unique_ptr<MediumOptions>(std::make_unique<HazeOptions>()); }};
}

}  // namespace terracast::scene
