#include "world/ray_query.h"

#include <immintrin.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>

#include "core/error.h"
#include "world/ray_lanes.h"
#include "world/scene_cache.h"
#include "world/tile_cast.h"

namespace terracast::world {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Rays that travel together. Those in the same tile are cast as packets, so that packets are full
/// where rays diverge.
constexpr std::size_t kBatch = DirectionMeasures::kMost;
/// A ray that comes into its first tile so soon after its start may have started on the surface
/// beside it.
constexpr double kStartsAtSide_m = 0x1.0p-20;
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
      "a ray from ({}, {}, {}) along ({}, {}, {}), t from {}: a finite start and a direction "
      "that is not zero would be right",
      o.x(), o.y(), o.z(), d.x(), d.y(), d.z(), ray.t_min);
}

}  // namespace

struct RayQuery::Impl {
  Impl(const TileStore& tile_store, std::vector<CutTile> cut_tiles, const RayQueryOptions& options)
      : store(tile_store),
        cut(std::move(cut_tiles)),
        map(store, cut),
        device(options.embree_profile),
        frame_shift_m(options.local_origin_world),
        cache(cut.size(), options.memory_bytes, [this](std::size_t i) { return load(i); }) {}

  std::unique_ptr<const TileScene> load(std::size_t tile_index) const {
    const CutTile& tile = cut[tile_index];
    return std::make_unique<const TileScene>(device, store.load(tile.id), tile.coarser_sides,
                                             frame_shift_m);
  }

  /// Puts a ray into the first tile where it may meet the ground; false when there is none.
  bool start_ray(const WorldRay& given, const DirectionMeasures& measures, std::size_t i,
                 std::uint32_t& hint, RayState& ray) const {
    const double length_m = measures.length_m[i];
    if (!(length_m > 0.0 && std::isfinite(length_m) && given.origin_world.allFinite() &&
          given.t_min > -kInfinity))
      refuse(given);
    WalkRay& walk = ray.walk;
    walk.origin_world = given.origin_world;
    walk.direction_world.x() = measures.x[i];
    walk.direction_world.y() = measures.y[i];
    walk.direction_world.z() = measures.z[i];
    walk.inverse_x = measures.inverse_x[i];
    walk.inverse_y = measures.inverse_y[i];
    walk.inverse_z = measures.inverse_z[i];
    walk.to_east = walk.inverse_x > 0.0 ? 1 : 0;
    walk.to_north = walk.inverse_y > 0.0 ? 1 : 0;
    walk.never_x = walk.inverse_x == 0.0 ? kInfinity : 0.0;
    walk.never_y = walk.inverse_y == 0.0 ? kInfinity : 0.0;
    walk.length_m = length_m;
    walk.inverse_length = measures.inverse_length[i];
    for (int axis = 0; axis < 3; ++axis)
      ray.direction[static_cast<std::size_t>(axis)] =
          static_cast<float>(walk.direction_world[axis] * walk.inverse_length);
    ray.t_max = given.t_max;
    ray.has_crossing = false;
    if (!map.first_passage(walk, given.t_min, given.t_max, hint, ray.passage)) return false;
    ray.may_be_on_surface =
        ray.passage.side < 0 || (ray.passage.t_entry - given.t_min) * length_m <= kStartsAtSide_m;
    return true;
  }

  /// Carries all rays from tile to tile until each has crossed the surface or left; finish(i, ray)
  /// takes each.
  template <int kWidth, class Finish>
  void trace(std::span<const WorldRay> rays, CastKind kind, const Finish& finish) {
    const FlushDenormals flush;
    SceneCache::Pin pin(cache);
    std::array<RayState, kBatch> states;
    DirectionMeasures measures;
    std::uint32_t hint = 0;
    std::uint64_t recasts = 0;
    for (std::size_t begin = 0; begin < rays.size(); begin += kBatch) {
      const std::size_t count = std::min(kBatch, rays.size() - begin);
      std::array<std::uint8_t, kBatch> travelling;  // a ring: from head to tail
      std::array<std::uint32_t, kBatch> tile_of;
      std::size_t head = 0;
      std::size_t tail = 0;
      for (std::size_t i = 0; i < kBatch; ++i) {
        const Eigen::Vector3d& direction = rays[begin + std::min(i, count - 1)].direction_world;
        measures.x[i] = direction.x();
        measures.y[i] = direction.y();
        measures.z[i] = direction.z();
      }
      measures.measure();
      for (std::size_t i = 0; i < count; ++i) {
        RayState& ray = states[i];
        if (!start_ray(rays[begin + i], measures, i, hint, ray)) continue;
        travelling[tail++] = static_cast<std::uint8_t>(i);
        tile_of[i] = ray.passage.tile;
      }
      pin.renew();
      while (head < tail) {
        // Those in the tile of the first one, as many as a packet takes; who is passed over stays
        // first in the queue.
        const std::uint32_t tile = tile_of[travelling[head % kBatch]];
        std::array<RayState*, kWidth> lanes;
        std::array<std::uint8_t, kWidth> indices;
        std::array<std::uint8_t, kBatch> passed_over;
        std::size_t num_lanes = 0;
        std::size_t num_passed_over = 0;
        for (; head < tail && num_lanes < kWidth; ++head) {
          const std::uint8_t i = travelling[head % kBatch];
          if (tile_of[i] == tile) {
            lanes[num_lanes] = &states[i];
            indices[num_lanes++] = i;
          } else {
            passed_over[num_passed_over++] = i;
          }
        }
        while (num_passed_over > 0) travelling[--head % kBatch] = passed_over[--num_passed_over];
        recasts += static_cast<std::uint64_t>(cast_through_tile<kWidth>(
            cache.get(pin, tile), std::span(lanes).first(num_lanes), kind));
        for (std::size_t lane = 0; lane < num_lanes; ++lane) {
          RayState& ray = *lanes[lane];
          if (ray.has_crossing || !map.next_passage(ray.walk, ray.t_max, ray.passage)) continue;
          ray.may_be_on_surface = ray.is_on_surface;
          tile_of[indices[lane]] = ray.passage.tile;
          travelling[tail++ % kBatch] = indices[lane];
        }
      }
      for (std::size_t i = 0; i < count; ++i) finish(begin + i, states[i]);
    }
    if (recasts > 0) num_recasts += recasts;
  }

  template <class Finish>
  void trace(std::span<const WorldRay> rays, CastKind kind, const Finish& finish) {
    if (device.packet_width() == 16)
      trace<16>(rays, kind, finish);
    else
      trace<8>(rays, kind, finish);
  }

  static void set_hit(const RayState& ray, SurfaceHit& hit) {
    if (!ray.has_crossing) {
      hit = {};
      return;
    }
    const WalkResult& crossing = ray.walked;
    hit.t = crossing.t;
    hit.tile_index = ray.passage.tile;
    hit.cell_x = static_cast<std::uint16_t>(crossing.cell_x);
    hit.cell_y = static_cast<std::uint16_t>(crossing.cell_y);
    hit.upper = crossing.is_upper ? 1 : 0;
    hit.slope_x = crossing.slope_x;
    hit.slope_y = crossing.slope_y;
  }

  const TileStore store;
  const std::vector<CutTile> cut;
  const TileMap map;
  const EmbreeDevice device;
  const Eigen::Vector3d frame_shift_m;
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
  impl_->trace(
      rays, coherence == Coherence::Coherent ? CastKind::FirstCoherent : CastKind::FirstIncoherent,
      [&](std::size_t i, const RayState& ray) { Impl::set_hit(ray, hits[i]); });
}

void RayQuery::occluded(std::span<const WorldRay> rays, std::span<std::uint8_t> is_occluded) const {
  TERRACAST_CHECK(is_occluded.size() == rays.size(), "{} answers for {} rays", is_occluded.size(),
                  rays.size());
  impl_->trace(rays, CastKind::Any, [&](std::size_t i, const RayState& ray) {
    is_occluded[i] = ray.has_crossing ? 1 : 0;
  });
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
          .num_recasts = impl_->num_recasts.load()};
}

std::string RayQuery::profile() const { return impl_->device.profile(); }

}  // namespace terracast::world
