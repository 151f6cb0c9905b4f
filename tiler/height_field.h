#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "geo/geodesy.h"
#include "geo/geoid.h"
#include "tiler/kept_ground.h"
#include "world/tile.h"
#include "world/tile_store.h"

namespace terracast::tiler {

/// What a field says of a place beside its height.
struct FieldFacts {
  std::uint8_t source = 0;  ///< row of HeightField::sources
  /// Where a sea may be: the height of its surface, in the field's datum.
  std::optional<double> sea_height_m;
  /// Of the sea's floor, below HeightField::height_m; only where that is not above the sea.
  double floor_depth_m = 0.0;
  /// Whether that floor is a shelf that no source knows.
  bool is_shelf = false;
};

/// Map coordinates of places: each place of the ellipsoid has one pair of them, whatever its height.
///
/// threads   safe
class MapProjection {
 public:
  virtual ~MapProjection() = default;

  /// Map coordinates of places (heights are not looked at).
  /// throws   Input: a place that the projection cannot hold
  virtual void map_from_geodetic(std::span<const geo::Geodetic> places,
                                 std::span<Eigen::Vector2d> map) const = 0;

  /// About how far apart places are whose map coordinates differ by 1.
  virtual double metres_per_map_unit() const = 0;
};

/// The measured heights of a world as one function of map coordinates: the mosaic of its rasters,
/// procedural or analytic terrain.
///
/// Map coordinates are the field's own: samples of a raster's grid, metres.
///
/// threads   safe
class HeightField : public MapProjection {
 public:
  /// Height above the field's datum; once continuously differentiable.
  virtual double height_m(const Eigen::Vector2d& map) const = 0;

  virtual FieldFacts facts(const Eigen::Vector2d& map) const = 0;

  /// Whether facts() tells of a sea anywhere.
  virtual bool has_sea() const = 0;

  /// Bounds of height_m.
  virtual double lowest_m() const = 0;
  virtual double highest_m() const = 0;

  /// What heights are above.
  virtual const geo::VerticalDatum& datum() const = 0;

  /// Between the finest samples, on the ground; insets do not count.
  virtual double spacing_m() const = 0;

  /// Between the widest samples that heights come from anywhere.
  virtual double widest_spacing_m() const { return spacing_m(); }

  /// Whether parts of the ground are measured finer than others.
  virtual bool has_insets() const { return false; }

  /// Share of the ground at a place that takes detail of a period of 2^octave m: 1, but less where
  /// finer sources hold what is there.
  virtual double detail_share(const Eigen::Vector2d& map, int octave) const {
    static_cast<void>(map);
    static_cast<void>(octave);
    return 1.0;
  }

  /// Whether detail may be added below the spacing: not where the field is known at every place.
  virtual bool takes_detail() const = 0;

  virtual const std::vector<world::SourceInfo>& sources() const = 0;

  /// Of all that determines the heights.
  virtual std::string input_hash() const = 0;

  /// Procedural land in the field, which a world's folder keeps.
  virtual std::vector<KeptLand> lands() const { return {}; }
};

}  // namespace terracast::tiler
