#include "world/ray_query.h"

#include <immintrin.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <limits>

#include "core/error.h"
#include "world/ray_batch.h"
#include "world/scene_cache.h"
#include "world/tile_map.h"

namespace terracast::world {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::size_t kLanes = RayLanes::kLanes;
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

[[noreturn]] __attribute__((noinline)) void refuse(const WorldRay& ray) {
  const Eigen::Vector3d& o = ray.origin_world;
  const Eigen::Vector3d& d = ray.direction_world;
  core::fail(
      core::ErrorKind::Internal,
      "a ray from ({}, {}, {}) along ({}, {}, {}), t from {} to {}: a finite start, a direction of "
      "a length between 1e-150 and 1e150 and numbers for t would be right",
      o.x(), o.y(), o.z(), d.x(), d.y(), d.z(), ray.t_min, ray.t_max);
}

}  // namespace

struct RayQuery::Impl {
  Impl(const TileStore& tile_store, std::vector<CutTile> cut_tiles, const RayQueryOptions& options)
      : store(tile_store),
        cut(std::move(cut_tiles)),
        map(store, cut),
        device(options.embree_profile),
        packet_width(options.packet_width != 0 ? options.packet_width : device.packet_width()),
        frame_shift_m(options.local_origin_world),
        cache(cut.size(), options.memory_bytes, [this](std::size_t i) { return load(i); }) {}

  std::unique_ptr<const TileScene> load(std::size_t tile_index) const {
    const CutTile& tile = cut[tile_index];
    return std::make_unique<const TileScene>(device, store.load(tile.id), tile.coarser_sides,
                                             frame_shift_m);
  }

  /// Fills a group from the rays that begin with `first`; the last one fills the lanes that are
  /// left when there are fewer.
  static LaneMask load_rays(std::span<const WorldRay> rays, std::size_t first, RayLanes& group) {
    const std::size_t count = std::min(kLanes, rays.size() - first);
    std::array<WorldRay, kLanes> padded;
    const WorldRay* given = &rays[first];
    if (count < kLanes) {
      for (std::size_t lane = 0; lane < kLanes; ++lane)
        padded[lane] = given[std::min(lane, count - 1)];
      given = padded.data();
    }
    const LaneMask good = group.load(std::span<const WorldRay, kLanes>(given, kLanes),
                                     static_cast<std::uint32_t>(first));
    const LaneMask asked = lane_bit(static_cast<int>(count)) - 1;
    if ((asked & ~good) != 0) refuse(given[__builtin_ctz(asked & ~good)]);
    return asked;
  }

  /// Carries all rays from tile to tile until each has crossed the surface or left;
  /// found(ray, tile, crossings, lane) takes each crossing.
  template <int kWidth, class Found>
  void trace(std::span<const WorldRay> rays, CastKind kind, const Found& found) {
    TERRACAST_CHECK(packet_width == 8 || packet_width == 16, "packets of {} rays", packet_width);
    TERRACAST_CHECK(rays.size() < 0xffffffffU, "{} rays in one call", rays.size());
    const FlushDenormals flush;
    SceneCache::Pin pin(cache);
    RayBatch batch;
    std::uint32_t hint = 0;
    std::uint64_t casts = 0;
    std::uint64_t lanes = 0;
    std::uint64_t recasts = 0;
    for (std::size_t begin = 0; begin < rays.size(); begin += RayBatch::kRays) {
      for (std::size_t g = 0; g < RayBatch::kGroups; ++g) {
        const std::size_t first = begin + g * kLanes;
        batch.travelling[g] = 0;
        if (first >= rays.size()) continue;
        const LaneMask asked = load_rays(rays, first, batch.groups[g]);
        batch.travelling[g] = map.enter(batch.groups[g], asked, hint);
      }
      pin.renew();
      PacketRays<kWidth> packet(batch);
      while (packet.take()) {
        recasts += static_cast<std::uint64_t>(
            cast_through_tile<kWidth>(cache.get(pin, packet.tile()), kind, packet.groups()));
        lanes += kWidth;
        for (CastGroup& group : packet.groups()) {
          casts += static_cast<std::uint64_t>(__builtin_popcount(group.asked));
          for_each_lane(group.found, [&](int lane) {
            found(group.rays->id[lane], packet.tile(), group.crossings, lane);
          });
          const LaneMask left = group.asked & ~group.found;
          group.asked = left != 0 ? map.go_on(*group.rays, left) : 0;
        }
        packet.give_back();
      }
    }
    num_rays += rays.size();
    num_casts += casts;
    num_lanes += lanes;
    num_recasts += recasts;
  }

  template <class Found>
  void trace(std::span<const WorldRay> rays, CastKind kind, const Found& found) {
    if (packet_width == 16)
      trace<16>(rays, kind, found);
    else
      trace<8>(rays, kind, found);
  }

  const TileStore store;
  const std::vector<CutTile> cut;
  const TileMap map;
  const EmbreeDevice device;
  const int packet_width;
  const Eigen::Vector3d frame_shift_m;
  std::atomic<std::uint64_t> num_rays = 0;
  std::atomic<std::uint64_t> num_casts = 0;
  std::atomic<std::uint64_t> num_lanes = 0;
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
  std::fill(hits.begin(), hits.end(), SurfaceHit{});
  impl_->trace(
      rays, coherence == Coherence::Coherent ? CastKind::FirstCoherent : CastKind::FirstIncoherent,
      [&](std::uint32_t ray, std::uint32_t tile, const CrossingLanes& crossings, int lane) {
        SurfaceHit& hit = hits[ray];
        hit.t = crossings.t[lane];
        hit.tile_index = tile;
        hit.cell_x = static_cast<std::uint16_t>(crossings.cell_x[lane]);
        hit.cell_y = static_cast<std::uint16_t>(crossings.cell_y[lane]);
        hit.upper = static_cast<std::uint8_t>(crossings.is_upper[lane]);
        hit.slope_x = crossings.slope_x[lane];
        hit.slope_y = crossings.slope_y[lane];
      });
}

void RayQuery::occluded(std::span<const WorldRay> rays, std::span<std::uint8_t> is_occluded) const {
  TERRACAST_CHECK(is_occluded.size() == rays.size(), "{} answers for {} rays", is_occluded.size(),
                  rays.size());
  std::fill(is_occluded.begin(), is_occluded.end(), std::uint8_t{0});
  impl_->trace(
      rays, CastKind::Any,
      [&](std::uint32_t ray, std::uint32_t, const CrossingLanes&, int) { is_occluded[ray] = 1; });
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
  const std::optional<std::uint32_t> tile_index = impl_->map.tile_at_place(x_world, y_world);
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
          .num_rays = impl_->num_rays.load(),
          .num_casts = impl_->num_casts.load(),
          .num_lanes = impl_->num_lanes.load(),
          .num_recasts = impl_->num_recasts.load()};
}

std::string RayQuery::profile() const { return impl_->device.profile(); }

}  // namespace terracast::world
