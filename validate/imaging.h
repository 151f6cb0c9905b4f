#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/image.h"
#include "validate/findings.h"

/// What a dataset says of how cameras make images of the light: imaging.json, whose settings are those of
/// docs/imaging.md. Checks of colours take them for granted: what is stated is no mistake.
namespace terracast::validate {

struct Dataset;
struct Sequence;

struct Imaging {
  /// Lateral chromatic aberration: so many times as large as green they stand, about the image of the optical axis.
  double red_scale = 1.0;
  double blue_scale = 1.0;
  /// What white is by: cameras with unlike ones show one place in unlike colours.
  std::string white_balance = "scene";
  /// Whether brightness goes along with the image rather than with what it shows: vignetting, smudges and dirt on the lens.
  bool has_shading = false;
  /// Of the converter to digital numbers; 0: none.
  int sensor_bits = 0;

  /// Whether its steps are finer than the levels of images, dark ones too, which the curve stretches.
  bool has_fine_levels() const {
    constexpr int kEnough = 14;
    return sensor_bits == 0 || sensor_bits >= kEnough;
  }

  bool has_aberration() const { return red_scale != 1.0 || blue_scale != 1.0; }
  bool operator==(const Imaging&) const = default;
};

/// Settings of a camera, as imaging.json has them: TOML with one key a line.
/// where   for messages: "imaging.json, cam0"
/// throws  Input: a number that is none, an aberration beyond what can be set
Imaging imaging_of_settings(const std::string& settings, const std::string& where);

/// Sets the cameras' imaging by the file, which may not be there: then they are ideal.
void read_imaging(const Dataset& dataset, const std::string& path, Sequence& sequence,
                  Findings& findings);

/// The image with red and blue brought back to where green is, by Catmull and Rom's cubic; the border's pixels are
/// repeated.
/// center_px  the image of the optical axis
core::Image8 without_aberration(const core::Image8& color, const Imaging& imaging,
                                const Eigen::Vector2d& center_px);

}  // namespace terracast::validate
