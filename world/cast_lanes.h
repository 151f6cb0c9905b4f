#pragma once

#include <cstdint>

#include "world/embree_scene.h"
#include "world/ray_lanes.h"

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

/// What of a tile its casts need.
struct TileFrame {
  explicit TileFrame(const TileScene& scene)
      : grid(scene.grid()),
        entry_tops_z_world(scene.entry_tops_z_world()),
        center_x(scene.center_world().x()),
        center_y(scene.center_world().y()),
        center_z(scene.center_world().z()),
        epsilon_m(scene.epsilon_m()),
        clear_m(scene.clear_m()) {}

  const TerrainGrid& grid;
  const double* entry_tops_z_world;
  double center_x, center_y, center_z;
  double epsilon_m;
  double clear_m;
};

/// Start and length of a cast in the tile's frame, lowered by epsilon.
struct FloatCast {
  float x, y, z;
  float way_m;
};
TERRACAST_PACKET_INLINE FloatCast float_cast(const TileFrame& tile, const RayLanes& rays, int lane,
                                             double t_cast) {
  const double t_exit = rays.t_exit[lane];
  const double t_end = core::smaller(t_exit, rays.t_top[lane]);
  const double end = rays.direction_z[lane] < 0.0 ? t_exit : t_end;
  return {
      .x =
          static_cast<float>(rays.origin_x[lane] + t_cast * rays.direction_x[lane] - tile.center_x),
      .y =
          static_cast<float>(rays.origin_y[lane] + t_cast * rays.direction_y[lane] - tile.center_y),
      .z = static_cast<float>(rays.origin_z[lane] + t_cast * rays.direction_z[lane] -
                              tile.center_z - tile.epsilon_m),
      .way_m = static_cast<float>((end - t_cast) * rays.length_m[lane] * kFloatRounding +
                                  kFarPerEpsilon * tile.epsilon_m)};
}

/// Where rays cross the true surface.
struct CrossingLanes {
  alignas(64) RayLanes::Field<double> t;
  RayLanes::Field<double> slope_x, slope_y;  ///< rise of the triangle, m/m
  RayLanes::Field<std::int32_t> cell_x, cell_y, is_upper;

  void set(int lane, const WalkResult& walked);
  void copy(int lane, const CrossingLanes& from, int from_lane);
};

/// A group of rays cast at a tile: what is done for all lanes together.
struct CastLanes {
  alignas(64) RayLanes::Field<double> t_cast;  ///< where the cast begins

  /// Sets it: a falling ray is cast from well above the tile's highest point, any other from
  /// t_entry.
  /// returns   rays that are there well above the surface: all such of `asked`, others or not
  LaneMask find_clear(const TileScene& scene, const RayLanes& rays, LaneMask asked);

  /// The lanes of one of Embree's packets that these rays take.
  struct Packet {
    int* valid;
    float *x, *y, *z, *near_m;
    float *direction_x, *direction_y, *direction_z, *time, *way_m;
    unsigned *mask, *id, *flags, *geometry;
  };
  /// Fills all of it, starts and lengths in the tile's frame, lowered by epsilon.
  /// cast   the lanes to be cast; the numbers of the others are as good
  void fill(const TileScene& scene, const RayLanes& rays, LaneMask cast,
            const Packet& packet) const;

  /// What Embree proposes, by pointers into its packets.
  struct Proposals {
    const int* valid;          ///< 0: not asked
    const unsigned* geometry;  ///< none: no proposal
    const float *way_m, *u, *v, *normal_x, *normal_y, *normal_z;
  };
  struct Outcome {
    LaneMask is_proposed;
    LaneMask crosses;
  };
  /// Finds the rays that cross the very triangle above which the walk from the proposal would
  /// begin, and where: the same that walk_terrain finds, by the same arithmetic, where the ray falls
  /// through that triangle with room to spare on all sides and the proposal is neither grazing nor
  /// in the ring. Of other rays it says nothing.
  Outcome cross_at_once(const TileScene& scene, const RayLanes& rays, const Proposals& proposals,
                        CrossingLanes& crossings) const;
};

}  // namespace terracast::world
