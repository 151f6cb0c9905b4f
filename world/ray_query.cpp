#include "world/ray_query.h"

#include <immintrin.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <tuple>

#include "core/error.h"
#include "world/parked_rays.h"
#include "world/ray_batch.h"
#include "world/rays_in_water.h"
#include "world/scene_cache.h"
#include "world/terrain_triangle.h"
#include "world/tile_map.h"

namespace terracast::world {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::size_t kLanes = RayLanes::kLanes;
/// Rays that are parked at most: those of a longer call are traced in parts.
constexpr std::size_t kRaysAtOnce = 4096;
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

constexpr double kShareOfImagery = 0.125;

double bytes_of_imagery(const WorldManifest& manifest) {
  constexpr double kTileBytes = 4.0 * kImageryTile_px * kImageryTile_px;
  std::size_t num_tiles = 0;
  for (const ImageryInfo& imagery : manifest.imagery) num_tiles += imagery.tiles.size();
  return kTileBytes * static_cast<double>(num_tiles);
}

/// Of what is all read at once and kept by those who draw.
double bytes_beside(const WorldManifest& manifest) {
  auto bytes = static_cast<double>(num_bytes_of(manifest.textures));
  for (const VolumeInfo& volume : manifest.volumes) bytes += volume.size.cast<double>().prod();
  // Of each place the depths toward the sun: two bytes for eight voxels.
  for (const VolumePlace& place : manifest.volume_places)
    bytes +=
        0.25 * manifest.volumes[static_cast<std::size_t>(place.volume)].size.cast<double>().prod();
  return bytes;
}

}  // namespace

/// Worlds whose tiles share a cache: one's slots follow another's.
enum class RayQuery::World : std::uint8_t { Whole, WithoutWater, Turned };

struct RayQuery::Impl {
  static constexpr std::size_t kNumWorlds = 3;

  Impl(const TileStore& tile_store, std::vector<CutTile> cut_tiles, const RayQueryOptions& options)
      : store(tile_store),
        cut(std::move(cut_tiles)),
        map(store, cut),
        frame(store.manifest().origin),
        own_prototypes(std::make_unique<const PrototypeLibrary>(store, extreme_levels(cut).first,
                                                                extreme_levels(cut).second)),
        prototypes(*own_prototypes),
        rules{.prototypes = prototypes,
              .frame = frame,
              .level_at = [this](double x, double y) { return level_at(x, y); }},
        own_device(std::make_unique<const EmbreeDevice>(options.embree_profile)),
        device(*own_device),
        packet_width(options.packet_width != 0 ? options.packet_width : device.packet_width()),
        frame_shift_m(options.local_origin_world),
        imagery_budget_bytes(
            std::min(kShareOfImagery * options.memory_bytes, bytes_of_imagery(store.manifest()))),
        objects_bytes(objects_bytes_of(store, cut)),
        least_memory_bytes(find_least_memory_bytes()),
        own_cache(make_cache(options)),
        cache(*own_cache) {}

  Impl(const Impl& whole, World of)
      : store(whole.store),
        cut(whole.cut),
        map(store, cut, of == World::Turned),
        frame(whole.frame),
        prototypes(whole.prototypes),
        rules{.prototypes = prototypes,
              .frame = frame,
              .level_at = [this](double x, double y) { return level_at(x, y); }},
        device(whole.device),
        packet_width(whole.packet_width),
        frame_shift_m(whole.frame_shift_m),
        world(of),
        first_slot(static_cast<std::size_t>(of) * cut.size()),
        imagery_budget_bytes(0.0),
        least_memory_bytes(whole.least_memory_bytes),
        cache(whole.cache) {}

  /// What memory_bytes holds beside tiles and imagery.
  double bytes_aside() const {
    return static_cast<double>(prototypes.num_bytes()) + bytes_beside(store.manifest());
  }

  /// Of the largest tile.
  std::size_t most_bytes_while_loading() const {
    return TileScene::most_bytes_while_loading(
        *std::max_element(objects_bytes.begin(), objects_bytes.end()));
  }

  double find_least_memory_bytes() const {
    const double bytes = bytes_aside() + static_cast<double>(most_bytes_while_loading());
    return std::min(bytes / (1.0 - kShareOfImagery), bytes + bytes_of_imagery(store.manifest()));
  }

  /// The tiles of the cut in each of the worlds.
  std::unique_ptr<SceneCache> make_cache(const RayQueryOptions& options) {
    if (options.memory_bytes < least_memory_bytes)
      core::fail(
          core::ErrorKind::Config,
          "tracing.memory_bytes = {:.4g}: {:.4g} go to prototypes, textures and volumes, and "
          "{:.4g} to the largest tile while it is loaded; {:.4g} would be enough",
          options.memory_bytes, bytes_aside(), static_cast<double>(most_bytes_while_loading()),
          std::ceil(least_memory_bytes * 1e-6) * 1e6);
    const double budget_bytes = options.memory_bytes - imagery_budget_bytes - bytes_aside();
    std::vector<std::size_t> bytes;
    for (std::size_t i = 0; i < kNumWorlds; ++i)
      bytes.insert(bytes.end(), objects_bytes.begin(), objects_bytes.end());
    return std::make_unique<SceneCache>(
        std::move(bytes), budget_bytes,
        [this](std::size_t slot, const PackedTile* packed) { return load(slot, packed); },
        likely_bytes() > budget_bytes);
  }

  /// About what all tiles of the cut take.
  double likely_bytes() const {
    constexpr double kPerSample = 26.4;
    constexpr double kPerObjectsByte = 5.0;
    double bytes = kPerSample * kTileSamples * kTileSamples * static_cast<double>(cut.size());
    for (const std::size_t of_tile : objects_bytes)
      bytes += kPerObjectsByte * static_cast<double>(of_tile);
    return bytes;
  }

  static std::pair<int, int> extreme_levels(const std::vector<CutTile>& cut) {
    const auto by_level = [](const CutTile& a, const CutTile& b) {
      return a.id.level < b.id.level;
    };
    const auto [finest, coarsest] = std::minmax_element(cut.begin(), cut.end(), by_level);
    return {finest->id.level, coarsest->id.level};
  }

  static std::vector<std::size_t> objects_bytes_of(const TileStore& store,
                                                   const std::vector<CutTile>& cut) {
    std::vector<std::size_t> bytes;
    for (const CutTile& tile : cut) bytes.push_back(store.find(tile.id)->objects_bytes);
    return bytes;
  }

  std::optional<int> level_at(double x_world, double y_world) const {
    const std::optional<std::uint32_t> tile = map.tile_at_place(x_world, y_world);
    return tile ? std::optional(cut[*tile].id.level) : std::nullopt;
  }

  std::unique_ptr<const TileScene> load(std::size_t slot, const PackedTile* packed) const {
    if (packed != nullptr) return std::make_unique<const TileScene>(device, *packed, frame_shift_m);
    const auto of = static_cast<World>(slot / cut.size());
    const CutTile& tile = cut[slot % cut.size()];
    return core::with_context(
        [&] {
          Tile loaded = store.load(
              tile.id, of == World::WithoutWater ? WaterDepth::Read : WaterDepth::LeftOut);
          if (of == World::WithoutWater) drain(loaded);
          if (of == World::Turned) turn_over(loaded);
          return std::make_unique<const TileScene>(device, std::move(loaded), tile.coarser_sides,
                                                   frame_shift_m, &rules);
        },
        fmt::format("loading tile {} of {}", tile.id.name(), store.folder().string()));
  }

  static std::span<const WorldRay, kLanes> eight_from(std::span<const WorldRay> rays,
                                                      std::size_t first) {
    return rays.subspan(first).first<kLanes>();
  }
  static RayFan eight_from(const RayFan& rays, std::size_t first) {
    return rays.subspan(first, kLanes);
  }

  /// Fills a group from the rays that begin with `first`; the last one fills the lanes that are
  /// left when there are fewer.
  /// first_id   of rays[0]
  template <class Rays>
  static LaneMask load_rays(const Rays& rays, std::size_t first, std::size_t first_id,
                            RayLanes& group) {
    const std::size_t count = std::min(kLanes, rays.size() - first);
    const auto id = static_cast<std::uint32_t>(first_id + first);
    LaneMask good = 0;
    if (count == kLanes) {
      good = group.load(eight_from(rays, first), id);
    } else {
      std::array<WorldRay, kLanes> padded;
      for (std::size_t lane = 0; lane < kLanes; ++lane)
        padded[lane] = rays[first + std::min(lane, count - 1)];
      good = group.load(padded, id);
    }
    const LaneMask asked = lane_bit(static_cast<int>(count)) - 1;
    if ((asked & ~good) != 0)
      refuse(rays[first + static_cast<std::size_t>(__builtin_ctz(asked & ~good))]);
    return asked;
  }

  /// Rays on their way, and those that wait for tiles.
  /// found(tile, scene, group, lane) takes each crossing and meeting.
  template <int kWidth, class Found>
  class Journey {
   public:
    Journey(Impl& impl, CastKind kind, const Found& found, RayTrail* trail)
        : impl_(impl), kind_(kind), found_(found), trail_(trail), pin_(impl.cache) {}
    ~Journey() {
      impl_.num_casts += casts_;
      impl_.num_lanes += lanes_;
      impl_.num_recasts += recasts_;
    }
    Journey(const Journey&) = delete;
    Journey& operator=(const Journey&) = delete;

    /// Carries rays from tile to tile until each has crossed the surface or left.
    /// first_id   of rays[0]
    template <class Rays>
    void trace(const Rays& rays, std::size_t first_id) {
      for (std::size_t begin = 0; begin < rays.size(); begin += RayBatch::kRays) {
        for (std::size_t g = 0; g < RayBatch::kGroups; ++g) {
          const std::size_t first = begin + g * kLanes;
          batch_.travelling[g] = 0;
          if (first >= rays.size()) continue;
          const LaneMask asked = load_rays(rays, first, first_id, batch_.groups[g]);
          batch_.travelling[g] = impl_.map.enter(batch_.groups[g], asked, hint_, trail_);
        }
        carry_batch();
      }
      while (!parked_.is_empty()) {
        parked_.list(impl_.first_slot, demands_);
        const SceneCache::Loaded loaded = impl_.cache.load_one_of(pin_, demands_);
        tile_ = static_cast<std::uint32_t>(loaded.tile_index - impl_.first_slot);
        scene_ = loaded.scene;
        carry(parked_.take(tile_));
      }
    }

   private:
    void carry(const ParkedRays::Groups& groups) {
      for (std::size_t begin = 0; begin < groups.rays.size(); begin += RayBatch::kGroups) {
        for (std::size_t g = 0; g < RayBatch::kGroups; ++g) {
          batch_.travelling[g] = 0;
          if (begin + g >= groups.rays.size()) continue;
          batch_.groups[g] = groups.rays[begin + g];
          const bool is_last = begin + g + 1 == groups.rays.size();
          batch_.travelling[g] = is_last ? groups.last_lanes : lane_bit(RayLanes::kLanes) - 1;
        }
        carry_batch();
      }
    }

    /// Until each ray of the batch has crossed the surface, left or parked.
    void carry_batch() {
      PacketRays<kWidth> packet(batch_);
      while (packet.take()) {
        go_to_tile(packet.tile());
        if (trail_ != nullptr) trail_->touch(tile_);
        if (scene_ == nullptr) {
          for (const CastGroup& group : packet.groups()) parked_.park(*group.rays, group.asked);
          continue;
        }
        recasts_ +=
            static_cast<std::uint64_t>(cast_through_tile<kWidth>(*scene_, kind_, packet.groups()));
        lanes_ += kWidth;
        for (CastGroup& group : packet.groups()) {
          casts_ += static_cast<std::uint64_t>(count_lanes(group.asked));
          for_each_lane(group.found, [&](int lane) { found_(tile_, *scene_, group, lane); });
          const LaneMask left = group.asked & ~group.found;
          group.asked = left != 0 ? impl_.map.go_on(*group.rays, left, trail_) : 0;
        }
        packet.give_back();
      }
    }

    /// Holds one scene at a time, so that what others evict is soon free.
    void go_to_tile(std::uint32_t tile) {
      if (scene_ != nullptr && tile == tile_) return;
      pin_.renew();
      tile_ = tile;
      scene_ = impl_.cache.find(pin_, impl_.first_slot + tile);
    }

    Impl& impl_;
    const CastKind kind_;
    const Found& found_;
    RayTrail* const trail_;
    SceneCache::Pin pin_;
    RayBatch batch_;
    ParkedRays parked_;
    std::vector<TileDemand> demands_;
    std::uint32_t hint_ = 0;  ///< tile in which rays start
    std::uint32_t tile_ = 0;
    const TileScene* scene_ = nullptr;
    std::uint64_t casts_ = 0;
    std::uint64_t lanes_ = 0;
    std::uint64_t recasts_ = 0;
  };

  template <int kWidth, class Rays, class Found>
  void trace_packets(const Rays& rays, CastKind kind, const Found& found, RayTrail* trail) {
    TERRACAST_CHECK(rays.size() < 0xffffffffU, "{} rays in one call", rays.size());
    const FlushDenormals flush;
    Journey<kWidth, Found> journey(*this, kind, found, trail);
    for (std::size_t first = 0; first < rays.size(); first += kRaysAtOnce)
      journey.trace(rays.subspan(first, std::min(kRaysAtOnce, rays.size() - first)), first);
    num_rays += rays.size();
  }

  /// rays   WorldRays or a RayFan
  template <class Rays, class Found>
  void trace(const Rays& rays, CastKind kind, const Found& found, RayTrail* trail) {
    TERRACAST_CHECK(trail == nullptr || trail->num_tiles() == cut.size(),
                    "a trail of {} tiles of {}", trail->num_tiles(), cut.size());
    TERRACAST_CHECK(packet_width == 8 || packet_width == 16, "packets of {} rays", packet_width);
    if (packet_width == 16)
      trace_packets<16>(rays, kind, found, trail);
    else
      trace_packets<8>(rays, kind, found, trail);
  }

  const TileStore store;
  const std::vector<CutTile> cut;
  const TileMap map;
  const geo::WorldFrame frame;
  const std::unique_ptr<const PrototypeLibrary> own_prototypes;  ///< null: another query's
  const PrototypeLibrary& prototypes;
  const ObjectRules rules;
  const std::unique_ptr<const EmbreeDevice> own_device;  ///< null: another query's
  const EmbreeDevice& device;
  const int packet_width;
  const Eigen::Vector3d frame_shift_m;
  const World world = World::Whole;
  const std::size_t first_slot = 0;  ///< of its tiles in the cache
  // Of viewers in water: what they leave it by.
  const RayQuery* whole_world = nullptr;
  std::unique_ptr<const RayQuery> turned_world;
  std::atomic<std::uint64_t> num_rays = 0;
  std::atomic<std::uint64_t> num_casts = 0;
  std::atomic<std::uint64_t> num_lanes = 0;
  std::atomic<std::uint64_t> num_recasts = 0;
  const double imagery_budget_bytes;
  const std::vector<std::size_t> objects_bytes;  ///< of the cut's tiles, in their files
  const double least_memory_bytes;
  const std::unique_ptr<SceneCache> own_cache;  // last: its thread loads tiles by the rest
  SceneCache& cache;
};

RayQuery::RayQuery(const TileStore& store, std::vector<CutTile> cut, const RayQueryOptions& options)
    : impl_(std::make_unique<Impl>(store, std::move(cut), options)) {}

RayQuery::RayQuery(const RayQuery& whole, World world)
    : impl_(std::make_unique<Impl>(*whole.impl_, world)) {}

RayQuery::RayQuery(const RayQuery& whole, const WithoutWater& without)
    : RayQuery(whole, World::WithoutWater) {
  if (!without.viewers_in_water) return;
  impl_->whole_world = &whole;
  impl_->turned_world.reset(new RayQuery(whole, World::Turned));
}

RayQuery::~RayQuery() = default;

const std::vector<CutTile>& RayQuery::cut() const { return impl_->cut; }

namespace {

CastKind first_crossings(Coherence coherence) {
  return coherence == Coherence::Coherent ? CastKind::FirstCoherent : CastKind::FirstIncoherent;
}

/// What is there on the ground's triangle of a hit, interpolated from its corners.
void set_surface(const TileScene& scene, const SurfaceHit& hit, const Eigen::Vector3d& point_world,
                 SurfaceSample& surface) {
  const TerrainGrid& grid = scene.grid();
  const int i = hit.cell_x;
  const int j = hit.cell_y;
  const double fx =
      std::clamp((point_world.x() - grid.x_world(i)) * grid.inverse_spacing, 0.0, 1.0);
  const double fy =
      std::clamp((point_world.y() - grid.y_world(j)) * grid.inverse_spacing, 0.0, 1.0);
  const TrianglePlace place = place_on_triangle(i, j, hit.upper != 0, fx, fy);
  const std::size_t nearest = place.nearest().sample();
  double moisture = 0.0;
  for (std::size_t k = 0; k < 3; ++k)
    moisture += place.weights[k] * scene.moisture()[place.corners[k].sample()];
  surface.spacing_m = grid.spacing_m;
  surface.cover = scene.cover()[nearest];
  surface.moisture = std::clamp(moisture / 255.0, 0.0, 1.0);
  surface.source = scene.source()[nearest];
  if (scene.paint() != nullptr)
    scene.paint()->find(point_world.x(), point_world.y(), surface.paint);
  else
    surface.paint.is_painted = false;
}

void set_ground_hit(const CrossingLanes& crossings, int lane, SurfaceHit& hit) {
  hit.cell_x = static_cast<std::uint16_t>(crossings.cell_x[lane]);
  hit.cell_y = static_cast<std::uint16_t>(crossings.cell_y[lane]);
  hit.upper = static_cast<std::uint8_t>(crossings.is_upper[lane]);
  hit.slope_x = crossings.slope_x[lane];
  hit.slope_y = crossings.slope_y[lane];
}

void set_surface(const TileScene& scene, const ObjectSurface& object, SurfaceSample& surface) {
  surface.spacing_m = scene.grid().spacing_m;
  surface.provenance = *object.provenance;
  surface.finish = *object.finish;
  surface.uv = object.uv;
  surface.uv_per_m = object.uv_per_m;
  surface.variety = object.variety;
  surface.from_place_m = object.from_place_m;
  surface.reach_m = object.reach_m;
  surface.height_m = object.height_m;
  surface.crossing_error = object.crossing_error;
}

void check_fan(const RayFan& rays) {
  TERRACAST_CHECK(rays.y.size() == rays.size() && rays.z.size() == rays.size(),
                  "a fan with {}, {} and {} components of directions", rays.size(), rays.y.size(),
                  rays.z.size());
  TERRACAST_CHECK(rays.t_ends.empty() || rays.t_ends.size() == rays.size(),
                  "a fan with {} rays and {} ends of them", rays.size(), rays.t_ends.size());
}

/// rays   WorldRays or a RayFan
template <class Rays, class Tracer>
void find_hits(Tracer& tracer, const Rays& rays, std::span<SurfaceHit> hits, Coherence coherence,
               std::span<SurfaceSample> surfaces, RayTrail* trail, SurfaceNeed need) {
  TERRACAST_CHECK(hits.size() == rays.size(), "{} hits for {} rays", hits.size(), rays.size());
  TERRACAST_CHECK(surfaces.empty() || surfaces.size() == rays.size(), "{} surfaces for {} rays",
                  surfaces.size(), rays.size());
  std::fill(hits.begin(), hits.end(), SurfaceHit{});
  tracer.trace(
      rays, first_crossings(coherence),
      [&](std::uint32_t tile, const TileScene& scene, const CastGroup& group, int lane) {
        const std::uint32_t i = group.rays->id[lane];
        SurfaceHit& hit = hits[i];
        hit.t = group.crossings.t[lane];
        hit.tile_index = tile;
        if ((group.on_objects & lane_bit(lane)) != 0) {
          const ObjectMeeting& meeting = group.meetings[static_cast<std::size_t>(lane)];
          const ObjectScene& objects = *scene.objects();
          hit.object = meeting.object;
          hit.triangle = meeting.triangle;
          if (need == SurfaceNeed::Object) {
            if (!surfaces.empty()) surfaces[i].provenance = objects.provenance(meeting);
            return;
          }
          const WorldRay ray = group.rays->world_ray(lane);
          hit.object_normal_world = objects.normal_world(ray, meeting);
          if (!surfaces.empty())
            set_surface(scene, objects.surface(ray, meeting, need == SurfaceNeed::Facts),
                        surfaces[i]);
          return;
        }
        set_ground_hit(group.crossings, lane, hit);
        if (surfaces.empty() || need == SurfaceNeed::Object) return;
        const WorldRay& ray = rays[i];
        set_surface(scene, hit, ray.origin_world + hit.t * ray.direction_world, surfaces[i]);
      },
      trail);
}

std::vector<WorldRay> listed(const RayFan& rays) {
  std::vector<WorldRay> list;
  list.reserve(rays.size());
  for (std::size_t i = 0; i < rays.size(); ++i) list.push_back(rays[i]);
  return list;
}

}  // namespace

void RayQuery::intersect(std::span<const WorldRay> rays, std::span<SurfaceHit> hits,
                         Coherence coherence, std::span<SurfaceSample> surfaces, RayTrail* trail,
                         SurfaceNeed need) const {
  find_hits(*impl_, rays, hits, coherence, surfaces, trail, need);
  if (impl_->turned_world)
    end_at_surface(*impl_->whole_world, *impl_->turned_world, rays, hits, surfaces, trail);
}

void RayQuery::intersect(const RayFan& rays, std::span<SurfaceHit> hits, Coherence coherence,
                         std::span<SurfaceSample> surfaces, RayTrail* trail,
                         SurfaceNeed need) const {
  check_fan(rays);
  find_hits(*impl_, rays, hits, coherence, surfaces, trail, need);
  if (impl_->turned_world)
    end_at_surface(*impl_->whole_world, *impl_->turned_world, listed(rays), hits, surfaces, trail);
}

void RayQuery::intersect(const RayFan& rays, std::span<double> t, Coherence coherence,
                         RayTrail* trail) const {
  check_fan(rays);
  TERRACAST_CHECK(t.size() == rays.size(), "{} answers for {} rays", t.size(), rays.size());
  if (impl_->turned_world) {
    std::vector<SurfaceHit> hits(rays.size());
    intersect(rays, hits, coherence, {}, trail);
    for (std::size_t i = 0; i < hits.size(); ++i) t[i] = hits[i].t;
    return;
  }
  std::fill(t.begin(), t.end(), kInfinity);
  impl_->trace(
      rays, first_crossings(coherence),
      [&](std::uint32_t, const TileScene&, const CastGroup& group, int lane) {
        t[group.rays->id[lane]] = group.crossings.t[lane];
      },
      trail);
}

void RayQuery::occluded(std::span<const WorldRay> rays, std::span<std::uint8_t> is_occluded,
                        RayTrail* trail) const {
  TERRACAST_CHECK(is_occluded.size() == rays.size(), "{} answers for {} rays", is_occluded.size(),
                  rays.size());
  std::fill(is_occluded.begin(), is_occluded.end(), std::uint8_t{0});
  impl_->trace(
      rays, CastKind::Any,
      [&](std::uint32_t, const TileScene&, const CastGroup& group, int lane) {
        is_occluded[group.rays->id[lane]] = 1;
      },
      trail);
}

std::optional<double> RayQuery::surface_z_world(double x_world, double y_world) const {
  const std::optional<std::uint32_t> tile_index = impl_->map.tile_at_place(x_world, y_world);
  if (!tile_index) return std::nullopt;
  SceneCache::Pin pin(impl_->cache);
  const TileScene& scene = impl_->cache.load(pin, impl_->first_slot + *tile_index);
  return scene.center_world().z() + scene.grid().z_at(x_world, y_world);
}

void RayQuery::expect(std::span<const std::vector<Viewpoint>> turns) const {
  std::vector<std::pair<double, SceneCache::Expected>> needs;
  for (std::uint32_t i = 0; i < impl_->cut.size(); ++i) {
    const geo::Box3d box = impl_->store.find(impl_->cut[i].id)->box_world();
    const double reach_m = kPrefetchSides * impl_->cut[i].id.side_m();
    for (std::uint32_t turn = 0; turn < turns.size(); ++turn) {
      double nearest_m = kInfinity;
      for (const Viewpoint& viewpoint : turns[turn])
        nearest_m = std::min(nearest_m, viewpoint.sheaf && viewpoint.sheaf->meets(box)
                                            ? 0.0
                                            : box.exteriorDistance(viewpoint.position_world));
      if (nearest_m > reach_m) continue;
      needs.push_back(
          {nearest_m,
           {.tile_index = static_cast<std::uint32_t>(impl_->first_slot) + i, .turn = turn}});
      break;
    }
  }
  std::sort(needs.begin(), needs.end(), [](const auto& a, const auto& b) {
    return std::tuple(a.second.turn, a.first, a.second.tile_index) <
           std::tuple(b.second.turn, b.first, b.second.tile_index);
  });
  std::vector<SceneCache::Expected> tiles;
  tiles.reserve(needs.size());
  for (const auto& [nearest_m, tile] : needs) tiles.push_back(tile);
  impl_->cache.expect(std::move(tiles));
}

void RayQuery::run_units(std::int64_t count, const std::function<void(std::int64_t)>& body) const {
  impl_->cache.run_units(count, body);
}

double RayQuery::least_memory_bytes() const { return impl_->least_memory_bytes; }

double RayQuery::imagery_budget_bytes() const { return impl_->imagery_budget_bytes; }

bool RayQuery::is_without_water() const { return impl_->world == World::WithoutWater; }

RayQueryStats RayQuery::stats() const {
  const SceneCache::Stats cache = impl_->cache.stats();
  return {.num_tiles_loaded = cache.num_loaded,
          .num_tiles_unpacked = cache.num_unpacked,
          .num_tiles_waited = cache.num_waited,
          .num_tiles_evicted = cache.num_evicted,
          .bytes_resident = cache.bytes_resident,
          .peak_bytes_resident = cache.peak_bytes_resident,
          .bytes_at_first_eviction = cache.bytes_at_first_eviction,
          .bytes_of_prototypes = impl_->prototypes.num_bytes(),
          .num_rays = impl_->num_rays.load(),
          .num_casts = impl_->num_casts.load(),
          .num_lanes = impl_->num_lanes.load(),
          .num_recasts = impl_->num_recasts.load()};
}

std::string RayQuery::profile() const { return impl_->device.profile(); }

}  // namespace terracast::world
