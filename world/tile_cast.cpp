#include "world/tile_cast.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace terracast::world {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// A raised triangle that the ray takes more than this way to close in on by a metre of height places its float hit too
/// loosely along the ray; the walk then starts where the ray enters the cells around.
constexpr float kGrazing = 64.0F;
/// How far before and after a proposal the crossing of the raised surface may be, in epsilon times that way: twice the
/// whole error that epsilon stands for.
constexpr double kBackPerEpsilon = 2.0;
constexpr double kFarPerEpsilon = 8.0;
constexpr double kFloatRounding = 1.0 + 0x1.0p-20;
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

  /// Finds where the cast begins; false when the ray is done with this tile.
  bool prepare(RayState& ray) const {
    const TilePassage& passage = ray.passage;
    ray.t_cast = passage.t_entry;
    ray.is_on_surface = false;
    if (ray.walk.direction_world.z() < 0.0) {
      // A falling ray starts well above the tile's highest point, where it is clear whatever lies below.
      const double t_high = passage.t_top + 2.0 * scene_.clear_m() * ray.walk.inverse_z;
      if (t_high > passage.t_entry) {
        ray.t_cast = t_high;
        return true;
      }
    }
    if (comes_in_high(ray)) return true;
    return walk(ray, {.from = passage.t_entry, .until = passage.t_entry});
  }

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
  bool comes_in_high(const RayState& ray) const {
    const TilePassage& passage = ray.passage;
    const Eigen::Vector3d entry =
        ray.walk.origin_world + passage.t_entry * ray.walk.direction_world;
    if (passage.side < 0) return entry.z() > scene_.highest_z_world() + scene_.clear_m();
    const TerrainGrid& grid = scene_.grid();
    const int cell = passage.side < 2 ? grid.row_at(entry.y()) : grid.column_at(entry.x());
    return entry.z() > scene_.border_top_z_world(passage.side, cell) + 2.0 * scene_.clear_m();
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
    const double t_proposed = ray.t_cast + static_cast<double>(proposal.way_m) * ray.inverse_length;
    const float along = ray.direction[0] * proposal.normal_x +
                        ray.direction[1] * proposal.normal_y + ray.direction[2] * proposal.normal_z;
    const float inverse_rate = std::abs(proposal.normal_z / along);
    Range range{};
    if (inverse_rate <= kGrazing && !TileScene::is_in_ring(proposal.u, proposal.v)) {
      const double back = kBackPerEpsilon * scene_.epsilon_m() * static_cast<double>(inverse_rate) *
                          ray.inverse_length;
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

}  // namespace

template <int kWidth>
int cast_through_tile(const TileScene& scene, const std::array<RayState*, kWidth>& rays,
                      CastKind kind) {
  TileCaster caster(scene, kind);
  typename PacketOf<kWidth>::Type packet;
  alignas(64) std::array<int, kWidth> valid;
  bool any = false;
  for (std::size_t lane = 0; lane < kWidth; ++lane) {
    // Embree checks the numbers of all lanes, used or not.
    FloatRay start = {.x = 0.0F, .y = 0.0F, .z = 0.0F, .way_m = 0.0F};
    std::array<float, 3> direction = {0.0F, 0.0F, 1.0F};
    valid[lane] = 0;
    if (rays[lane] != nullptr && caster.prepare(*rays[lane])) {
      start = caster.float_ray(*rays[lane]);
      direction = rays[lane]->direction;
      valid[lane] = -1;
      any = true;
    }
    packet.ray.org_x[lane] = start.x;
    packet.ray.org_y[lane] = start.y;
    packet.ray.org_z[lane] = start.z;
    packet.ray.tnear[lane] = 0.0F;
    packet.ray.dir_x[lane] = direction[0];
    packet.ray.dir_y[lane] = direction[1];
    packet.ray.dir_z[lane] = direction[2];
    packet.ray.time[lane] = 0.0F;
    packet.ray.tfar[lane] = start.way_m;
    packet.ray.mask[lane] = 0xffffffffU;
    packet.ray.id[lane] = static_cast<unsigned>(lane);
    packet.ray.flags[lane] = 0;
    packet.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
  }
  if (!any) return 0;
  if (kind == CastKind::Any) {
    // Most rays to the sun or to a camera meet nothing; only for those that meet the raised surface is it asked where.
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
  for (std::size_t lane = 0; lane < kWidth; ++lane) {
    if (valid[lane] == 0 || packet.hit.geomID[lane] == RTC_INVALID_GEOMETRY_ID) continue;
    caster.resolve(*rays[lane], {.way_m = packet.ray.tfar[lane],
                                 .u = packet.hit.u[lane],
                                 .v = packet.hit.v[lane],
                                 .normal_x = packet.hit.Ng_x[lane],
                                 .normal_y = packet.hit.Ng_y[lane],
                                 .normal_z = packet.hit.Ng_z[lane]});
  }
  return caster.num_recasts();
}

template int cast_through_tile<8>(const TileScene&, const std::array<RayState*, 8>&, CastKind);
template int cast_through_tile<16>(const TileScene&, const std::array<RayState*, 16>&, CastKind);

}  // namespace terracast::world
