#pragma once

#include <cstdint>

#include "scene/light/sky.h"
#include "sensors/camera/imaging/imaging_options.h"

namespace terracast::sensors {

/// Gains that make the light of a black body white and leave its luminance: that over its linear sRGB.
/// temperature_k   2000 to 25000
/// accuracy        3 % of each gain at 2856 K (CIE illuminant A); Development.BlackBodiesAreWhite
/// source          Kim et al. 2002, US patent 7024034: cubics of the Planckian locus
scene::Color gains_of_temperature(double temperature_k);

/// From balanced exposures to the values of an image: saturation, curve, eight bits. Threads: safe.
class Development {
 public:
  explicit Development(const ColorOptions& options) : options_(options) {}

  /// exposed   linear, 1 being white before the curve
  void develop(const scene::Color& exposed, std::uint8_t* rgb) const;

  /// In [0, 1] for what is not brighter than white; the film's shoulder takes all there is.
  float curve(float exposed) const;

 private:
  ColorOptions options_;
};

}  // namespace terracast::sensors
