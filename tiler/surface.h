#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/context.h"
#include "geo/geodesy.h"
#include "geo/geoid.h"
#include "tiler/world_options.h"
#include "world/tile.h"
#include "world/tile_store.h"

namespace terracast::tiler {

/// A sample of the world's surface at a lattice place.
struct SurfaceSample {
  double z_world = 0.0;  ///< not yet on the height lattice
  world::Cover cover = world::Cover::Land;
  std::uint8_t moisture = 0;
  std::uint8_t source = 0;     ///< of its height; at sea, of the floor's
  double water_depth_m = 0.0;  ///< of the bed below z_world, along up; 0 on land
};

class LayerStack;

/// All elevation sources of a world, opened, mosaicked, with voids filled, and what its layers do to
/// the ground: one function of place, the same from any thread.
///
/// The surface at a world (x, y) is the z at which the geodetic height of (x, y, z) is the source's
/// height there (fixed point, to 1e-6 m). Detail below the measured spacing is added octave by
/// octave; each octave vanishes at the multiples of its period, so that levels from
/// measured_level() up hold measured heights only.
///
/// threads   safe
class WorldSurface {
 public:
  /// The ground without the world's layers: reads and checks every source of heights, fills voids.
  /// store    the world's folder, if there is one: what it keeps of this ground is read from there,
  ///          and what measured_height_m() does without is left until complete() or sample()
  /// throws   Config, Input, Io: sources that cannot be read, georeferenced, lack a datum, hold
  ///          values that are no heights, or leave parts of the square without cover (naming the
  ///          area) while outside = "error"
  static std::shared_ptr<const WorldSurface> prepare_ground(
      const WorldOptions& options, const core::Context& context,
      const std::filesystem::path& store = {});
  /// With them, which takes far longer: half a minute and more of CPU for a country of 50 km (docs/performance.md).
  /// throws   as prepare_ground(), and for what layers read
  static std::shared_ptr<const WorldSurface> prepare(const WorldOptions& options,
                                                     const core::Context& context);
  virtual ~WorldSurface() = default;

  virtual const geo::WorldFrame& frame() const = 0;
  virtual const WorldOptions& options() const = 0;
  virtual const std::vector<world::SourceInfo>& sources() const = 0;
  /// Finest level without synthetic detail anywhere. Insets hold measured ground at finer levels
  /// too: what a sample's source knows, its spacing says.
  virtual int measured_level() const = 0;
  /// Coarsest level that holds all that the finest source knows; coarser where the square would
  /// take too many tiles of it, finer where its tiles would be over 33 km wide.
  virtual int base_level() const = 0;
  virtual std::string input_hash() const = 0;  ///< of all that determines sample()

  /// The surface with all its detail at a place: a pure function of the place. On a level's lattice
  /// the octaves of finer detail vanish exactly, so that all levels agree there bit for bit.
  virtual SurfaceSample sample(double x_world, double y_world) const = 0;

  /// sample() at all places of a tile, in the order of Tile's arrays.
  /// samples  kTileSamples^2
  /// cost     0.3 us a sample inside the square, 2 us beyond it and where fields lie over others
  virtual void sample_tile(const world::TileId& id, std::span<SurfaceSample> samples) const = 0;

  /// What stands on the surface and is painted on it.
  virtual const LayerStack& layers() const = 0;

  /// Bounds of the ellipsoidal height of the measured surface, to within the geoid's slope.
  virtual double lowest_m() const = 0;
  virtual double highest_m() const = 0;

  /// Ellipsoidal height of the measured surface (sources, voids filled, sea; no synthetic detail);
  /// nothing outside the world's square.
  virtual std::optional<double> measured_height_m(double lat_deg, double lon_deg) const = 0;

  /// Analyses the whole square, which samples need, if that was left out so far. sample() does so
  /// itself; in parallel loops it must have been done before.
  virtual void complete() const = 0;

  /// Has a world's folder keep what prepare_ground() need not make again.
  /// throws   Io
  virtual void keep_ground(const std::filesystem::path& store) const = 0;
};

}  // namespace terracast::tiler
