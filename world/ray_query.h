#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/schema.h"
#include "world/lod.h"
#include "world/ray_trail.h"
#include "world/tile_store.h"
#include "world/world_ray.h"

namespace terracast::world {

/// The first crossing of a ray with the true surface: the stitched triangles of the cut and what
/// stands on them, in double.
struct SurfaceHit {
  static constexpr std::uint32_t kGround = 0xffffffffU;
  static constexpr std::uint32_t kMoving = 0xffffffffU;

  double t = std::numeric_limits<double>::infinity();  ///< +inf: sky
  std::uint32_t tile_index = 0;  ///< into RayQuery::cut(); kMoving: of what moves (moving_scene.h)
  /// Of the tile's objects, solids first, then instances; kGround: the terrain. Of what moves: of its bodies.
  std::uint32_t object = kGround;
  std::uint32_t triangle = 0;  ///< of the object's shape
  // Of the terrain.
  std::uint16_t cell_x = 0;  ///< cell of the tile, 0 … kTileCells - 1
  std::uint16_t cell_y = 0;
  std::uint8_t upper = 0;  ///< 0: the triangle at (x, y); 1: the one at (x+1, y+1)
  double slope_x = 0.0;    ///< rise of the triangle to the east and to the north, m/m
  double slope_y = 0.0;
  /// Of an object's triangle: unit, on the side from which the ray comes.
  Eigen::Vector3d object_normal_world = Eigen::Vector3d::Zero();

  bool is_ground() const { return object == kGround; }
  bool is_moving() const { return tile_index == kMoving; }
  /// Unit; of the terrain upward.
  Eigen::Vector3d normal_world() const {
    if (!is_ground()) return object_normal_world;
    const double shrink = 1.0 / std::sqrt(slope_x * slope_x + slope_y * slope_y + 1.0);
    return {-slope_x * shrink, -slope_y * shrink, shrink};
  }
  bool is_sky() const { return t == std::numeric_limits<double>::infinity(); }
};

/// How rays of one call relate; only speed depends on it.
enum class Coherence { Coherent, Incoherent };

/// Config `[tracing]`.
struct RayQueryOptions {
  /// Tiles and their scenes, loaded, loading, held and packed; imagery; prototypes, textures and volumes, which are
  /// all read at once.
  double memory_bytes = 8e9;
  std::string embree_profile = "widest";  ///< "widest": the machine's; or as rtcNewDevice takes it
  /// Moves the origin of each tile's float frame off its centre, x and y modulo a cell; results do
  /// not depend on it.
  Eigen::Vector3d local_origin_world = Eigen::Vector3d::Zero();
  /// Rays that are cast at once, 8 or 16; 0: what the machine takes best. Results do not depend on
  /// it.
  int packet_width = 0;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit.key("memory_bytes", memory_bytes,
              "Bound on the memory of loaded tiles and their ray-tracing scenes; a frame may need "
              "more of them than fit at once.",
              core::between(64e6, 1e13));
    visit.key("embree_profile", embree_profile,
              "Embree's instruction set and widths, such as \"isa=avx2,frequency_level=simd256\"; "
              "\"widest\" takes the machine's best.");
  }
};

/// What a surface is made of at a hit, interpolated over its triangle. What is of the other kind of
/// surface keeps what stood there: SurfaceHit::is_ground() says which is meant.
struct SurfaceSample {
  double spacing_m = 0.0;  ///< of the tile
  // Of the terrain.
  Cover cover = Cover::Land;
  double moisture = 0.0;    ///< 0 … 1
  std::uint8_t source = 0;  ///< of the triangle's nearest sample
  PaintSample paint;        ///< all of it where is_painted
  // Of an object.
  Provenance provenance;
  Finish finish;
  Eigen::Vector2f uv = Eigen::Vector2f::Zero();  ///< Shape::uv; without such, 0
  float uv_per_m = 0.0f;     ///< Textured: lengths of uv in a metre of the surface
  std::uint8_t variety = 0;  ///< Instance::variety
  /// From the object's own place (an instance's foot, the origin of a solid's shape), in the world's axes.
  Eigen::Vector3f from_place_m = Eigen::Vector3f::Zero();
  float reach_m = 0.0f;   ///< of an instance to the sides of its foot; of a solid 0
  float height_m = 0.0f;  ///< of an instance above its foot; of a solid 0
  /// Of what moves: the place in its own frame.
  Eigen::Vector3f in_body_m = Eigen::Vector3f::Zero();
  double crossing_error = 0.0;  ///< of t (crossing_error.h); +inf: none can be told
};

/// What shall be known of the surface at a hit; the rest of its sample stays as it is.
enum class SurfaceNeed {
  Object,  ///< of objects their provenance alone, and no normal at the hit; of the ground nothing
  Look,    ///< all but crossing_error
  Facts,   ///< all
};

struct RayQueryStats {
  // Of tiles: those of the whole world and of the same without water are one cache's.
  std::uint64_t num_tiles_loaded = 0;    ///< from their files or packed, prefetched ones included
  std::uint64_t num_tiles_unpacked = 0;  ///< of these, those that had stayed in memory packed
  std::uint64_t num_tiles_waited = 0;    ///< loads that a ray had to wait for
  std::uint64_t num_tiles_evicted = 0;
  std::uint64_t bytes_resident = 0;
  std::uint64_t peak_bytes_resident = 0;
  /// Held and set aside for loads when a tile was evicted for the first time; 0: none was.
  std::uint64_t bytes_at_first_eviction = 0;
  std::uint64_t bytes_of_prototypes = 0;  ///< held beside the tiles as long as the query
  std::uint64_t num_rays = 0;
  std::uint64_t num_casts = 0;    ///< of a ray at a tile
  std::uint64_t num_lanes = 0;    ///< of the packets in which they were cast
  std::uint64_t num_recasts = 0;  ///< proposals that the double walk refused and asked Embree again
};

/// Rays against a frozen cut of a world. Rays pass from tile to tile in double. In a tile Embree
/// proposes, double decides: the tile is a float scene about its own centre, raised by more than
/// its float error; the first crossing is found by a walk in double over the true triangles. A
/// ray whose tile is not loaded waits while others go on; tiles are then loaded within memory_bytes, nearest
/// first; of units (run_units) the one for which most rays wait.
///
/// accuracy      the crossing of the double ray with the true triangle, never with another one,
///               whatever the float error; its t as the plane's closed form in double has it: the
///               clearance errs by 12 * 2^-53 of the largest coordinate, times 1 + the triangle's
///               slopes; t by that over the rate at which the ray closes in on the plane
/// determinism   results, trails among them, depend on the rays and the cut alone: not on threads,
///               packets, budget, local origin
/// threads       all queries: safe, from parallel loops
/// throws        Input or Io from tile loads, and from prototypes when it is made; Config when it is made:
///               memory_bytes is less than least_memory_bytes(); Internal: a ray without a finite start, a direction
///               with a length (1e-150 to 1e150) or a number for t_max, or with t_min -inf or none;
///               spans of other sizes than said
class RayQuery {
 public:
  RayQuery(const TileStore& store, std::vector<CutTile> cut, const RayQueryOptions& options);

  /// The same cut of the same world without its water, for what is seen below it and for viewers in it.
  /// Its tiles share memory_bytes with those of the whole world.
  struct WithoutWater {
    /// Rays start in water: what they meet first may be the water's surface, from below, where they
    /// leave it (a hit of the ground, of a cover that is water). occluded() does not ask for it: light
    /// passes.
    bool viewers_in_water = false;
  };
  /// Where the sea, a lake or a river stands, the ground is its bed (Cover::Seabed): at each sample as far
  /// below the surface as the tile says, stitched as all ground is, so that it meets the land at the
  /// shores. Solids stay, also those below the surface. A ray that starts in water starts above this
  /// ground; what it meets are the bed, solids, and the land; the surface of the water is the whole
  /// world's (RayQuery of `whole`).
  /// whole   what both need is shared with it: it must live as long
  RayQuery(const RayQuery& whole, const WithoutWater& without);
  ~RayQuery();
  RayQuery(const RayQuery&) = delete;
  RayQuery& operator=(const RayQuery&) = delete;

  const std::vector<CutTile>& cut() const;

  /// First crossings in [t_min, t_max]. A ray that starts on the surface (within kOnSurface_m)
  /// crosses it only where it sinks below; one that starts under it crosses at t_min.
  /// hits       as many as rays
  /// surfaces   as many, or none: what the surface is made of at each hit
  /// trail      receives the tiles that the rays enter; may be null
  void intersect(std::span<const WorldRay> rays, std::span<SurfaceHit> hits, Coherence coherence,
                 std::span<SurfaceSample> surfaces = {}, RayTrail* trail = nullptr,
                 SurfaceNeed need = SurfaceNeed::Look) const;

  /// The same of rays from one point.
  void intersect(const RayFan& rays, std::span<SurfaceHit> hits, Coherence coherence,
                 std::span<SurfaceSample> surfaces = {}, RayTrail* trail = nullptr,
                 SurfaceNeed need = SurfaceNeed::Look) const;
  /// The same crossings, of which only t is told.
  /// t   as many as rays; +inf: sky
  void intersect(const RayFan& rays, std::span<double> t, Coherence coherence,
                 RayTrail* trail = nullptr) const;

  /// Whether there is a crossing in [t_min, t_max]: exactly what intersect says, without finding
  /// out more. For light and for visibility. Rays come to the same tiles.
  void occluded(std::span<const WorldRay> rays, std::span<std::uint8_t> is_occluded,
                RayTrail* trail = nullptr) const;

  /// World z of the true surface above or below a place, nothing outside the tiles.
  std::optional<double> surface_z_world(double x_world, double y_world) const;

  /// Where viewers will be: now, after that, and so on. Tiles that they are likely to need are loaded
  /// in the background, and what is needed latest is dropped first.
  void expect(std::span<const std::vector<Viewpoint>> turns) const;

  /// Calls body(i) for each i in [0, count), as core::parallel_for_blocks one by one. Where the tiles do not
  /// all fit, many more bodies are in work than threads: one whose rays wait for a tile lets others run, and
  /// a tile is loaded for the rays of all of them. What bodies do must not depend on each other.
  void run_units(std::int64_t count, const std::function<void(std::int64_t)>& body) const;

  /// The smallest memory_bytes that holds the largest tile while it is loaded beside what always stays.
  double least_memory_bytes() const;

  /// What memory_bytes leaves for decoded tiles of imagery, which are not the query's: an eighth, or
  /// all of them where they take less.
  double imagery_budget_bytes() const;

  bool is_without_water() const;

  RayQueryStats stats() const;
  /// The Embree version, instruction set and widths in use, for records that are not compared.
  std::string profile() const;

 private:
  enum class World : std::uint8_t;  ///< which of the worlds that share a cache
  struct Impl;
  RayQuery(const RayQuery& whole, World world);

  std::unique_ptr<Impl> impl_;
};

}  // namespace terracast::world
