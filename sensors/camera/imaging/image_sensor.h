#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/image.h"
#include "sensors/camera/imaging/imaging_options.h"
#include "sensors/camera/imaging/mosaic.h"

namespace terracast::sensors {

/// A sensor by the linear model of EMVA 1288 (release 4.0, 2021, sections 2 and 4): exposure to electrons
/// to digital numbers. Of an exposure H, 1 being white before the curve,
///
///     signal [e]   S = H / saturation_exposure * full_well_e / gain * (1 + PRNU)
///     counted [e]  N = Poisson(S + dark_signal_e) + DSNU + Normal(0, read_noise_e)
///     number [DN]  y = floor(black_level_dn + K N + 1/2), within 0 … 2^bits - 1
///     system gain  K = (2^bits - 1 - black_level_dn) * gain / full_well_e [DN/e]
///
/// so that var(y) = K (mean(y) - black) + K^2 read_noise_e^2 + 1/12: the photon transfer curve. PRNU and
/// DSNU are normal deviates of each photosite, the same in all frames of a sequence; so is which sites are
/// dead (S = 0) and hot (y is the highest number). Without full_well_e there is no noise, and y is H in
/// steps. With a mosaic each pixel is one photosite, else three, one a colour.
///
/// Each number follows from seed, sequence, camera, frame and photosite alone. Threads: safe.
class ImageSensor {
 public:
  /// stream   of the camera's draws in its sequence
  ImageSensor(const ImageSensorOptions& options, std::uint64_t seed, std::uint64_t stream);

  /// exposed   three channels
  /// returns   one channel of a mosaic, else three
  core::Image16 read(const core::ImageF& exposed, int frame) const;

  /// The exposure for which a number stands: without black level and the mean dark signal.
  float exposure_of(double number_dn) const {
    return static_cast<float>((number_dn - zero_dn_) / dn_per_exposure_);
  }

  int white_level_dn() const { return white_level_dn_; }
  /// The system gain K; 0 where electrons do not count.
  double dn_per_electron() const { return dn_per_electron_; }
  const std::optional<Mosaic>& mosaic() const { return mosaic_; }

  /// Photosites that see nothing, or are always full: indices of values in the image that read() gives,
  /// ascending.
  struct Defects {
    std::vector<std::int64_t> dead;
    std::vector<std::int64_t> hot;
  };
  Defects find_defects(int width_px, int height_px) const;

 private:
  enum class Defect { None, Dead, Hot };
  Defect defect_at(std::uint64_t site) const;
  std::uint16_t number_of(double exposed, std::uint64_t site, std::uint64_t frame_stream) const;

  ImageSensorOptions options_;
  std::uint64_t seed_;
  std::uint64_t stream_;
  std::optional<Mosaic> mosaic_;
  int white_level_dn_;
  double dn_per_electron_;
  double dn_per_exposure_;
  double zero_dn_;  ///< mean number of no light
};

}  // namespace terracast::sensors
