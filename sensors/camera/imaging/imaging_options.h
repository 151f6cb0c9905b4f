#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/schema.h"

/// Config `[rigs.imaging]`: how a rig's cameras make an image of the light that comes to them. Defaults
/// leave each part out; with nothing but defaults images are what they are without this table. All cameras
/// of a rig share the settings; what is drawn (fixed patterns, soiling, noise) is each camera's own.
/// Cameras of another kind are another rig on the same body.
namespace terracast::sensors {

/// `[rigs.imaging.lens]`
struct LensFlawOptions {
  double vignetting_exponent = 0.0;
  std::vector<double> vignetting_polynomial = {};  ///< a2, a4, a6; empty: 1
  double red_scale_permille = 0.0;
  double blue_scale_permille = 0.0;
  double veiling_glare = 0.0;
  double bloom = 0.0;
  double bloom_radius_px = 4.0;
  bool operator==(const LensFlawOptions&) const = default;

  void describe(core::SchemaVisitor& visit);
  void validate() const;
};

/// `[rigs.imaging.soiling]`
struct SoilingOptions {
  std::int64_t smudges = 0;
  double smudge_size = 0.1;
  double smudge_haze = 0.5;
  double smudge_radius_px = 12.0;
  std::int64_t dirt_spots = 0;
  double dirt_size = 0.01;
  double dirt_opacity = 0.6;
  bool operator==(const SoilingOptions&) const = default;

  void describe(core::SchemaVisitor& visit);
  void validate() const;
};

/// `[rigs.imaging.exposure]`
struct ExposureOptions {
  std::string mode = "fixed";
  double bias_ev = 0.0;
  std::string meter = "log_average";
  double meter_percentile = 95.0;
  double target = 0.18;
  double time_constant_s = 0.5;
  double lowest_ev = -6.0;
  double highest_ev = 6.0;
  std::string lock = "rig";
  bool operator==(const ExposureOptions&) const = default;

  bool is_automatic() const { return mode == "automatic"; }
  void describe(core::SchemaVisitor& visit);
  void validate() const;
};

/// `[rigs.imaging.sensor]`
struct ImageSensorOptions {
  std::int64_t bits = 0;
  double black_level_dn = 0.0;
  double saturation_exposure = 4.0;
  double full_well_e = 0.0;
  double gain = 1.0;
  double read_noise_e = 0.0;
  double dark_signal_e = 0.0;
  double prnu_percent = 0.0;
  double dsnu_e = 0.0;
  double dead_share = 0.0;
  double hot_share = 0.0;
  std::string mosaic = {};
  bool operator==(const ImageSensorOptions&) const = default;

  bool is_on() const { return bits > 0; }
  bool has_mosaic() const { return !mosaic.empty(); }
  bool has_defects() const { return dead_share > 0.0 || hot_share > 0.0; }
  void describe(core::SchemaVisitor& visit);
  void validate() const;
};

/// `[rigs.imaging.color]`
struct ColorOptions {
  std::string white_balance = "scene";
  double temperature_k = 5500.0;
  std::vector<double> gains = {};
  double saturation = 1.0;
  std::string curve = "film";
  double gamma = 2.2;
  bool operator==(const ColorOptions&) const = default;

  void describe(core::SchemaVisitor& visit);
  void validate() const;
};

struct ImagingOptions {
  LensFlawOptions lens;
  SoilingOptions soiling;
  ExposureOptions exposure;
  ImageSensorOptions sensor;
  ColorOptions color;
  bool operator==(const ImagingOptions&) const = default;

  /// Whether any key differs from its default.
  bool is_on() const { return *this != ImagingOptions{}; }
  /// Whether an image depends on what the camera saw at other frames.
  bool looks_at_other_frames() const {
    return exposure.is_automatic() || color.white_balance == "grey_world";
  }
  void describe(core::SchemaVisitor& visit);
};

}  // namespace terracast::sensors
