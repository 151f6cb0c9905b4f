#include "world/ray_query.h"

#include <embree3/rtcore.h>
#include <immintrin.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <exception>
#include <set>
#include <unordered_map>

#include "core/error.h"
#include "world/scene_cache.h"
#include "world/tile_cast.h"

namespace terracast::world {
namespace {

using core::ErrorKind;
using core::fail;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// The top scene's boxes are padded by this share of the largest coordinate in its frame: 2^-24 for
/// rounding the origin, 2^-24 sqrt(3) for the direction over the whole way, and as much again for
/// Embree's slab tests, four times over.
constexpr double kPadPerExtent = 0x1.0p-20;
/// Boxes reach this far down, so that a ray that starts under the surface finds its tile.
constexpr double kUnderground_m = 16384.0;
/// Tiles farther from a viewer than this many of their sides are not fetched beforehand.
constexpr double kPrefetchSides = 4.0;

/// Flushes float denormals to zero while Embree works, as its manual asks; the walk's doubles never
/// come near theirs.
class FlushDenormals {
 public:
  FlushDenormals() : saved_(_mm_getcsr()) { _mm_setcsr(saved_ | kFlush); }
  ~FlushDenormals() { _mm_setcsr(saved_); }
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;

 private:
  static constexpr unsigned kFlush = 0x8040U;  // FTZ, DAZ
  unsigned saved_;
};

/// What the callbacks of one call need; Embree hands its first member back to them.
struct QueryContext {
  RTCIntersectContext embree;
  SceneCache::Pin* pin = nullptr;
  std::array<RayState, kMaxPacket> rays;
  bool is_coherent = false;
  std::uint64_t num_recasts = 0;
  std::exception_ptr error;
};

template <int kWidth>
struct PacketOf;
template <>
struct PacketOf<16> {
  using Ray = RTCRay16;
  using RayHit = RTCRayHit16;
};
template <>
struct PacketOf<8> {
  using Ray = RTCRay8;
  using RayHit = RTCRayHit8;
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
                     RTCRay16& packet) {
  rtcOccluded16(valid, scene, context, &packet);
}
void occluded_packet(const int* valid, RTCScene scene, RTCIntersectContext* context,
                     RTCRay8& packet) {
  rtcOccluded8(valid, scene, context, &packet);
}

}  // namespace

struct RayQuery::Impl {
  Impl(const TileStore& tile_store, std::vector<CutTile> cut_tiles, const RayQueryOptions& options)
      : store(tile_store),
        cut(std::move(cut_tiles)),
        device(options.embree_profile),
        local_origin_world(options.local_origin_world),
        cache(cut.size(), options.memory_bytes, [this](std::size_t i) { return load(i); }) {
    find_bounds();
    build_top_scene();
  }
  ~Impl() { rtcReleaseScene(top); }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  std::unique_ptr<const TileScene> load(std::size_t tile_index) const {
    const CutTile& tile = cut[tile_index];
    return std::make_unique<const TileScene>(device, store.load(tile.id), tile.coarser_sides);
  }

  void find_bounds() {
    if (cut.empty())
      fail(ErrorKind::Input, "{}: no tiles to cast rays at", store.folder().string());
    for (const CutTile& tile : cut) {
      const TileInfo* info = store.find(tile.id);
      if (info == nullptr)
        fail(ErrorKind::Input, "{}: the world has no tile {}; tile it again",
             store.folder().string(), tile.id.name());
      const geo::Box3d box = info->box_world();
      bounds.push_back({.x0_world = box.min().x(),
                        .x1_world = box.max().x(),
                        .y0_world = box.min().y(),
                        .y1_world = box.max().y(),
                        .highest_z_world = box.max().z()});
      index_of.emplace(tile.id, static_cast<std::uint32_t>(bounds.size() - 1));
      levels.insert(tile.id.level);
      world_box.extend(box);
    }
    if (index_of.size() != cut.size())
      fail(ErrorKind::Input, "{}: the cut names a tile twice", store.folder().string());
    world_box.min().z() -= kUnderground_m;
    const double extent_m = std::max((world_box.min() - local_origin_world).cwiseAbs().maxCoeff(),
                                     (world_box.max() - local_origin_world).cwiseAbs().maxCoeff());
    pad_m = kPadPerExtent * 2.0 * extent_m;
    // Where the top scene's rays start; wider than every padded box.
    start_box =
        geo::Box3d(world_box.min().array() - 4.0 * pad_m, world_box.max().array() + 4.0 * pad_m);
  }

  void build_top_scene() {
    const RTCGeometry geometry = rtcNewGeometry(device.handle(), RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(cut.size()));
    rtcSetGeometryUserData(geometry, this);
    rtcSetGeometryBoundsFunction(geometry, &Impl::write_bounds, this);
    rtcSetGeometryIntersectFunction(geometry, &Impl::on_intersect);
    rtcSetGeometryOccludedFunction(geometry, &Impl::on_occluded);
    rtcSetGeometryMask(geometry, 0xffffffffU);
    rtcCommitGeometry(geometry);
    top = rtcNewScene(device.handle());
    rtcSetSceneFlags(top, RTC_SCENE_FLAG_ROBUST);
    rtcAttachGeometryByID(top, geometry, 0);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(top);
    const RTCError error = rtcGetDeviceError(device.handle());
    TERRACAST_CHECK(error == RTC_ERROR_NONE, "Embree error {} while building the top scene",
                    static_cast<int>(error));
  }

  static void write_bounds(const RTCBoundsFunctionArguments* args) {
    const auto* impl = static_cast<const Impl*>(args->geometryUserPtr);
    const TileBounds& tile = impl->bounds[args->primID];
    const Eigen::Vector3d& o = impl->local_origin_world;
    const double pad = impl->pad_m;
    RTCBounds& box = *args->bounds_o;
    box.lower_x = static_cast<float>(tile.x0_world - o.x() - pad);
    box.lower_y = static_cast<float>(tile.y0_world - o.y() - pad);
    box.lower_z = static_cast<float>(impl->world_box.min().z() - o.z() - pad);
    box.upper_x = static_cast<float>(tile.x1_world - o.x() + pad);
    box.upper_y = static_cast<float>(tile.y1_world - o.y() + pad);
    box.upper_z = static_cast<float>(tile.highest_z_world - o.z() + pad);
  }

  /// A way in the top scene as a float that no rounding makes too short.
  float top_way(const RayState& ray, double t) const {
    return static_cast<float>((t - ray.t_world) * ray.walk.length_m * (1.0 + kPadPerExtent) +
                              4.0 * pad_m);
  }

  /// The callbacks' work on the lanes of a packet; done(lane, ray) is told of each ray that has a
  /// crossing in this tile.
  template <class Done>
  void visit_tile(QueryContext& context, std::uint32_t tile_index, const int* valid, RTCRayN* rays,
                  unsigned width, const Done& done) {
    if (context.error) return;
    std::array<TilePassage, kMaxPacket> passages;
    bool any = false;
    for (unsigned lane = 0; lane < width; ++lane) {
      if (valid[lane] == 0) continue;
      RayState& ray = context.rays[RTCRayN_id(rays, width, lane)];
      any |= find_passage(bounds[tile_index], ray, passages[lane]);
    }
    if (!any) return;
    try {
      const TileScene& scene = cache.get(*context.pin, tile_index);
      context.num_recasts += static_cast<std::uint64_t>(cast_through_tile(
          scene, tile_index, passages, static_cast<int>(width), context.is_coherent));
    } catch (...) {  // must not pass through Embree; thrown on when it has returned
      context.error = std::current_exception();
      return;
    }
    for (unsigned lane = 0; lane < width; ++lane) {
      const RayState* ray = passages[lane].ray;
      if (ray != nullptr && ray->best_tile == tile_index && ray->best_t < kInfinity)
        done(lane, *ray);
    }
  }

  static void on_intersect(const RTCIntersectFunctionNArguments* args) {
    auto* impl = static_cast<Impl*>(args->geometryUserPtr);
    auto& context = *reinterpret_cast<QueryContext*>(args->context);
    RTCRayN* rays = RTCRayHitN_RayN(args->rayhit, args->N);
    RTCHitN* hits = RTCRayHitN_HitN(args->rayhit, args->N);
    impl->visit_tile(context, args->primID, args->valid, rays, args->N,
                     [&](unsigned lane, const RayState& ray) {
                       float& tfar = RTCRayN_tfar(rays, args->N, lane);
                       tfar = std::min(tfar, impl->top_way(ray, ray.best_t));
                       RTCHitN_geomID(hits, args->N, lane) = 0;
                     });
    if (context.error) stop(rays, args->N);
  }

  static void on_occluded(const RTCOccludedFunctionNArguments* args) {
    auto* impl = static_cast<Impl*>(args->geometryUserPtr);
    auto& context = *reinterpret_cast<QueryContext*>(args->context);
    impl->visit_tile(context, args->primID, args->valid, args->ray, args->N,
                     [&](unsigned lane, const RayState&) {
                       RTCRayN_tfar(args->ray, args->N, lane) = -static_cast<float>(kInfinity);
                     });
    if (context.error) stop(args->ray, args->N);
  }

  /// Ends all lanes: an error is waiting.
  static void stop(RTCRayN* rays, unsigned width) {
    for (unsigned lane = 0; lane < width; ++lane)
      RTCRayN_tfar(rays, width, lane) = -static_cast<float>(kInfinity);
  }

  /// Prepares a ray; returns how far the top scene is to look, or nothing when the ray misses the
  /// world's box.
  std::optional<float> start_ray(const WorldRay& given, RayState& ray) const {
    ray.walk = walk_ray(given.origin_world, given.direction_world);
    const double length_m = ray.walk.length_m;
    TERRACAST_CHECK(length_m > 0.0 && std::isfinite(length_m) && given.origin_world.allFinite() &&
                        given.t_min > -kInfinity,
                    "ray from ({}, {}, {}) along ({}, {}, {})", given.origin_world.x(),
                    given.origin_world.y(), given.origin_world.z(), given.direction_world.x(),
                    given.direction_world.y(), given.direction_world.z());
    ray.inverse_length = 1.0 / length_m;
    for (int axis = 0; axis < 3; ++axis)
      ray.direction[static_cast<std::size_t>(axis)] =
          static_cast<float>(ray.walk.direction_world[axis] * ray.inverse_length);
    ray.t_min = given.t_min;
    ray.t_max = given.t_max;
    ray.best_t = kInfinity;

    const std::array<double, 3> inverse = {ray.walk.inverse_x, ray.walk.inverse_y,
                                           ray.walk.inverse_z};
    double t_begin = given.t_min;
    double t_end = given.t_max;
    for (int axis = 0; axis < 3; ++axis) {
      const double origin = given.origin_world[axis];
      const double low = start_box.min()[axis];
      const double high = start_box.max()[axis];
      if (ray.walk.direction_world[axis] == 0.0) {
        if (origin < low || origin > high) return std::nullopt;
        continue;
      }
      const double a = (low - origin) * inverse[static_cast<std::size_t>(axis)];
      const double b = (high - origin) * inverse[static_cast<std::size_t>(axis)];
      t_begin = std::max(t_begin, std::min(a, b));
      t_end = std::min(t_end, std::max(a, b));
    }
    if (!(t_begin <= t_end)) return std::nullopt;
    ray.t_world = t_begin;
    return top_way(ray, t_end);
  }

  template <class Packet>
  void set_lane(Packet& packet, std::size_t lane, const RayState& ray, float way_m) const {
    const Eigen::Vector3d start =
        ray.walk.origin_world + ray.t_world * ray.walk.direction_world - local_origin_world;
    packet.org_x[lane] = static_cast<float>(start.x());
    packet.org_y[lane] = static_cast<float>(start.y());
    packet.org_z[lane] = static_cast<float>(start.z());
    packet.tnear[lane] = 0.0F;
    packet.dir_x[lane] = ray.direction[0];
    packet.dir_y[lane] = ray.direction[1];
    packet.dir_z[lane] = ray.direction[2];
    packet.time[lane] = 0.0F;
    packet.tfar[lane] = way_m;
    packet.mask[lane] = 0xffffffffU;
    packet.id[lane] = static_cast<unsigned>(lane);
    packet.flags[lane] = 0;
  }

  /// Casts all rays in packets of consecutive ones; cast(valid, packet) traverses, finish(i, ray)
  /// takes each result.
  template <int kWidth, class Packet, class Rays, class Cast, class Finish>
  void for_packets(std::span<const WorldRay> rays, QueryContext& context, Packet& packet,
                   Rays& lanes, const Cast& cast, const Finish& finish) {
    SceneCache::Pin pin(cache);
    context.pin = &pin;
    alignas(64) std::array<int, kWidth> valid;
    for (std::size_t begin = 0; begin < rays.size(); begin += kWidth) {
      const std::size_t count = std::min<std::size_t>(kWidth, rays.size() - begin);
      bool any = false;
      for (std::size_t lane = 0; lane < kWidth; ++lane) {
        valid[lane] = 0;
        if (lane >= count) continue;
        RayState& ray = context.rays[lane];
        const std::optional<float> way_m = start_ray(rays[begin + lane], ray);
        if (!way_m) continue;
        set_lane(lanes, lane, ray, *way_m);
        valid[lane] = -1;
        any = true;
      }
      if (any) {
        pin.renew();
        cast(valid.data(), packet);
        if (context.error) std::rethrow_exception(context.error);
      }
      for (std::size_t lane = 0; lane < count; ++lane) finish(begin + lane, context.rays[lane]);
    }
    if (context.num_recasts > 0) num_recasts += context.num_recasts;
  }

  template <int kWidth>
  void intersect(std::span<const WorldRay> rays, std::span<SurfaceHit> hits, Coherence coherence) {
    const FlushDenormals flush;
    QueryContext context;
    context.is_coherent = coherence == Coherence::Coherent;
    rtcInitIntersectContext(&context.embree);
    context.embree.flags = context.is_coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT
                                               : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    typename PacketOf<kWidth>::RayHit packet;
    for_packets<kWidth>(
        rays, context, packet, packet.ray,
        [&](const int* valid, auto& traced) {
          for (unsigned& geometry : traced.hit.geomID) geometry = RTC_INVALID_GEOMETRY_ID;
          intersect_packet(valid, top, &context.embree, traced);
        },
        [&](std::size_t i, const RayState& ray) { hits[i] = hit_of(ray); });
  }

  template <int kWidth>
  void occluded(std::span<const WorldRay> rays, std::span<std::uint8_t> is_occluded) {
    const FlushDenormals flush;
    QueryContext context;
    rtcInitIntersectContext(&context.embree);
    context.embree.flags = RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    typename PacketOf<kWidth>::Ray packet;
    for_packets<kWidth>(
        rays, context, packet, packet,
        [&](const int* valid, auto& traced) {
          occluded_packet(valid, top, &context.embree, traced);
        },
        [&](std::size_t i, const RayState& ray) {
          is_occluded[i] = ray.best_t < kInfinity ? 1 : 0;
        });
  }

  static SurfaceHit hit_of(const RayState& ray) {
    SurfaceHit hit;
    if (ray.best_t == kInfinity) return hit;
    hit.t = ray.best_t;
    hit.tile_index = ray.best_tile;
    hit.cell_x = static_cast<std::uint16_t>(ray.best.cell_x);
    hit.cell_y = static_cast<std::uint16_t>(ray.best.cell_y);
    hit.upper = ray.best.is_upper ? 1 : 0;
    hit.normal_world = Eigen::Vector3d(-ray.best.slope_x, -ray.best.slope_y, 1.0).normalized();
    return hit;
  }

  /// The tile of the cut that holds a place; of those that share a border, the one north-east of it
  /// if there is one.
  std::optional<std::uint32_t> tile_at_place(double x_world, double y_world) const {
    for (const int west : {0, 1}) {
      for (const int south : {0, 1}) {
        for (const int level : levels) {
          TileId id = tile_at(level, x_world, y_world);
          if (west != 0 && id.corner_world().x() != x_world) continue;
          if (south != 0 && id.corner_world().y() != y_world) continue;
          id = id.neighbour(-west, -south);
          const auto found = index_of.find(id);
          if (found != index_of.end()) return found->second;
        }
      }
    }
    return std::nullopt;
  }

  const TileStore store;
  const std::vector<CutTile> cut;
  const EmbreeDevice device;
  const Eigen::Vector3d local_origin_world;
  std::vector<TileBounds> bounds;
  std::unordered_map<TileId, std::uint32_t> index_of;
  std::set<int> levels;
  geo::Box3d world_box;
  geo::Box3d start_box;
  double pad_m = 0.0;
  RTCScene top = nullptr;
  std::atomic<std::uint64_t> num_recasts = 0;
  SceneCache cache;  // last: its thread loads tiles by the rest
};

RayQuery::RayQuery(const TileStore& store, std::vector<CutTile> cut, const RayQueryOptions& options)
    : impl_(std::make_unique<Impl>(store, std::move(cut), options)) {}

RayQuery::~RayQuery() = default;

const std::vector<CutTile>& RayQuery::cut() const { return impl_->cut; }

void RayQuery::intersect(std::span<const WorldRay> rays, std::span<SurfaceHit> hits,
                         Coherence coherence) const {
  TERRACAST_CHECK(hits.size() == rays.size(), "{} hits for {} rays", hits.size(), rays.size());
  if (impl_->device.packet_width() == 16)
    impl_->intersect<16>(rays, hits, coherence);
  else
    impl_->intersect<8>(rays, hits, coherence);
}

void RayQuery::occluded(std::span<const WorldRay> rays, std::span<std::uint8_t> is_occluded) const {
  TERRACAST_CHECK(is_occluded.size() == rays.size(), "{} answers for {} rays", is_occluded.size(),
                  rays.size());
  if (impl_->device.packet_width() == 16)
    impl_->occluded<16>(rays, is_occluded);
  else
    impl_->occluded<8>(rays, is_occluded);
}

SurfaceSample RayQuery::surface(const SurfaceHit& hit, const Eigen::Vector3d& point_world) const {
  TERRACAST_CHECK(!hit.is_sky() && hit.tile_index < impl_->cut.size() && hit.cell_x < kTileCells &&
                      hit.cell_y < kTileCells,
                  "not a hit of this query");
  const SceneCache::Pin pin(impl_->cache);
  const TileScene& scene = impl_->cache.get(pin, hit.tile_index);
  const TerrainGrid& grid = scene.grid();
  const int i = hit.cell_x;
  const int j = hit.cell_y;
  const double fx =
      std::clamp((point_world.x() - grid.x_world(i)) * grid.inverse_spacing, 0.0, 1.0);
  const double fy =
      std::clamp((point_world.y() - grid.y_world(j)) * grid.inverse_spacing, 0.0, 1.0);
  // Corner at the right angle first, then along x, then along y.
  const std::array<std::size_t, 3> samples =
      hit.upper != 0
          ? std::array{Tile::sample(i + 1, j + 1), Tile::sample(i, j + 1), Tile::sample(i + 1, j)}
          : std::array{Tile::sample(i, j), Tile::sample(i + 1, j), Tile::sample(i, j + 1)};
  const double along_x = hit.upper != 0 ? 1.0 - fx : fx;
  const double along_y = hit.upper != 0 ? 1.0 - fy : fy;
  const std::array<double, 3> weights = {1.0 - along_x - along_y, along_x, along_y};
  const std::size_t nearest = samples[static_cast<std::size_t>(
      std::max_element(weights.begin(), weights.end()) - weights.begin())];
  double moisture = 0.0;
  for (std::size_t k = 0; k < samples.size(); ++k)
    moisture += weights[k] * scene.moisture()[samples[k]];
  return {.cover = scene.cover()[nearest],
          .moisture = std::clamp(moisture / 255.0, 0.0, 1.0),
          .source = scene.source()[nearest],
          .spacing_m = grid.spacing_m};
}

std::optional<double> RayQuery::surface_z_world(double x_world, double y_world) const {
  if (!impl_->world_box.contains(Eigen::Vector3d(x_world, y_world, impl_->world_box.min().z())))
    return std::nullopt;
  const std::optional<std::uint32_t> tile_index = impl_->tile_at_place(x_world, y_world);
  if (!tile_index) return std::nullopt;
  const SceneCache::Pin pin(impl_->cache);
  const TileScene& scene = impl_->cache.get(pin, *tile_index);
  return scene.center_world().z() + scene.grid().z_at(x_world, y_world);
}

void RayQuery::prefetch(std::span<const Viewpoint> viewpoints) const {
  std::vector<std::pair<double, std::uint32_t>> needs;
  for (std::uint32_t i = 0; i < impl_->cut.size(); ++i) {
    const geo::Box3d box = impl_->store.find(impl_->cut[i].id)->box_world();
    double nearest_m = kInfinity;
    for (const Viewpoint& viewpoint : viewpoints)
      nearest_m = std::min(nearest_m, box.exteriorDistance(viewpoint.position_world));
    if (nearest_m <= kPrefetchSides * impl_->cut[i].id.side_m()) needs.emplace_back(nearest_m, i);
  }
  std::sort(needs.begin(), needs.end());
  std::vector<std::uint32_t> order;
  order.reserve(needs.size());
  for (const auto& [distance_m, tile_index] : needs) order.push_back(tile_index);
  impl_->cache.prefetch(std::move(order));
}

RayQueryStats RayQuery::stats() const {
  const SceneCache::Stats cache = impl_->cache.stats();
  return {.num_tiles_loaded = cache.num_loaded,
          .num_tiles_waited = cache.num_waited,
          .num_tiles_evicted = cache.num_evicted,
          .bytes_resident = cache.bytes_resident,
          .peak_bytes_resident = cache.peak_bytes_resident,
          .num_recasts = impl_->num_recasts.load()};
}

std::string RayQuery::profile() const { return impl_->device.profile(); }

}  // namespace terracast::world
