#include "world/cast_lanes.h"

#include <embree3/rtcore.h>

#include "core/packet_code.h"
#include "world/triangle_plane.h"

namespace terracast::world {
namespace {

using core::larger;
using core::smaller;
using core::truth;

constexpr int kLanes = RayLanes::kLanes;
/// More than positions in a cell err by.
constexpr double kRoomCells = 1e-6;

TERRACAST_PACKET_INLINE void set_cells(const Doubles& cells, Integers& cell) {
  for (int i = 0; i < kLanes; ++i)
    cell[i] = static_cast<std::int32_t>(smaller(larger(cells[i], 0.0), kTileCells - 1.0));
}

/// Begins casts well above the tile's highest point, or where rays come in.
/// returns   the falling rays that come in above that point
TERRACAST_PACKET_CODE
LaneMask begin_casts(const TileFrame& tile, const RayLanes& rays, Doubles& __restrict t_cast) {
  Doubles falls;
  for (int i = 0; i < kLanes; ++i) {
    const double t_high = rays.t_top[i] + 2.0 * tile.clear_m * rays.inverse_z[i];
    const double t_entry = rays.t_entry[i];
    falls[i] = truth((rays.direction_z[i] < 0.0) & (t_high > t_entry));
    t_cast[i] = falls[i] > 0.0 ? t_high : t_entry;
  }
  Integers fall;
  set_integers(falls, fall);
  return lanes_where(fall);
}

/// Returns the rays that are well above the surface where they come in.
TERRACAST_PACKET_CODE
LaneMask find_clear_entries(const TileFrame& tile, const RayLanes& rays) {
  const double corner_x = tile.grid.corner_x_world;
  const double corner_y = tile.grid.corner_y_world;
  const double cells_per_m = tile.grid.inverse_spacing;
  Doubles side, x_cells, y_cells, along;
  for (int i = 0; i < kLanes; ++i) {
    side[i] = rays.side[i];
    x_cells[i] =
        (rays.origin_x[i] + rays.t_entry[i] * rays.direction_x[i] - corner_x) * cells_per_m;
    y_cells[i] =
        (rays.origin_y[i] + rays.t_entry[i] * rays.direction_y[i] - corner_y) * cells_per_m;
  }
  for (int i = 0; i < kLanes; ++i) along[i] = side[i] < 2.0 ? y_cells[i] : x_cells[i];
  Integers cell;
  set_cells(along, cell);
  Doubles top;
  for (int i = 0; i < kLanes; ++i) {
    const int row = rays.side[i] < 0 ? TileScene::kInside : rays.side[i];
    top[i] = tile.entry_tops_z_world[row * TileScene::kEntryBlocks +
                                     cell[i] / TileScene::kEntryBlockCells];
  }
  Doubles is_clear;
  for (int i = 0; i < kLanes; ++i)
    is_clear[i] = truth(rays.origin_z[i] + rays.t_entry[i] * rays.direction_z[i] > top[i]);
  Integers clear;
  set_integers(is_clear, clear);
  return lanes_where(clear);
}

TERRACAST_PACKET_CODE
void fill_packet(const TileFrame& tile, const RayLanes& rays, const Doubles& t_cast, LaneMask cast,
                 const CastLanes::Packet& packet) {
  RayLanes::Field<float> x, y, z, way_m;
  for (int i = 0; i < kLanes; ++i) {
    const FloatCast start = float_cast(tile, rays, i, t_cast[i]);
    x[i] = start.x;
    y[i] = start.y;
    z[i] = start.z;
    way_m[i] = start.way_m;
  }
  for (int i = 0; i < kLanes; ++i) packet.x[i] = x[i];
  for (int i = 0; i < kLanes; ++i) packet.y[i] = y[i];
  for (int i = 0; i < kLanes; ++i) packet.z[i] = z[i];
  for (int i = 0; i < kLanes; ++i) packet.way_m[i] = way_m[i];
  for (int i = 0; i < kLanes; ++i) packet.direction_x[i] = rays.unit_x[i];
  for (int i = 0; i < kLanes; ++i) packet.direction_y[i] = rays.unit_y[i];
  for (int i = 0; i < kLanes; ++i) packet.direction_z[i] = rays.unit_z[i];
  for (int i = 0; i < kLanes; ++i) packet.near_m[i] = 0.0F;
  for (int i = 0; i < kLanes; ++i) packet.time[i] = 0.0F;
  for (int i = 0; i < kLanes; ++i) packet.mask[i] = 0xffffffffU;
  for (int i = 0; i < kLanes; ++i) packet.id[i] = 0U;
  for (int i = 0; i < kLanes; ++i) packet.flags[i] = 0U;
  for (int i = 0; i < kLanes; ++i) packet.geometry[i] = RTC_INVALID_GEOMETRY_ID;
  for (int i = 0; i < kLanes; ++i) packet.valid[i] = -static_cast<std::int32_t>((cast >> i) & 1U);
}

/// A walk's beginning, and whether (0 or 1) it may be at once at its end.
struct Beginnings {
  Doubles t;
  Doubles is_plain;
};

TERRACAST_PACKET_CODE
void begin_walks(const TileFrame& tile, const RayLanes& rays, const Doubles& t_cast,
                 const CastLanes::Proposals& near, Beginnings& __restrict begin) {
  RayLanes::Field<float> inverse_rate, is_plain;
  for (int i = 0; i < kLanes; ++i) {
    const float along = rays.unit_x[i] * near.normal_x[i] + rays.unit_y[i] * near.normal_y[i] +
                        rays.unit_z[i] * near.normal_z[i];
    const float rate = near.normal_z[i] / along;
    inverse_rate[i] = rate < 0.0F ? -rate : rate;
    const float low = smaller(near.u[i], near.v[i]);
    const float high = larger(near.u[i], near.v[i]);
    const bool is_in_cells = (low > TileScene::kRingEnd) & (high < 1.0F - TileScene::kRingEnd);
    is_plain[i] = ((inverse_rate[i] <= kGrazing) & is_in_cells) ? 1.0F : 0.0F;
  }
  for (int i = 0; i < kLanes; ++i) {
    const double back = kBackPerEpsilon * tile.epsilon_m * static_cast<double>(inverse_rate[i]) *
                        rays.inverse_length[i];
    const double t = t_cast[i] + static_cast<double>(near.way_m[i]) * rays.inverse_length[i] - back;
    begin.t[i] = smaller(larger(t, t_cast[i]), rays.t_exit[i]);
    begin.is_plain[i] =
        truth((static_cast<double>(is_plain[i]) > 0.0) & (begin.t[i] > rays.t_entry[i]));
  }
}

/// The triangles above which walks begin.
struct Triangles {
  Integers cell_x, cell_y, is_upper;
  Doubles upward;            ///< +1 for the upper triangle, -1 for the lower one
  Doubles along_x, along_y;  ///< of the beginning, from the triangle's right angle into it
  Doubles from_x, from_y;    ///< of the ray's origin, from the right angle
  Doubles qx, qy;            ///< cells a t
  RayLanes::Field<float> z_corner, z_x, z_y;  ///< heights at the right angle, along x, along y
};

TERRACAST_PACKET_INLINE void find_triangles(const TerrainGrid& grid, const RayLanes& rays,
                                            const Beginnings& begin,
                                            Triangles& __restrict triangles) {
  const double cells_per_m = grid.inverse_spacing;
  const double spacing_m = grid.spacing_m;
  const double corner_x = grid.corner_x_world;
  const double corner_y = grid.corner_y_world;
  Doubles x_cells, y_cells;  // where the walk begins
  for (int i = 0; i < kLanes; ++i) {
    const double qx = rays.direction_x[i] * cells_per_m;
    const double qy = rays.direction_y[i] * cells_per_m;
    x_cells[i] = (rays.origin_x[i] - corner_x) * cells_per_m + begin.t[i] * qx;
    y_cells[i] = (rays.origin_y[i] - corner_y) * cells_per_m + begin.t[i] * qy;
    triangles.qx[i] = qx;
    triangles.qy[i] = qy;
  }
  set_cells(x_cells, triangles.cell_x);
  set_cells(y_cells, triangles.cell_y);
  Doubles is_upper;
  for (int i = 0; i < kLanes; ++i) {
    const double x = triangles.cell_x[i];
    const double y = triangles.cell_y[i];
    const double u = x_cells[i] - x;
    const double v = y_cells[i] - y;
    const double k = truth(u + v > 1.0);
    triangles.along_x[i] = k + (1.0 - 2.0 * k) * u;
    triangles.along_y[i] = k + (1.0 - 2.0 * k) * v;
    triangles.from_x[i] = (rays.origin_x[i] - (corner_x + x * spacing_m)) * cells_per_m - k;
    triangles.from_y[i] = (rays.origin_y[i] - (corner_y + y * spacing_m)) * cells_per_m - k;
    triangles.upward[i] = 2.0 * k - 1.0;
    is_upper[i] = k;
  }
  set_integers(is_upper, triangles.is_upper);

  const auto column = static_cast<std::int32_t>(grid.sample_stride);
  const auto row = static_cast<std::int32_t>(grid.row_stride);
  Integers corner, beside_x, beside_y;
  for (int i = 0; i < kLanes; ++i) {
    const std::int32_t k = triangles.is_upper[i];
    corner[i] = (triangles.cell_y[i] + k) * row + (triangles.cell_x[i] + k) * column;
    beside_x[i] = corner[i] + (1 - 2 * k) * column;
    beside_y[i] = corner[i] + (1 - 2 * k) * row;
  }
  for (int i = 0; i < kLanes; ++i) {
    triangles.z_corner[i] = grid.z_tile[corner[i]];
    triangles.z_x[i] = grid.z_tile[beside_x[i]];
    triangles.z_y[i] = grid.z_tile[beside_y[i]];
  }
}

/// Returns the rays that cross the triangle above which they begin.
TERRACAST_PACKET_CODE
LaneMask cross_triangles(const TileFrame& tile, const RayLanes& rays, const Beginnings& begin,
                         CrossingLanes& __restrict crossings) {
  const double cells_per_m = tile.grid.inverse_spacing;
  Triangles triangles;
  find_triangles(tile.grid, rays, begin, triangles);
  Doubles crosses;
  for (int i = 0; i < kLanes; ++i) {
    const double upward = triangles.upward[i];
    const TrianglePlane plane = triangle_plane(
        static_cast<double>(triangles.z_corner[i]), static_cast<double>(triangles.z_x[i]),
        static_cast<double>(triangles.z_y[i]), upward, triangles.from_x[i], triangles.from_y[i],
        rays.origin_z[i] - tile.center_z, rays.direction_z[i], triangles.qx[i], triangles.qy[i]);
    const double t = -plane.a / plane.b;
    const double hit_x = -upward * (triangles.from_x[i] + t * triangles.qx[i]);
    const double hit_y = -upward * (triangles.from_y[i] + t * triangles.qy[i]);
    const double begin_x = triangles.along_x[i];
    const double begin_y = triangles.along_y[i];
    const double room = smaller(smaller(begin_x, begin_y), smaller(hit_x, hit_y));
    const double reach = larger(begin_x + begin_y, hit_x + hit_y);
    crossings.t[i] = t;
    crossings.slope_x[i] = plane.rise_x * cells_per_m;
    crossings.slope_y[i] = plane.rise_y * cells_per_m;
    crosses[i] =
        truth((begin.is_plain[i] > 0.0) & (plane.b < 0.0) & (plane.a + plane.b * begin.t[i] > 0.0) &
              (t < rays.t_exit[i]) & (room > kRoomCells) & (reach < 1.0 - kRoomCells));
  }
  Integers is_crossing;
  set_integers(crosses, is_crossing);
  for (int i = 0; i < kLanes; ++i) {
    crossings.cell_x[i] = triangles.cell_x[i];
    crossings.cell_y[i] = triangles.cell_y[i];
    crossings.is_upper[i] = triangles.is_upper[i];
  }
  return lanes_where(is_crossing);
}

TERRACAST_PACKET_CODE
LaneMask proposed_lanes(const int* valid, const unsigned* geometry) {
  Integers is_proposed;
  for (int i = 0; i < kLanes; ++i)
    is_proposed[i] = -valid[i] & (geometry[i] != RTC_INVALID_GEOMETRY_ID ? 1 : 0);
  return lanes_where(is_proposed);
}

}  // namespace

void CrossingLanes::set(int lane, const WalkResult& walked) {
  t[lane] = walked.t;
  slope_x[lane] = walked.slope_x;
  slope_y[lane] = walked.slope_y;
  cell_x[lane] = walked.cell_x;
  cell_y[lane] = walked.cell_y;
  is_upper[lane] = walked.is_upper ? 1 : 0;
}

void CrossingLanes::copy(int lane, const CrossingLanes& from, int from_lane) {
  t[lane] = from.t[from_lane];
  slope_x[lane] = from.slope_x[from_lane];
  slope_y[lane] = from.slope_y[from_lane];
  cell_x[lane] = from.cell_x[from_lane];
  cell_y[lane] = from.cell_y[from_lane];
  is_upper[lane] = from.is_upper[from_lane];
}

LaneMask CastLanes::find_clear(const TileScene& scene, const RayLanes& rays, LaneMask asked) {
  const TileFrame tile(scene);
  const LaneMask falling = begin_casts(tile, rays, t_cast);
  return (asked & ~falling) == 0 ? falling : falling | find_clear_entries(tile, rays);
}

void CastLanes::fill(const TileScene& scene, const RayLanes& rays, LaneMask cast,
                     const Packet& packet) const {
  fill_packet(TileFrame(scene), rays, t_cast, cast, packet);
}

CastLanes::Outcome CastLanes::cross_at_once(const TileScene& scene, const RayLanes& rays,
                                            const Proposals& proposals,
                                            CrossingLanes& crossings) const {
  const LaneMask proposed = proposed_lanes(proposals.valid, proposals.geometry);
  if (proposed == 0) return {.is_proposed = 0, .crosses = 0};
  const TileFrame tile(scene);
  Beginnings begin;
  begin_walks(tile, rays, t_cast, proposals, begin);
  return {.is_proposed = proposed,
          .crosses = proposed & cross_triangles(tile, rays, begin, crossings)};
}

}  // namespace terracast::world
