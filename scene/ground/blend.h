#pragma once

#include "core/packet_code.h"

/// Small arithmetic that looks are painted with, the same in packets and one by one.
namespace terracast::scene {

TERRACAST_PACKET_INLINE float absolute(float a) { return a < 0.0f ? -a : a; }
TERRACAST_PACKET_INLINE float clamped(float x, float lowest, float highest) {
  return core::smaller(core::larger(x, lowest), highest);
}
/// 0 below -width, 1 above width, smooth between.
TERRACAST_PACKET_INLINE float step_up(float x, float width) {
  const float t = clamped(0.5f + 0.5f * x / width, 0.0f, 1.0f);
  return t * t * (3.0f - 2.0f * t);
}
/// 0 below 0, linear to 1 at 1.
TERRACAST_PACKET_INLINE float ramp(float x) { return clamped(x, 0.0f, 1.0f); }
/// How much of a thing of this size a footprint still tells: 1 up to half of it, 0 from all of it on.
TERRACAST_PACKET_INLINE float told(float footprint_m, float size_m) {
  return ramp(2.0f - 2.0f * footprint_m / size_m);
}

/// Linear albedo.
struct Rgb {
  float r, g, b;
};
/// Lays a colour over what is there.
TERRACAST_PACKET_INLINE void lay(Rgb& color, float share, float r, float g, float b) {
  color.r += share * (r - color.r);
  color.g += share * (g - color.g);
  color.b += share * (b - color.b);
}
TERRACAST_PACKET_INLINE void lay(Rgb& color, float share, const Rgb& over) {
  lay(color, share, over.r, over.g, over.b);
}
TERRACAST_PACKET_INLINE void shade(Rgb& color, float factor) {
  color.r *= factor;
  color.g *= factor;
  color.b *= factor;
}

}  // namespace terracast::scene
