#include "scene/light/sky.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "geo/sun.h"
#include "geo/units.h"

namespace terracast::scene {
namespace {

constexpr double kPi = std::numbers::pi;

// Wavelengths that stand for the channels of sRGB, micrometres.
constexpr double kWavelength_um[3] = {0.610, 0.550, 0.465};
constexpr double kRayleighHeight_m = 8000.0;
constexpr double kMieHeight_m = 1200.0;
// Bucholtz (1995), sea level, 550 nm.
constexpr double kRayleighPer_m = 1.16e-5;
constexpr double kRayleighExponent = -4.08;
constexpr double kMieExponent = -1.3;  // Angstrom's, of continental haze
// The sun outside the air: 128 klx; its colour against D65.
constexpr double kExtraterrestrial_klx[3] = {135.0, 127.0, 118.0};
constexpr double kGroundAlbedo = 0.15;
// Towards the horizon so much of the sky is air without end; the share falls to 1/e at a cosine of the
// zenith angle of so many vertical optical depths.
constexpr float kThickShare = 0.85f;
constexpr double kThickCosinePerDepth = 0.57;
// Haze: mean cosine of its scattering, and the share of light that it does not absorb.
constexpr float kHazeCosine = 0.76f;
constexpr float kHazeAlbedo = 0.95f;

double relative_to_550nm(int channel, double exponent) {
  return std::pow(kWavelength_um[channel] / 0.550, exponent);
}

/// Koschmieder: a black object vanishes at 3.912 / extinction.
double mie_per_m(double visibility_m) {
  return std::max(3.912 / visibility_m - kRayleighPer_m, 0.0);
}

double turbidity_of(double visibility_m) {
  const double rayleigh_depth = kRayleighPer_m * kRayleighHeight_m;
  const double mie_depth = mie_per_m(visibility_m) * kMieHeight_m;
  // The formula was fitted from 2 to 10; near 2 its horizon is far too bright.
  return std::clamp((rayleigh_depth + mie_depth) / rayleigh_depth, 2.4, 10.0);
}

Color linear_srgb_from_xyy(float x, float y, float luminance) {
  // CIE XYZ, with Y the luminance, into the primaries of sRGB.
  const float cie_x = luminance * x / y;
  const float cie_z = luminance * (1.0f - x - y) / y;
  return Color(3.2404542f * cie_x - 1.5371385f * luminance - 0.4985314f * cie_z,
               -0.9692660f * cie_x + 1.8760108f * luminance + 0.0415560f * cie_z,
               0.0556434f * cie_x - 0.2040259f * luminance + 1.0572252f * cie_z)
      .max(0.0f);
}

float perez_function(const std::array<float, 5>& c, float cos_zenith, float angle, float cos_sun) {
  return (1.0f + c[0] * std::exp(c[1] / cos_zenith)) *
         (1.0f + c[2] * std::exp(c[3] * angle) + c[4] * cos_sun * cos_sun);
}

/// Mean of exp(-h / scale) over heights between two that are passed linearly.
float mean_density(float from_height_m, float to_height_m, float scale_m) {
  const float from = std::exp(-from_height_m / scale_m);
  const float climb = (to_height_m - from_height_m) / scale_m;
  if (std::abs(climb) < 1e-3f) return from * (1.0f - 0.5f * climb);
  return from * (1.0f - std::exp(-climb)) / climb;
}

std::array<float, 9> harmonics(const Eigen::Vector3f& d) {
  return {0.282095f,
          0.488603f * d.y(),
          0.488603f * d.z(),
          0.488603f * d.x(),
          1.092548f * d.x() * d.y(),
          1.092548f * d.y() * d.z(),
          0.315392f * (3.0f * d.z() * d.z() - 1.0f),
          1.092548f * d.x() * d.z(),
          0.546274f * (d.x() * d.x() - d.y() * d.y())};
}

}  // namespace

Ambient::Ambient(const std::function<Color(const Eigen::Vector3f&)>& radiance) {
  constexpr int kRings = 48;
  constexpr int kSectors = 96;
  // The cosine's weight on each band of harmonics: pi, 2 pi / 3, pi / 4.
  constexpr float kCosine[9] = {3.141593f, 2.094395f, 2.094395f, 2.094395f, 0.785398f,
                                0.785398f, 0.785398f, 0.785398f, 0.785398f};
  harmonics_.fill(Color::Zero());
  const float solid_angle = static_cast<float>(4.0 * kPi / (kRings * kSectors));
  for (int ring = 0; ring < kRings; ++ring) {
    const double z = (2.0 * ring + 1.0) / kRings - 1.0;  // rings of equal area
    const double across = std::sqrt(1.0 - z * z);
    for (int sector = 0; sector < kSectors; ++sector) {
      const double turn = 2.0 * kPi * (sector + 0.5) / kSectors;
      const Eigen::Vector3f direction(static_cast<float>(across * std::cos(turn)),
                                      static_cast<float>(across * std::sin(turn)),
                                      static_cast<float>(z));
      const Color radiance_there = radiance(direction);
      const std::array<float, 9> basis = harmonics(direction);
      for (std::size_t k = 0; k < 9; ++k)
        harmonics_[k] += radiance_there * (basis[k] * kCosine[k] * solid_angle);
    }
  }
}

Color Ambient::irradiance(const Eigen::Vector3f& normal) const {
  const std::array<float, 9> basis = harmonics(normal);
  Color sum = Color::Zero();
  for (std::size_t k = 0; k < 9; ++k) sum += harmonics_[k] * basis[k];
  return sum.max(0.0f);
}

Sky::Sky(const Daylight& daylight)
    : daylight_(daylight),
      turbidity_(turbidity_of(daylight.visibility_m)),
      up_(daylight.up_world.cast<float>()),
      sun_(daylight.sun_direction_world.cast<float>()) {
  const double sin_elevation =
      std::clamp(daylight.sun_direction_world.dot(daylight.up_world), -1.0, 1.0);
  const double elevation = std::asin(sin_elevation);
  const double elevation_deg = geo::degrees_from_radians(elevation);
  // The formula needs the sun above the horizon; below, the sky keeps the shape of sunset and fades
  // tenfold in 4 degrees of depression.
  const double zenith_angle = kPi / 2 - std::max(elevation, geo::radians_from_degrees(0.5));
  twilight_ = static_cast<float>(std::pow(10.0, std::min(elevation_deg, 0.0) / 4.0));

  const double t = turbidity_;
  const double a[3][5][2] = {{{0.1787, -1.4630},
                              {-0.3554, 0.4275},
                              {-0.0227, 5.3251},
                              {0.1206, -2.5771},
                              {-0.0670, 0.3703}},
                             {{-0.0193, -0.2592},
                              {-0.0665, 0.0008},
                              {-0.0004, 0.2125},
                              {-0.0641, -0.8989},
                              {-0.0033, 0.0452}},
                             {{-0.0167, -0.2608},
                              {-0.0950, 0.0092},
                              {-0.0079, 0.2102},
                              {-0.0441, -1.6537},
                              {-0.0109, 0.0529}}};
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t j = 0; j < 5; ++j)
      coefficients_[k][j] = static_cast<float>(a[k][j][0] * t + a[k][j][1]);

  const double chi = (4.0 / 9.0 - t / 120.0) * (kPi - 2.0 * zenith_angle);
  const double zenith_luminance =
      std::max((4.0453 * t - 4.9710) * std::tan(chi) - 0.2155 * t + 2.4192, 0.05);
  const double s = zenith_angle;
  const auto chromaticity = [&](const double(&m)[3][4]) {
    double sum = 0.0;
    const double powers[3] = {t * t, t, 1.0};
    for (int i = 0; i < 3; ++i)
      sum += powers[i] * (((m[i][0] * s + m[i][1]) * s + m[i][2]) * s + m[i][3]);
    return sum;
  };
  const double x_matrix[3][4] = {{0.00166, -0.00375, 0.00209, 0.0},
                                 {-0.02903, 0.06377, -0.03202, 0.00394},
                                 {0.11693, -0.21196, 0.06052, 0.25886}};
  const double y_matrix[3][4] = {{0.00275, -0.00610, 0.00317, 0.0},
                                 {-0.04214, 0.08970, -0.04153, 0.00516},
                                 {0.15346, -0.26756, 0.06670, 0.26688}};
  const double zenith[3] = {zenith_luminance, chromaticity(x_matrix), chromaticity(y_matrix)};
  for (std::size_t k = 0; k < 3; ++k) {
    const float norm = perez_function(coefficients_[k], 1.0f, static_cast<float>(zenith_angle),
                                      static_cast<float>(std::cos(zenith_angle)));
    zenith_over_norm_[k] = static_cast<float>(zenith[k]) / norm;
  }

  // Kasten and Young (1989), relative air mass.
  const double shown_deg = std::max(elevation_deg, 0.0);
  const double air_mass = 1.0 / (std::sin(geo::radians_from_degrees(shown_deg)) +
                                 0.50572 * std::pow(shown_deg + 6.07995, -1.6364));
  const double mie = mie_per_m(daylight.visibility_m);
  // The part of the disc above the horizon, as a ramp over its diameter.
  const double shown = std::clamp(0.5 + 0.5 * elevation / geo::kSunAngularRadius_rad, 0.0, 1.0);
  for (int channel = 0; channel < 3; ++channel) {
    const double rayleigh_c = kRayleighPer_m * relative_to_550nm(channel, kRayleighExponent);
    const double mie_c = mie * relative_to_550nm(channel, kMieExponent);
    const double depth = rayleigh_c * kRayleighHeight_m + mie_c * kMieHeight_m;
    rayleigh_per_m_[channel] = static_cast<float>(rayleigh_c);
    mie_per_m_[channel] = static_cast<float>(mie_c);
    sun_irradiance_[channel] =
        static_cast<float>(shown * kExtraterrestrial_klx[channel] * std::exp(-air_mass * depth));
  }

  const double depth = kRayleighPer_m * kRayleighHeight_m + mie * kMieHeight_m;
  thick_cosine_ = static_cast<float>(kThickCosinePerDepth * depth);
  // Air glows by the light of the sky above it; the sky's horizon then by that of the air.
  const Ambient first = light_around();
  for (int axis = 0; axis < 3; ++axis)
    for (const float sign : {-1.0f, 1.0f})
      around_ += first.irradiance(sign * Eigen::Vector3f::Unit(axis)) *
                 static_cast<float>(1.0 / (6.0 * kPi));
  // A sun below the horizon lights the high air alone, which stays as the formula has it.
  thick_share_ = is_night() ? 0.0f : kThickShare;
  for (int i = 0; i < kHorizonEntries; ++i) {
    const float cos_sun = 2.0f * static_cast<float>(i) / (kHorizonEntries - 1) - 1.0f;
    horizon_[static_cast<std::size_t>(i)] = perez(0.0f, cos_sun);
  }
  ambient_ = light_around();
}

Ambient Sky::light_around() {
  const auto above_ground = [this](const Color& ground_radiance) {
    return Ambient([this, ground_radiance](const Eigen::Vector3f& direction) -> Color {
      return direction.dot(up_) >= 0.0f ? radiance(direction) : ground_radiance;
    });
  };
  const Color level = sun_irradiance_ * std::max(sun_.dot(up_), 0.0f);
  global_irradiance_ = level + above_ground(Color::Zero()).irradiance(up_);
  return above_ground(global_irradiance_ * static_cast<float>(kGroundAlbedo / kPi));
}

Color Sky::air_glow(float cos_sun) const {
  constexpr auto kPi4 = static_cast<float>(4.0 * kPi);
  const float molecules = 0.75f * (1.0f + cos_sun * cos_sun) / kPi4;
  const float below = 1.0f + kHazeCosine * kHazeCosine - 2.0f * kHazeCosine * cos_sun;
  const float haze = (1.0f - kHazeCosine * kHazeCosine) / (kPi4 * below * std::sqrt(below));
  const Color by_haze = kHazeAlbedo * mie_per_m_;
  return ((rayleigh_per_m_ * molecules + by_haze * haze) * sun_irradiance_ +
          (rayleigh_per_m_ + by_haze) * around_) /
         (rayleigh_per_m_ + mie_per_m_);
}

Color Sky::perez(float cos_zenith, float cos_sun) const {
  // At the horizon the luminance has a pole, and the fitted chromaticity turns to magenta in clear
  // air: the last degrees take the luminance of 2 and the colour of 8 degrees of elevation.
  const float angle = std::acos(std::clamp(cos_sun, -1.0f, 1.0f));
  const float least_cosine[3] = {0.035f, 0.14f, 0.14f};
  float value[3];
  for (std::size_t k = 0; k < 3; ++k)
    value[k] =
        zenith_over_norm_[k] *
        perez_function(coefficients_[k], std::max(cos_zenith, least_cosine[k]), angle, cos_sun);
  Color color = linear_srgb_from_xyy(value[1], value[2], value[0]);
  if (thick_share_ > 0.0f) {
    const float thick = thick_share_ * std::exp(-std::max(cos_zenith, 0.0f) / thick_cosine_);
    color += thick * (air_glow(cos_sun) - color);
  }
  return color * twilight_;
}

Color Sky::radiance(const Eigen::Vector3f& direction_world) const {
  return perez(direction_world.dot(up_), direction_world.dot(sun_));
}

Color Sky::sun_radiance() const {
  const double solid_angle = 2.0 * kPi * (1.0 - std::cos(geo::kSunAngularRadius_rad));
  return sun_irradiance_ / static_cast<float>(solid_angle);
}

AirPath Sky::air(float distance_m, float from_height_m, float to_height_m, float cos_sun) const {
  const float rayleigh =
      distance_m * mean_density(from_height_m, to_height_m, static_cast<float>(kRayleighHeight_m));
  const float mie =
      distance_m * mean_density(from_height_m, to_height_m, static_cast<float>(kMieHeight_m));
  AirPath path;
  path.transmittance = (-(rayleigh_per_m_ * rayleigh + mie_per_m_ * mie)).exp();
  const float at = std::clamp(0.5f * (cos_sun + 1.0f), 0.0f, 1.0f) * (kHorizonEntries - 1);
  const int entry = std::min(static_cast<int>(at), kHorizonEntries - 2);
  const float share = at - static_cast<float>(entry);
  const Color horizon = horizon_[static_cast<std::size_t>(entry)] * (1.0f - share) +
                        horizon_[static_cast<std::size_t>(entry) + 1] * share;
  path.inscatter = horizon * (1.0f - path.transmittance);
  return path;
}

}  // namespace terracast::scene
