#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>

namespace terracast::scene {

/// Linear sRGB (D65); radiance in kcd/m^2, irradiance in klx, a channel each.
using Color = Eigen::Array3f;

/// Relative luminance of linear sRGB (Rec. 709).
inline float luminance_of(const Color& color) {
  return 0.2126f * color[0] + 0.7152f * color[1] + 0.0722f * color[2];
}

/// Irradiance of planes of every direction under a distant environment, as second-order spherical
/// harmonics (Ramamoorthi and Hanrahan 2001): exact for a uniform one, a few percent for a clear
/// sky.
class Ambient {
 public:
  Ambient() { harmonics_.fill(Color::Zero()); }
  /// radiance   from a unit direction
  explicit Ambient(const std::function<Color(const Eigen::Vector3f&)>& radiance);

  /// normal: unit
  Color irradiance(const Eigen::Vector3f& normal) const;

 private:
  std::array<Color, 9> harmonics_;
};

/// What lights a sequence.
struct Daylight {
  Eigen::Vector3d sun_direction_world =
      Eigen::Vector3d::UnitZ();                         ///< unit, towards the disc's centre
  Eigen::Vector3d up_world = Eigen::Vector3d::UnitZ();  ///< unit, at the place of the sequence
  double visibility_m = 60e3;  ///< meteorological range at sea level (contrast 2 % at 550 nm)
};

/// What air between two places does to light.
struct AirPath {
  Color transmittance;
  Color inscatter;  ///< radiance that the air adds
};

/// A clear sky. Sky: the all-weather formula of Perez with the coefficients of Preetham, Shirley
/// and Smits (1999) for its turbidity. Sun: the extraterrestrial sun behind Rayleigh's and
/// Ångström's extinction along Kasten's air mass. Air: Rayleigh and Mie extinction with exponential
/// heights, in closed form, glowing as the horizon does in that direction; the horizon glows as air
/// without end does (air_glow). Threads: safe.
class Sky {
 public:
  explicit Sky(const Daylight& daylight);

  const Daylight& daylight() const { return daylight_; }
  double turbidity() const { return turbidity_; }

  /// Radiance of the sky without the sun's disc. direction_world: unit. Below the horizon it is the
  /// horizon's.
  Color radiance(const Eigen::Vector3f& direction_world) const;

  /// The sun's disc, mean radiance over it.
  Color sun_radiance() const;
  /// Irradiance of a plane that faces the sun, of the whole disc.
  const Color& sun_irradiance() const { return sun_irradiance_; }

  /// Irradiance of planes by sky and sunlit ground without terrain in the way.
  const Ambient& ambient() const { return ambient_; }

  /// Whether no sunlight reaches the ground.
  bool is_night() const { return luminance_of(sun_irradiance_) <= 0.0f; }

  /// Of a level plane: sun and sky.
  const Color& global_irradiance() const { return global_irradiance_; }

  /// Radiance of air so thick that nothing is seen through it: in each channel the mean of what
  /// molecules and haze scatter, weighted by their extinction. Molecules scatter the sun by
  /// Rayleigh's phase function, haze by Henyey and Greenstein's of mean cosine 0.76 and albedo 0.95;
  /// to this come once more sky and ground from all sides. Blue is scattered most, and lost most, so
  /// that such air is a bluish white.
  Color air_glow(float cos_sun) const;

  /// Air along a straight path; the height above sea level is taken as linear along it.
  /// cos_sun   cosine of the angle between the line of sight and the sun
  AirPath air(float distance_m, float from_height_m, float to_height_m, float cos_sun) const;

 private:
  Color perez(float cos_zenith, float cos_sun) const;
  /// Light of sky and sunlit ground, the sky as it is so far.
  Ambient light_around();

  static constexpr int kHorizonEntries = 129;

  Daylight daylight_;
  double turbidity_ = 2.0;
  Eigen::Vector3f up_;
  Eigen::Vector3f sun_;
  float twilight_ = 1.0f;  ///< factor on the sky while the sun is below the horizon
  std::array<std::array<float, 5>, 3> coefficients_{};  ///< A to E of Y, x, y
  std::array<float, 3> zenith_over_norm_{};  ///< Y, x, y at the zenith over Perez' function there
  Color sun_irradiance_ = Color::Zero();
  Color global_irradiance_ = Color::Zero();
  Color rayleigh_per_m_ = Color::Zero();  ///< extinction at sea level
  Color mie_per_m_ = Color::Zero();
  float thick_cosine_ =
      0.0f;  ///< of the zenith angle at which thick air's share is 1/e of the horizon's
  float thick_share_ = 0.0f;      ///< of thick air in the horizon
  Color around_ = Color::Zero();  ///< mean radiance of sky and ground, from all sides
  Ambient ambient_;
  std::array<Color, kHorizonEntries> horizon_{};  ///< horizon radiance over the cosine to the sun
};

}  // namespace terracast::scene
