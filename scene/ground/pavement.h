#pragma once

#include <cstdint>

#include "scene/ground/blend.h"
#include "world/ground_paint.h"

namespace terracast::scene {

/// A place on painted ground, and what noise says there (each of root mean square 1).
struct PavedPlace {
  const world::PaintSample& paint;
  double x_m;  ///< a level grid of the world's, for patterns of areas, which have no line
  double y_m;
  float footprint_m;
  float patch;   ///< 128 to 32 m
  float clump;   ///< 16 to 1 m
  float coarse;  ///< 64 to 8 m
  float grain;   ///< 4 to 0.5 m
  float fine;    ///< 0.25 m to 8 mm
};

/// What light meets there.
struct PavedLook {
  Rgb albedo;
  float openness;  ///< share of the ambient light that hollows leave
};

/// Looks of roads, runways, tracks, places: their paving with its wear, seams, joints and dirt, and the
/// marks on it. Lines finer than the footprint fade into the average by the share that they cover.
/// Threads: safe.
PavedLook look_at_paving(const PavedPlace& place, std::uint32_t seed);

/// Slope of the small relief that a paving has, for bent normals: root mean square of an octave.
float relief_of(world::Paving paving);

}  // namespace terracast::scene
