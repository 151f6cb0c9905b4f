#include "world/tile_cast.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "world/ray_lanes.h"

namespace terracast::world {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// A ray that skims the ground for longer is walked to its end.
constexpr int kMaxCasts = 32;

template <int kWidth>
struct PacketOf;
template <>
struct PacketOf<16> {
  using Type = RTCRayHit16;
};
template <>
struct PacketOf<8> {
  using Type = RTCRayHit8;
};

void intersect_packet(const int* valid, RTCScene scene, RTCIntersectContext* context,
                      RTCRayHit16& packet) {
  rtcIntersect16(valid, scene, context, &packet);
}
void intersect_packet(const int* valid, RTCScene scene, RTCIntersectContext* context,
                      RTCRayHit8& packet) {
  rtcIntersect8(valid, scene, context, &packet);
}

void occluded_packet(const int* valid, RTCScene scene, RTCIntersectContext* context,
                     RTCRayHit16& packet) {
  rtcOccluded16(valid, scene, context, &packet.ray);
}
void occluded_packet(const int* valid, RTCScene scene, RTCIntersectContext* context,
                     RTCRayHit8& packet) {
  rtcOccluded8(valid, scene, context, &packet.ray);
}

/// From where to walk, and from where on the walk may end when it is clear.
struct Range {
  double from;
  double until;
};

/// What Embree says of a ray: it meets the raised surface near here.
struct Proposal {
  float way_m;  ///< from the start of the cast
  float u, v;
  float normal_x, normal_y, normal_z;
};

/// Start and length of a cast, in the tile's frame.
struct FloatRay {
  float x, y, z;
  float way_m;
};

class TileCaster {
 public:
  TileCaster(const TileScene& scene, CastKind kind) : scene_(scene) {
    rtcInitIntersectContext(&context_);
    context_.flags = kind == CastKind::FirstCoherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT
                                                     : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  }

  /// Walks a ray that comes in near the surface until it is clear of it; false when it is done with
  /// this tile.
  bool walk_in(RayState& ray) const {
    return walk(ray, {.from = ray.passage.t_entry, .until = ray.passage.t_entry});
  }

  template <class Packet>
  void intersect(const int* valid, Packet& packet) {
    intersect_packet(valid, scene_.handle(), &context_, packet);
  }

  template <class Packet>
  void occluded(const int* valid, Packet& packet) {
    occluded_packet(valid, scene_.handle(), &context_, packet);
  }

  /// Goes on from a proposal to the ray's crossing, or out of the tile.
  void resolve(RayState& ray, Proposal proposal) {
    for (int casts = 1;; ++casts) {
      Range range = walk_range(ray, proposal);
      if (casts == kMaxCasts) range.until = kInfinity;
      if (!walk(ray, range)) return;
      ++num_recasts_;
      if (!cast_again(ray, proposal)) return;
    }
  }

  int num_recasts() const { return num_recasts_; }

 private:
  FloatRay float_ray(const RayState& ray) const {
    const Eigen::Vector3d start =
        ray.walk.origin_world + ray.t_cast * ray.walk.direction_world - scene_.center_world();
    double t_end = ray.passage.t_exit;
    if (ray.walk.direction_world.z() >= 0.0) t_end = std::min(t_end, ray.passage.t_top);
    const double way_m = (t_end - ray.t_cast) * ray.walk.length_m * kFloatRounding +
                         kFarPerEpsilon * scene_.epsilon_m();
    return {.x = static_cast<float>(start.x()),
            .y = static_cast<float>(start.y()),
            .z = static_cast<float>(start.z() - scene_.epsilon_m()),
            .way_m = static_cast<float>(way_m)};
  }

  bool cast_again(const RayState& ray, Proposal& proposal) {
    const FloatRay start = float_ray(ray);
    RTCRayHit single{};
    single.ray.org_x = start.x;
    single.ray.org_y = start.y;
    single.ray.org_z = start.z;
    single.ray.dir_x = ray.direction[0];
    single.ray.dir_y = ray.direction[1];
    single.ray.dir_z = ray.direction[2];
    single.ray.tfar = start.way_m;
    single.ray.mask = 0xffffffffU;
    single.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(scene_.handle(), &context_, &single);
    proposal = {.way_m = single.ray.tfar,
                .u = single.hit.u,
                .v = single.hit.v,
                .normal_x = single.hit.Ng_x,
                .normal_y = single.hit.Ng_y,
                .normal_z = single.hit.Ng_z};
    return single.hit.geomID != RTC_INVALID_GEOMETRY_ID;
  }

  Range walk_range(const RayState& ray, const Proposal& proposal) const {
    const double t_proposed =
        ray.t_cast + static_cast<double>(proposal.way_m) * ray.walk.inverse_length;
    const float along = ray.direction[0] * proposal.normal_x +
                        ray.direction[1] * proposal.normal_y + ray.direction[2] * proposal.normal_z;
    const float inverse_rate = std::abs(proposal.normal_z / along);
    Range range{};
    if (inverse_rate <= kGrazing && !TileScene::is_in_ring(proposal.u, proposal.v)) {
      const double back = kBackPerEpsilon * scene_.epsilon_m() * static_cast<double>(inverse_rate) *
                          ray.walk.inverse_length;
      range = {.from = t_proposed - back, .until = t_proposed + back};
    } else {
      range = around(TileScene::cell_of(proposal.u, proposal.v), ray.walk);
      range = {.from = std::min(range.from, t_proposed),
               .until = std::max(range.until, t_proposed)};
    }
    return {.from = std::clamp(range.from, ray.t_cast, ray.passage.t_exit),
            .until = std::clamp(range.until, ray.t_cast, ray.passage.t_exit)};
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
  bool walk(RayState& ray, const Range& range) const {
    WalkResult& result = ray.walked;
    walk_terrain(scene_.grid(), ray.walk,
                 {.t_entry = ray.passage.t_entry,
                  .may_be_on_surface = ray.may_be_on_surface,
                  .t_exit = ray.passage.t_exit,
                  .t_from = range.from,
                  .t_clear = range.until,
                  .clear_m = scene_.clear_m()},
                 result);
    ray.is_on_surface = result.is_on_surface;
    ray.has_crossing = result.end == WalkResult::End::Crossed;
    if (result.end != WalkResult::End::Clear) return false;
    ray.t_cast = result.t;
    return true;
  }

  const TileScene& scene_;
  RTCIntersectContext context_;
  int num_recasts_ = 0;
};

constexpr int kChunk = RayLanes::kLanes;

void set_lane(const RayState& ray, std::size_t lane, RayLanes& lanes) {
  lanes.origin_x[lane] = ray.walk.origin_world.x();
  lanes.origin_y[lane] = ray.walk.origin_world.y();
  lanes.origin_z[lane] = ray.walk.origin_world.z();
  lanes.direction_x[lane] = ray.walk.direction_world.x();
  lanes.direction_y[lane] = ray.walk.direction_world.y();
  lanes.direction_z[lane] = ray.walk.direction_world.z();
  lanes.inverse_z[lane] = ray.walk.inverse_z;
  lanes.length_m[lane] = ray.walk.length_m;
  lanes.inverse_length[lane] = ray.walk.inverse_length;
  lanes.t_entry[lane] = ray.passage.t_entry;
  lanes.t_exit[lane] = ray.passage.t_exit;
  lanes.t_top[lane] = ray.passage.t_top;
  lanes.side[lane] = ray.passage.side;
}

void set_crossing(const RayLanes& lanes, std::size_t lane, RayState& ray) {
  ray.has_crossing = true;
  ray.walked.t = lanes.t[lane];
  ray.walked.cell_x = lanes.cell_x[lane];
  ray.walked.cell_y = lanes.cell_y[lane];
  ray.walked.is_upper = lanes.is_upper[lane] != 0;
  ray.walked.slope_x = lanes.slope_x[lane];
  ray.walked.slope_y = lanes.slope_y[lane];
}

/// Rays of a packet from `first` on as lanes; the last ray fills the lanes that are left.
void set_lanes(std::span<RayState* const> rays, std::size_t first, RayLanes& lanes) {
  for (std::size_t lane = 0; lane < kChunk; ++lane)
    set_lane(*rays[std::min(first + lane, rays.size() - 1)], lane, lanes);
}

}  // namespace

template <int kWidth>
int cast_through_tile(const TileScene& scene, std::span<RayState* const> rays, CastKind kind) {
  TileCaster caster(scene, kind);
  typename PacketOf<kWidth>::Type packet;
  alignas(64) std::array<int, kWidth> valid;
  std::array<RayLanes, kWidth / kChunk> chunks;
  bool any = false;
  for (std::size_t first = 0; first < kWidth; first += kChunk) {
    RayLanes& lanes = chunks[first / kChunk];
    set_lanes(rays, first, lanes);
    lanes.find_casts(scene);
    for (std::size_t lane = 0; lane < kChunk; ++lane) {
      valid[first + lane] = 0;
      if (first + lane >= rays.size()) continue;
      RayState& ray = *rays[first + lane];
      ray.is_on_surface = false;
      ray.has_crossing = false;
      if (lanes.is_clear[lane] == 0) {
        if (!caster.walk_in(ray)) continue;
        lanes.t_cast[lane] = ray.t_cast;
      }
      valid[first + lane] = -1;
      any = true;
    }
    lanes.set_casts(scene, {.x = packet.ray.org_x + first,
                            .y = packet.ray.org_y + first,
                            .z = packet.ray.org_z + first,
                            .way_m = packet.ray.tfar + first});
  }
  if (!any) return 0;
  // Embree checks the numbers of all lanes, used or not.
  for (std::size_t lane = 0; lane < kWidth; ++lane) {
    const std::array<float, 3>& direction = rays[std::min(lane, rays.size() - 1)]->direction;
    packet.ray.tnear[lane] = 0.0F;
    packet.ray.dir_x[lane] = direction[0];
    packet.ray.dir_y[lane] = direction[1];
    packet.ray.dir_z[lane] = direction[2];
    packet.ray.time[lane] = 0.0F;
    packet.ray.mask[lane] = 0xffffffffU;
    packet.ray.id[lane] = static_cast<unsigned>(lane);
    packet.ray.flags[lane] = 0;
    packet.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
  }
  if (kind == CastKind::Any) {
    // Most rays to the sun or to a camera meet nothing; only for those that meet the raised surface
    // is it asked where.
    std::array<float, kWidth> way_m;
    std::copy_n(packet.ray.tfar, kWidth, way_m.begin());
    caster.occluded(valid.data(), packet);
    any = false;
    for (std::size_t lane = 0; lane < kWidth; ++lane) {
      if (valid[lane] != 0 && packet.ray.tfar[lane] >= 0.0F) valid[lane] = 0;
      any |= valid[lane] != 0;
      packet.ray.tfar[lane] = way_m[lane];
    }
    if (!any) return 0;
  }
  caster.intersect(valid.data(), packet);
  for (std::size_t first = 0; first < kWidth; first += kChunk) {
    RayLanes& lanes = chunks[first / kChunk];
    lanes.cross_at_once(scene, {.way_m = packet.ray.tfar + first,
                                .u = packet.hit.u + first,
                                .v = packet.hit.v + first,
                                .normal_x = packet.hit.Ng_x + first,
                                .normal_y = packet.hit.Ng_y + first,
                                .normal_z = packet.hit.Ng_z + first,
                                .direction_x = packet.ray.dir_x + first,
                                .direction_y = packet.ray.dir_y + first,
                                .direction_z = packet.ray.dir_z + first});
    for (std::size_t lane = 0; lane < kChunk; ++lane) {
      const std::size_t at = first + lane;
      if (valid[at] == 0 || packet.hit.geomID[at] == RTC_INVALID_GEOMETRY_ID) continue;
      RayState& ray = *rays[at];
      if (lanes.crosses[lane] != 0) {
        set_crossing(lanes, lane, ray);
        continue;
      }
      ray.t_cast = lanes.t_cast[lane];
      caster.resolve(ray, {.way_m = packet.ray.tfar[at],
                           .u = packet.hit.u[at],
                           .v = packet.hit.v[at],
                           .normal_x = packet.hit.Ng_x[at],
                           .normal_y = packet.hit.Ng_y[at],
                           .normal_z = packet.hit.Ng_z[at]});
    }
  }
  return caster.num_recasts();
}

template int cast_through_tile<8>(const TileScene&, std::span<RayState* const>, CastKind);
template int cast_through_tile<16>(const TileScene&, std::span<RayState* const>, CastKind);

}  // namespace terracast::world
