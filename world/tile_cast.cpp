#include "world/tile_cast.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "world/terrain_walk.h"

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

/// One ray in one tile, for which Embree is asked again as often as the walk refuses its proposals.
class RayCaster {
 public:
  RayCaster(const TileScene& scene, const RayLanes& rays, int lane)
      : scene_(scene), rays_(rays), lane_(lane), ray_(rays.walk_ray(lane)) {}

  /// Walks from the entry until the ray is clear of the surface; false when it is done with this
  /// tile.
  bool walk_in() {
    const double t_entry = rays_.t_entry[lane_];
    return walk({.from = t_entry, .until = t_entry});
  }

  /// Goes on from a proposal of the cast from t_cast to the ray's crossing, or out of the tile.
  /// returns   number of times that Embree was asked again
  int resolve(RTCIntersectContext& context, double t_cast, Proposal proposal) {
    t_cast_ = t_cast;
    for (int casts = 1;; ++casts) {
      Range range = walk_range(proposal);
      if (casts == kMaxCasts) range.until = kInfinity;
      if (!walk(range)) return casts - 1;
      if (!cast_again(context, proposal)) return casts;
    }
  }

  double t_cast() const { return t_cast_; }
  bool has_crossing() const { return walked_.end == WalkResult::End::Crossed; }
  bool is_on_surface() const { return walked_.is_on_surface; }
  const WalkResult& walked() const { return walked_; }

 private:
  bool cast_again(RTCIntersectContext& context, Proposal& proposal) const {
    const FloatCast start = float_cast(TileFrame(scene_), rays_, lane_, t_cast_);
    RTCRayHit single{};
    single.ray.org_x = start.x;
    single.ray.org_y = start.y;
    single.ray.org_z = start.z;
    single.ray.dir_x = rays_.unit_x[lane_];
    single.ray.dir_y = rays_.unit_y[lane_];
    single.ray.dir_z = rays_.unit_z[lane_];
    single.ray.tfar = start.way_m;
    single.ray.mask = 0xffffffffU;
    single.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(scene_.handle(), &context, &single);
    proposal = {.way_m = single.ray.tfar,
                .u = single.hit.u,
                .v = single.hit.v,
                .normal_x = single.hit.Ng_x,
                .normal_y = single.hit.Ng_y,
                .normal_z = single.hit.Ng_z};
    return single.hit.geomID != RTC_INVALID_GEOMETRY_ID;
  }

  Range walk_range(const Proposal& proposal) const {
    const double inverse_length = rays_.inverse_length[lane_];
    const double t_proposed = t_cast_ + static_cast<double>(proposal.way_m) * inverse_length;
    const float along = rays_.unit_x[lane_] * proposal.normal_x +
                        rays_.unit_y[lane_] * proposal.normal_y +
                        rays_.unit_z[lane_] * proposal.normal_z;
    const float inverse_rate = std::abs(proposal.normal_z / along);
    Range range{};
    if (inverse_rate <= kGrazing && !TileScene::is_in_ring(proposal.u, proposal.v)) {
      const double back =
          kBackPerEpsilon * scene_.epsilon_m() * static_cast<double>(inverse_rate) * inverse_length;
      range = {.from = t_proposed - back, .until = t_proposed + back};
    } else {
      range = around(TileScene::cell_of(proposal.u, proposal.v));
      range = {.from = std::min(range.from, t_proposed),
               .until = std::max(range.until, t_proposed)};
    }
    const double t_exit = rays_.t_exit[lane_];
    return {.from = std::clamp(range.from, t_cast_, t_exit),
            .until = std::clamp(range.until, t_cast_, t_exit)};
  }

  /// Where the ray passes the three by three cells around a cell.
  Range around(const TileScene::NamedCell& cell) const {
    const TerrainGrid& grid = scene_.grid();
    Range range{.from = -kInfinity, .until = kInfinity};
    const auto clip = [&](double low, double high, double origin, double inverse) {
      if (inverse == 0.0) return;
      const double a = (low - origin) * inverse;
      const double b = (high - origin) * inverse;
      range.from = std::max(range.from, std::min(a, b));
      range.until = std::min(range.until, std::max(a, b));
    };
    clip(grid.x_world(cell.x - 1), grid.x_world(cell.x + 2), ray_.origin_world.x(), ray_.inverse_x);
    clip(grid.y_world(cell.y - 1), grid.y_world(cell.y + 2), ray_.origin_world.y(), ray_.inverse_y);
    return range;
  }

  /// True when the ray is clear again, at t_cast.
  bool walk(const Range& range) {
    walk_terrain(scene_.grid(), ray_,
                 {.t_entry = rays_.t_entry[lane_],
                  .may_be_on_surface = (rays_.may_be_on_surface & lane_bit(lane_)) != 0,
                  .t_exit = rays_.t_exit[lane_],
                  .t_from = range.from,
                  .t_clear = range.until,
                  .clear_m = scene_.clear_m()},
                 walked_);
    if (walked_.end != WalkResult::End::Clear) return false;
    t_cast_ = walked_.t;
    return true;
  }

  const TileScene& scene_;
  const RayLanes& rays_;
  const int lane_;
  const WalkRay ray_;
  double t_cast_ = 0.0;
  WalkResult walked_;
};

/// What walks of a group's rays came to.
struct WalkedLanes {
  CrossingLanes crossings;
  LaneMask found = 0;
  LaneMask on_surface = 0;

  void take(const RayCaster& caster, int lane) {
    if (caster.has_crossing()) {
      found |= lane_bit(lane);
      crossings.set(lane, caster.walked());
    } else if (caster.is_on_surface()) {
      on_surface |= lane_bit(lane);
    }
  }
};

/// Groups of rays in one tile, and Embree's packet of them.
template <int kWidth>
class PacketCaster {
 public:
  static constexpr std::size_t kGroups = kWidth / RayLanes::kLanes;

  PacketCaster(const TileScene& scene, CastKind kind, std::span<CastGroup, kGroups> groups)
      : scene_(scene), groups_(groups) {
    rtcInitIntersectContext(&context_);
    context_.flags = kind == CastKind::FirstCoherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT
                                                     : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  }

  /// Walks in what comes in near the surface; true when there are rays to cast.
  bool begin() {
    LaneMask any = 0;
    for (std::size_t g = 0; g < kGroups; ++g) {
      CastGroup& group = groups_[g];
      group.found = 0;
      group.on_objects = 0;
      LaneMask cast = group.asked & lanes_[g].find_clear(scene_, *group.rays, group.asked);
      for_each_lane(group.asked & ~cast, [&](int lane) {
        RayCaster caster(scene_, *group.rays, lane);
        if (caster.walk_in()) {
          lanes_[g].t_cast[lane] = caster.t_cast();
          cast |= lane_bit(lane);
        } else {
          walked_[g].take(caster, lane);
        }
      });
      cast_[g] = cast;
      any |= cast;
    }
    return any != 0;
  }

  void fill_packet() {
    for (std::size_t g = 0; g < kGroups; ++g) {
      const std::size_t first = g * RayLanes::kLanes;
      lanes_[g].fill(scene_, *groups_[g].rays, cast_[g],
                     {.valid = valid_.data() + first,
                      .x = packet_.ray.org_x + first,
                      .y = packet_.ray.org_y + first,
                      .z = packet_.ray.org_z + first,
                      .near_m = packet_.ray.tnear + first,
                      .direction_x = packet_.ray.dir_x + first,
                      .direction_y = packet_.ray.dir_y + first,
                      .direction_z = packet_.ray.dir_z + first,
                      .time = packet_.ray.time + first,
                      .way_m = packet_.ray.tfar + first,
                      .mask = packet_.ray.mask + first,
                      .id = packet_.ray.id + first,
                      .flags = packet_.ray.flags + first,
                      .geometry = packet_.hit.geomID + first});
    }
  }

  /// Leaves out of the cast the rays that meet nothing; true when there are others.
  bool keep_occluded() {
    std::array<float, kWidth> way_m;
    std::copy_n(packet_.ray.tfar, kWidth, way_m.begin());
    occluded_packet(valid_.data(), scene_.handle(), &context_, packet_);
    bool any = false;
    for (std::size_t lane = 0; lane < kWidth; ++lane) {
      if (valid_[lane] != 0 && packet_.ray.tfar[lane] >= 0.0F) valid_[lane] = 0;
      any |= valid_[lane] != 0;
      packet_.ray.tfar[lane] = way_m[lane];
    }
    return any;
  }

  void cross() {
    intersect_packet(valid_.data(), scene_.handle(), &context_, packet_);
    for (std::size_t g = 0; g < kGroups; ++g) {
      CastGroup& group = groups_[g];
      const std::size_t first = g * RayLanes::kLanes;
      const CastLanes::Outcome outcome =
          lanes_[g].cross_at_once(scene_, *group.rays,
                                  {.valid = valid_.data() + first,
                                   .geometry = packet_.hit.geomID + first,
                                   .way_m = packet_.ray.tfar + first,
                                   .u = packet_.hit.u + first,
                                   .v = packet_.hit.v + first,
                                   .normal_x = packet_.hit.Ng_x + first,
                                   .normal_y = packet_.hit.Ng_y + first,
                                   .normal_z = packet_.hit.Ng_z + first},
                                  group.crossings);
      group.found = outcome.crosses;
      for_each_lane(outcome.is_proposed & ~outcome.crosses, [&](int lane) {
        const std::size_t at = first + static_cast<std::size_t>(lane);
        RayCaster caster(scene_, *group.rays, lane);
        num_recasts_ += caster.resolve(context_, lanes_[g].t_cast[lane],
                                       {.way_m = packet_.ray.tfar[at],
                                        .u = packet_.hit.u[at],
                                        .v = packet_.hit.v[at],
                                        .normal_x = packet_.hit.Ng_x[at],
                                        .normal_y = packet_.hit.Ng_y[at],
                                        .normal_z = packet_.hit.Ng_z[at]});
        walked_[g].take(caster, lane);
      });
    }
  }

  void take_walked() {
    for (std::size_t g = 0; g < kGroups; ++g) {
      CastGroup& group = groups_[g];
      const WalkedLanes& walked = walked_[g];
      for_each_lane(walked.found,
                    [&](int lane) { group.crossings.copy(lane, walked.crossings, lane); });
      group.found |= walked.found;
      LaneMask& may_be_on_surface = group.rays->may_be_on_surface;
      may_be_on_surface = (may_be_on_surface & ~group.asked) | walked.on_surface;
    }
  }

  int num_recasts() const { return num_recasts_; }

 private:
  const TileScene& scene_;
  const std::span<CastGroup, kGroups> groups_;
  RTCIntersectContext context_;
  typename PacketOf<kWidth>::Type packet_;
  alignas(64) std::array<int, kWidth> valid_;
  std::array<CastLanes, kGroups> lanes_;
  std::array<LaneMask, kGroups> cast_ = {};
  std::array<WalkedLanes, kGroups> walked_;
  int num_recasts_ = 0;
};

/// std::nextafter(t, inf), of what is nearly always positive without a call of the library.
double next_after(double t) {
  return t > 0.0 && t < kInfinity ? std::bit_cast<double>(std::bit_cast<std::uint64_t>(t) + 1)
                                  : std::nextafter(t, kInfinity);
}

/// Looks for objects before what the groups' rays have met so far.
template <int kWidth>
void meet_objects(const ObjectScene& objects, CastKind kind,
                  std::span<CastGroup, kWidth / RayLanes::kLanes> groups) {
  const bool is_any = kind == CastKind::Any;
  RayGroups<kWidth> rays;
  LaneMask lanes = 0;
  alignas(64) double t_until[kWidth];
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const CastGroup& group = groups[g];
    const int first = static_cast<int>(g) * RayLanes::kLanes;
    rays[g] = group.rays;
    lanes |= (is_any ? group.asked & ~group.found : group.asked) << first;
    for (int lane = 0; lane < RayLanes::kLanes; ++lane) {
      const double t_exit = group.rays->t_exit[lane];
      // What lies on the side between two tiles is met in the second.
      double t = t_exit >= group.rays->t_max[lane] ? next_after(t_exit) : t_exit;
      if ((group.found & lane_bit(lane)) != 0) t = std::min(t, group.crossings.t[lane]);
      t_until[first + lane] = t;
    }
  }
  if (lanes == 0) return;
  std::array<ObjectMeeting, kWidth> meetings;
  for_each_lane(objects.meet<kWidth>(rays, lanes, t_until, is_any, meetings), [&](int lane) {
    CastGroup& group = groups[static_cast<std::size_t>(lane / RayLanes::kLanes)];
    const int own = lane % RayLanes::kLanes;
    const ObjectMeeting& meeting = meetings[static_cast<std::size_t>(lane)];
    group.found |= lane_bit(own);
    group.on_objects |= lane_bit(own);
    group.crossings.t[own] = meeting.t;
    group.meetings[static_cast<std::size_t>(own)] = meeting;
  });
}

}  // namespace

template <int kWidth>
int cast_through_tile(const TileScene& scene, CastKind kind,
                      std::span<CastGroup, kWidth / RayLanes::kLanes> groups) {
  PacketCaster<kWidth> caster(scene, kind, groups);
  if (caster.begin()) {
    caster.fill_packet();
    // Most rays to the sun or to a camera meet nothing; only for those that meet the raised surface
    // is it asked where.
    if (kind != CastKind::Any || caster.keep_occluded()) caster.cross();
  }
  caster.take_walked();
  if (scene.objects() != nullptr) meet_objects<kWidth>(*scene.objects(), kind, groups);
  return caster.num_recasts();
}

template int cast_through_tile<8>(const TileScene&, CastKind, std::span<CastGroup, 1>);
template int cast_through_tile<16>(const TileScene&, CastKind, std::span<CastGroup, 2>);

}  // namespace terracast::world
