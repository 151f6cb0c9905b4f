#pragma once

#include <cstdint>

#include "world/embree_scene.h"

namespace terracast::world {

/// A raised triangle that the ray takes more than this way to close in on by a metre of height
/// places its float hit too loosely along the ray; the walk then starts where the ray enters the
/// cells around.
inline constexpr float kGrazing = 64.0F;
/// How far before and after a proposal the crossing of the raised surface may be, in epsilon times
/// that way: twice the whole error that epsilon stands for.
inline constexpr double kBackPerEpsilon = 2.0;
/// How far beyond the tile a cast goes, in epsilon, and how much longer its way is made.
inline constexpr double kFarPerEpsilon = 8.0;
inline constexpr double kFloatRounding = 1.0 + 0x1.0p-20;

/// What a ray's direction is divided by and multiplied with, for the rays of a batch together.
struct DirectionMeasures {
  static constexpr int kMost = 64;
  using Field = double[kMost];

  /// Components of the directions; one too small to be divided by is made 0.
  alignas(64) Field x, y, z;
  Field inverse_x, inverse_y, inverse_z;  ///< 0 where the component is 0
  Field length_m, inverse_length;  ///< infinite, or no number, where the direction is no good

  /// Of the components that are there.
  void measure();
};

/// Rays in one tile, field by field, so that what every ray goes through is done for all lanes
/// together: the way into the tile, and the common case of the way out of it.
struct RayLanes {
  static constexpr int kLanes = 8;
  template <class T>
  using Field = T[kLanes];

  // Of the ray and its passage; unused lanes hold any ray.
  alignas(64) Field<double> origin_x, origin_y, origin_z;
  Field<double> direction_x, direction_y, direction_z;
  Field<double> inverse_z, length_m, inverse_length;
  Field<double> t_entry, t_exit, t_top;
  Field<std::int32_t> side;  ///< as TilePassage::side

  /// Where the cast begins, and whether it does: the ray is there well above the surface.
  Field<double> t_cast;
  Field<std::int32_t> is_clear;

  /// What Embree proposes, by pointers into its packets.
  struct Proposals {
    const float *way_m, *u, *v, *normal_x, *normal_y, *normal_z;
    const float *direction_x, *direction_y, *direction_z;  ///< unit
  };
  /// Whether the ray crosses the very triangle above which the walk from the proposal would begin;
  /// then that crossing.
  Field<std::int32_t> crosses;
  Field<double> t;
  Field<double> slope_x, slope_y;  ///< rise of the triangle, m/m
  Field<std::int32_t> cell_x, cell_y, is_upper;

  /// Sets t_cast and is_clear: a falling ray is cast from well above the tile's highest point, any
  /// other from t_entry if it is above all borders around there.
  void find_casts(const TileScene& scene);

  /// Start and length of the casts, in the tile's frame, lowered by epsilon.
  struct Casts {
    float *x, *y, *z, *way_m;
  };
  void set_casts(const TileScene& scene, const Casts& casts) const;

  /// Sets `crosses` and the crossings: the same that walk_terrain finds, by the same arithmetic,
  /// where the ray falls through that triangle with room to spare on all sides and the proposal is
  /// neither grazing nor in the ring. For other lanes it says nothing.
  void cross_at_once(const TileScene& scene, const Proposals& proposals);
};

}  // namespace terracast::world
