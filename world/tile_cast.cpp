#include "world/tile_cast.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>

namespace terracast::world {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// A raised triangle that the ray closes in on by less than this (m of height a m of way) places
/// its float hit too loosely along the ray; the walk then starts where the ray enters the cells
/// around.
constexpr double kGrazingRate = 1.0 / 64.0;
/// How far before and after a proposal the crossing of the raised surface may be, in epsilon over
/// the rate: twice the whole error that epsilon stands for.
constexpr double kBackPerEpsilon = 2.0;
constexpr double kFarPerEpsilon = 8.0;
/// A ray that skims the ground for longer is walked to its end.
constexpr int kMaxCasts = 32;
constexpr double kFloatRounding = 1.0 + 0x1.0p-20;

/// RTCRayHit, RTCRayHit4, 8 and 16 are this: arrays of `width` values, one after the other.
struct alignas(64) Packet {
  std::array<float, (12 + 8) * kMaxPacket> values;
  int width;

  explicit Packet(int packet_width) : width(packet_width) {}
  RTCRayHitN* rayhit() { return reinterpret_cast<RTCRayHitN*>(values.data()); }
  RTCRayN* rays() { return RTCRayHitN_RayN(rayhit(), static_cast<unsigned>(width)); }
  RTCHitN* hits() { return RTCRayHitN_HitN(rayhit(), static_cast<unsigned>(width)); }
};
static_assert(sizeof(RTCRayHit16) == sizeof(Packet::values));

/// What Embree says of a ray: it meets the raised surface near here.
struct Proposal {
  double way_m = 0.0;  ///< from the start of the cast
  float u = 0.0F;
  float v = 0.0F;
  double rate = 0.0;  ///< at which the ray closes in on the triangle, m of height a m of way
};

class TileCaster {
 public:
  TileCaster(const TileScene& scene, std::uint32_t tile_index, bool is_coherent)
      : scene_(scene), tile_index_(tile_index) {
    rtcInitIntersectContext(&context_);
    context_.flags =
        is_coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  }

  /// Sets t_cast_ of the lane; false when the ray is done with this tile.
  bool prepare(const TilePassage& passage, int lane) {
    // A falling ray starts well above the tile's highest point, where it is clear whatever lies
    // below.
    const double t_high = passage.t_top + 2.0 * scene_.clear_m() * passage.ray->walk.inverse_z;
    const double t_begin = passage.is_falling ? std::max(passage.t_entry, t_high) : passage.t_entry;
    double& t_cast = t_cast_[static_cast<std::size_t>(lane)];
    t_cast = t_begin;
    if (t_begin > passage.t_entry || is_clear_at_entry(passage)) return true;
    return walk(passage, t_cast, {.from = passage.t_entry, .until = passage.t_entry});
  }

  void fill(Packet& packet, int lane, const TilePassage& passage, double t_cast) const {
    const RayState& ray = *passage.ray;
    const Eigen::Vector3d start =
        ray.walk.origin_world + t_cast * ray.walk.direction_world - scene_.center_world();
    const double t_stop =
        std::min({passage.t_exit, ray.best_t, passage.is_falling ? kInfinity : passage.t_top});
    const double way_m = (t_stop - t_cast) * ray.walk.length_m * kFloatRounding +
                         kFarPerEpsilon * scene_.epsilon_m();
    RTCRayN* rays = packet.rays();
    const auto n = static_cast<unsigned>(packet.width);
    const auto i = static_cast<unsigned>(lane);
    RTCRayN_org_x(rays, n, i) = static_cast<float>(start.x());
    RTCRayN_org_y(rays, n, i) = static_cast<float>(start.y());
    RTCRayN_org_z(rays, n, i) = static_cast<float>(start.z() - scene_.epsilon_m());
    RTCRayN_dir_x(rays, n, i) = ray.direction[0];
    RTCRayN_dir_y(rays, n, i) = ray.direction[1];
    RTCRayN_dir_z(rays, n, i) = ray.direction[2];
    RTCRayN_tnear(rays, n, i) = 0.0F;
    RTCRayN_tfar(rays, n, i) = static_cast<float>(way_m);
    RTCRayN_time(rays, n, i) = 0.0F;
    RTCRayN_mask(rays, n, i) = 0xffffffffU;
    RTCRayN_id(rays, n, i) = i;
    RTCRayN_flags(rays, n, i) = 0;
    RTCHitN_geomID(packet.hits(), n, i) = RTC_INVALID_GEOMETRY_ID;
  }

  void intersect(const int* valid, Packet& packet) {
    auto* values = packet.values.data();
    switch (packet.width) {
      case 16:
        return rtcIntersect16(valid, scene_.handle(), &context_,
                              reinterpret_cast<RTCRayHit16*>(values));
      case 8:
        return rtcIntersect8(valid, scene_.handle(), &context_,
                             reinterpret_cast<RTCRayHit8*>(values));
      case 4:
        return rtcIntersect4(valid, scene_.handle(), &context_,
                             reinterpret_cast<RTCRayHit4*>(values));
      default:
        return rtcIntersect1(scene_.handle(), &context_, reinterpret_cast<RTCRayHit*>(values));
    }
  }

  /// Goes on from what Embree says of a lane to the ray's crossing, or out of the tile.
  void resolve(Packet& packet, int lane, const TilePassage& passage) {
    double t_cast = t_cast_[static_cast<std::size_t>(lane)];
    Proposal proposal;
    if (!read(packet, lane, passage, proposal)) return;
    Packet single(1);
    for (int casts = 1;; ++casts) {
      Range range = walk_range(passage, t_cast, proposal);
      if (casts == kMaxCasts) range.until = kInfinity;
      if (!walk(passage, t_cast, range)) return;
      ++num_recasts_;
      fill(single, 0, passage, t_cast);
      const int always = -1;
      intersect(&always, single);
      if (!read(single, 0, passage, proposal)) return;
    }
  }

  double t_cast(int lane) const { return t_cast_[static_cast<std::size_t>(lane)]; }
  int num_recasts() const { return num_recasts_; }

 private:
  /// From where to walk, and from where on the walk may end when it is clear.
  struct Range {
    double from;
    double until;
  };

  bool is_clear_at_entry(const TilePassage& passage) const {
    const WalkRay& ray = passage.ray->walk;
    const Eigen::Vector3d entry = ray.origin_world + passage.t_entry * ray.direction_world;
    const TerrainGrid& grid = scene_.grid();
    if (passage.side >= 0) {
      const int cell = passage.side < 2 ? grid.row_at(entry.y()) : grid.column_at(entry.x());
      if (entry.z() > scene_.border_top_z_world(passage.side, cell) + 2 * scene_.clear_m())
        return true;
    } else if (entry.z() > scene_.highest_z_world() + scene_.clear_m()) {
      return true;
    }
    return entry.z() - scene_.center_world().z() >
           grid.z_at(entry.x(), entry.y()) + scene_.clear_m();
  }

  static bool read(Packet& packet, int lane, const TilePassage& passage, Proposal& proposal) {
    const auto n = static_cast<unsigned>(packet.width);
    const auto i = static_cast<unsigned>(lane);
    RTCHitN* hits = packet.hits();
    if (RTCHitN_geomID(hits, n, i) == RTC_INVALID_GEOMETRY_ID) return false;
    proposal.way_m = static_cast<double>(RTCRayN_tfar(packet.rays(), n, i));
    proposal.u = RTCHitN_u(hits, n, i);
    proposal.v = RTCHitN_v(hits, n, i);
    const auto& direction = passage.ray->direction;
    const float normal_x = RTCHitN_Ng_x(hits, n, i);
    const float normal_y = RTCHitN_Ng_y(hits, n, i);
    const float normal_z = RTCHitN_Ng_z(hits, n, i);
    const float along = direction[0] * normal_x + direction[1] * normal_y + direction[2] * normal_z;
    proposal.rate = static_cast<double>(std::abs(along / normal_z));
    return true;
  }

  Range walk_range(const TilePassage& passage, double t_cast, const Proposal& proposal) const {
    const RayState& ray = *passage.ray;
    const double t_proposed = t_cast + proposal.way_m * ray.inverse_length;
    const TileScene::NamedCell cell = TileScene::cell_of(proposal.u, proposal.v);
    Range range{};
    if (proposal.rate >= kGrazingRate && !cell.in_ring) {
      const double back = kBackPerEpsilon * scene_.epsilon_m() / proposal.rate * ray.inverse_length;
      range = {.from = t_proposed - back, .until = t_proposed + back};
    } else {
      range = around(cell, ray.walk);
      range = {.from = std::min(range.from, t_proposed),
               .until = std::max(range.until, t_proposed)};
    }
    return {.from = std::clamp(range.from, t_cast, passage.t_exit),
            .until = std::clamp(range.until, t_cast, passage.t_exit)};
  }

  /// Where a ray passes the three by three cells around a cell.
  Range around(const TileScene::NamedCell& cell, const WalkRay& ray) const {
    const TerrainGrid& grid = scene_.grid();
    Range range{.from = -kInfinity, .until = kInfinity};
    const auto clip = [&](double low, double high, double origin, double inverse) {
      if (inverse == 0.0) return;
      const double a = (low - origin) * inverse;
      const double b = (high - origin) * inverse;
      range.from = std::max(range.from, std::min(a, b));
      range.until = std::min(range.until, std::max(a, b));
    };
    clip(grid.x_world(cell.x - 1), grid.x_world(cell.x + 2), ray.origin_world.x(), ray.inverse_x);
    clip(grid.y_world(cell.y - 1), grid.y_world(cell.y + 2), ray.origin_world.y(), ray.inverse_y);
    return range;
  }

  /// Walks; records a crossing. True when the ray is clear again, at t_cast.
  bool walk(const TilePassage& passage, double& t_cast, const Range& range) const {
    RayState& ray = *passage.ray;
    const WalkResult result = walk_terrain(scene_.grid(), ray.walk,
                                           {.t_entry = passage.t_entry,
                                            .t_exit = passage.t_exit,
                                            .t_from = range.from,
                                            .t_stop = ray.best_t,
                                            .t_clear = range.until,
                                            .clear_m = scene_.clear_m()});
    if (result.end == WalkResult::End::Clear) {
      t_cast = result.t;
      return true;
    }
    if (result.end == WalkResult::End::Crossed &&
        (result.t < ray.best_t || (result.t == ray.best_t && tile_index_ < ray.best_tile))) {
      ray.best_t = result.t;
      ray.best_tile = tile_index_;
      ray.best = result;
    }
    return false;
  }

  const TileScene& scene_;
  std::uint32_t tile_index_;
  RTCIntersectContext context_;
  std::array<double, kMaxPacket> t_cast_ = {};
  int num_recasts_ = 0;
};

}  // namespace

bool find_passage(const TileBounds& bounds, RayState& ray, TilePassage& passage) {
  const Eigen::Vector3d& o = ray.walk.origin_world;
  const Eigen::Vector3d& d = ray.walk.direction_world;
  double t_entry = ray.t_min;
  double t_exit = ray.t_max;
  int side = -1;
  const auto clip = [&](double low, double high, double origin, double direction, double inverse,
                        int low_side) {
    if (direction == 0.0) return origin >= low && origin <= high;
    const double t_low = (low - origin) * inverse;
    const double t_high = (high - origin) * inverse;
    const double t_in = direction > 0.0 ? t_low : t_high;
    const double t_out = direction > 0.0 ? t_high : t_low;
    if (t_in > t_entry) {
      t_entry = t_in;
      side = direction > 0.0 ? low_side : low_side + 1;
    }
    t_exit = std::min(t_exit, t_out);
    return t_entry <= t_exit;
  };
  if (!clip(bounds.x0_world, bounds.x1_world, o.x(), d.x(), ray.walk.inverse_x, 0)) return false;
  if (!clip(bounds.y0_world, bounds.y1_world, o.y(), d.y(), ray.walk.inverse_y, 2)) return false;
  if (t_entry > ray.best_t) return false;
  passage.is_falling = d.z() < 0.0;
  if (d.z() == 0.0) {
    if (o.z() > bounds.highest_z_world) return false;
    passage.t_top = kInfinity;
  } else {
    passage.t_top = (bounds.highest_z_world - o.z()) * ray.walk.inverse_z;
    if (passage.is_falling ? passage.t_top > t_exit : passage.t_top < t_entry) return false;
  }
  passage.ray = &ray;
  passage.t_entry = t_entry;
  passage.t_exit = t_exit;
  passage.side = side;
  return true;
}

int cast_through_tile(const TileScene& scene, std::uint32_t tile_index,
                      std::array<TilePassage, kMaxPacket>& passages, int width, bool is_coherent) {
  TileCaster caster(scene, tile_index, is_coherent);
  Packet packet(width);
  alignas(64) std::array<int, kMaxPacket> valid = {};
  bool any = false;
  for (int lane = 0; lane < width; ++lane) {
    const TilePassage& passage = passages[static_cast<std::size_t>(lane)];
    if (passage.ray == nullptr || !caster.prepare(passage, lane)) continue;
    caster.fill(packet, lane, passage, caster.t_cast(lane));
    valid[static_cast<std::size_t>(lane)] = -1;
    any = true;
  }
  if (!any) return 0;
  caster.intersect(valid.data(), packet);
  for (int lane = 0; lane < width; ++lane)
    if (valid[static_cast<std::size_t>(lane)] != 0)
      caster.resolve(packet, lane, passages[static_cast<std::size_t>(lane)]);
  return caster.num_recasts();
}

}  // namespace terracast::world
