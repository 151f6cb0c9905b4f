#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>

#include "core/semantic_class.h"
#include "scene/ground/lanes.h"
#include "scene/ground/noise.h"
#include "scene/water/sea_exposure.h"
#include "world/field_pattern.h"
#include "world/ray_query.h"
#include "world/tile_store.h"

namespace terracast::scene {

/// What the ground's cover depends on beside its own place.
struct Climate {
  double sea_level_m = 0.0;  ///< ellipsoidal, of the world's sea; 0 without one
  bool has_sea = false;
  double snow_line_m = 3000.0;  ///< above the sea, where snow lies in summer
  double tree_line_m = 2100.0;  ///< above the sea
  bool has_mapped_ice = false;  ///< rasters of land cover alone say where snow and ice lie all year
  bool has_trees = false;  ///< trees stand on the ground of forests, and crops on that of fields
  std::uint32_t seed = 1;
  std::shared_ptr<const SeaExposure> exposure{};  ///< null: all sea is open
  world::FieldPattern fields{1, true};
};

/// The climate of a world: snow line by latitude, sea level from the sea samples of its coarsest
/// tiles within its square.
/// throws   Input, Io: as TileStore::load
Climate climate_of(const world::TileStore& store, std::uint32_t seed);

/// Where samples meet the ground.
struct GroundPlaces {
  Lanes3d point_world;
  Lanes3d normal_world;            ///< of the true triangle
  Lanes<double> footprint_m;       ///< width of an image sample on the ground
  Lanes<double> moisture;          ///< 0 … 1
  Lanes<double> spacing_m;         ///< of the terrain samples
  Lanes<double> sea_depth_m;       ///< of the sea above its bed; 0 elsewhere, in other waters too
  Lanes<std::uint8_t> cover;       ///< world::Cover
  Lanes<std::uint8_t> is_painted;  ///< 0 or 1
  std::array<world::PaintSample, kLanes> paint;

  void set(int lane, const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
           const world::SurfaceSample& surface, double footprint) {
    for (std::size_t k = 0; k < 3; ++k) {
      point_world[k][lane] = point[static_cast<int>(k)];
      normal_world[k][lane] = normal[static_cast<int>(k)];
    }
    footprint_m[lane] = footprint;
    set_surface(lane, surface);
  }
  void set_surface(int lane, const world::SurfaceSample& surface) {
    moisture[lane] = surface.moisture;
    spacing_m[lane] = surface.spacing_m;
    sea_depth_m[lane] = 0.0;
    cover[lane] = static_cast<std::uint8_t>(surface.cover);
    is_painted[lane] = surface.paint.is_painted ? 1 : 0;
    if (surface.paint.is_painted) paint[static_cast<std::size_t>(lane)] = surface.paint;
  }
};

/// Along which beds of rock follow each other, metres of them per metre of world x, y and z: they dip by a few
/// degrees.
inline constexpr std::array<double, 3> kAcrossBeds = {0.11, -0.07, 1.0};

/// What the ground is made from at places that are shaded together.
struct GroundPacket {
  NoisePlaces places;
  Lanes<double> east_m;  ///< world x
  Lanes<double> north_m;
  Lanes<std::int32_t> strata_u;  ///< noise coordinates of beds of rock: across them and along
  Lanes<std::int32_t> strata_v;
  Lanes3f normal;             ///< of the true triangle
  Lanes<float> steepness;     ///< sine of the slope against the place's own vertical
  Lanes<float> northness;     ///< north component of the normal
  Lanes<float> height_m;      ///< above sea level
  Lanes<float> moisture;      ///< 0 … 1
  Lanes<float> spacing_m;     ///< of the terrain samples: shape finer than that is the material's
  Lanes<float> sea_depth_m;   ///< as GroundPlaces has it
  Lanes<std::uint8_t> cover;  ///< world::Cover
  bool has_known_cover;       ///< a source of land cover knows some lane
  Lanes<std::uint8_t> is_painted;
  std::array<world::PaintSample, kLanes> paint;
};

/// What light meets there.
struct GroundLook {
  Lanes3f albedo;
  Lanes3f normal;              ///< with the relief that the terrain's samples do not hold
  Lanes<float> openness;       ///< share of the ambient light that small hollows leave, 0 … 1
  Lanes<float> is_water;       ///< 0 or 1
  Lanes<float> wave_variance;  ///< mean square slope of waves too small to be seen one by one
};

/// Procedural ground. All of it is a function of the place, the true triangle there and the tile's
/// facts: it is the same from every view and in every frame; only how much detail is left out
/// follows the footprint. Threads: safe.
class Ground {
 public:
  explicit Ground(const Climate& climate) : climate_(climate) {}
  const Climate& climate() const { return climate_; }

  /// What is known of the ground at some places before it is drawn. All lanes are to be set; those
  /// without a hit take any other's values.
  void set(const GroundPlaces& places, GroundPacket& packet) const;

  /// Semantic classes of ground that is not painted (class_of in scene/ground/marking.h tells of that):
  /// those that the cover names, on Land by slope, height, moisture and noise. Footprints play no part.
  void classify(const GroundPacket& packet, Lanes<std::uint8_t>& classes) const;

  void look(const GroundPacket& packet, GroundLook& look) const;

 private:
  static core::SemanticClass class_of(world::Cover cover, core::SemanticClass guessed);

  Climate climate_;
};

/// Height above the ellipsoid of the world's origin, to second order in the distance: 3 m at 100
/// km, for materials and air.
double approximate_height_m(const Eigen::Vector3d& point_world);

}  // namespace terracast::scene
