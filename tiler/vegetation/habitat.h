#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "tiler/gradient_noise.h"
#include "tiler/vegetation/groves.h"
#include "tiler/vegetation/stands.h"
#include "world/tile.h"

namespace terracast::tiler {

/// What plants find at a place.
struct Ground {
  world::Cover cover = world::Cover::Land;
  double height_m = 0.0;  ///< above the sea, or the ellipsoid
  double slope = 0.0;     ///< rise per metre
  double moisture = 0.5;  ///< 0 … 1

  /// What single plants follow, and pieces of forest do not.
  double edge = 0.0;  ///< 0 … 1: how near a border between forest and open land is
  bool has_rows = false;
  bool is_by_way = false;
  bool is_by_water = false;    ///< a river, a stream or a lake
  bool is_kept_short = false;  ///< nothing but grass may grow: an airfield
};

/// How much grows at a place. Shares are of the places that are strewn for such plants: 1 is as dense as they
/// stand.
struct Growth {
  double trees = 0.0;
  double bushes = 0.0;
  double dwarf_pines = 0.0;  ///< of the bushes
  double grass = 0.0;
  double reeds = 0.0;
  double boulders = 0.0;
};

/// What a plant's leaves have of others' colour, and what of their own.
struct Tint {
  double light = 0.0;   ///< of the others': -1 … 1
  double warm = 0.0;    ///< the same
  double shared = 0.0;  ///< 0: all is its own, 1: all is the others'
};

/// What trees, if any, grow at a place. Shares are of the trees; the rest are broadleaves.
struct TreeKinds {
  double size = 1.0;  ///< of the height that species reach in good places
  double conifers = 0.0;
  double pines = 0.0;
  double palms = 0.0;
  double dead = 0.0;
  double poplars = 0.0;   ///< of the broadleaves
  double birches = 0.34;  ///< the same
  /// They are of one age: nearly as tall as each other.
  bool is_stand = false;
  Tint tint{};

  /// Of forest in good places.
  double top_m() const { return 16.0 + 6.0 * conifers; }
};

/// What grows where, by cover, climate and ground. It follows no survey: shares are plain numbers, the
/// tree line is world::tree_line_m(), conifers take over towards it, forest is parted into Stands, what stands in
/// the open into Groves, and other patches come from noise.
///
/// threads   safe
class Habitat {
 public:
  /// fields   along whose borders rows may stand
  Habitat(std::uint64_t seed, double lat_deg, const world::FieldPattern& fields);

  Growth growth(const Ground& ground, const Eigen::Vector2d& place_world) const;
  TreeKinds tree_kinds(const Ground& ground, const Eigen::Vector2d& place_world) const;

  /// Leaves a share of what grows by rain alone.
  static void thin_out(Growth& growth, double share);

  // Make of a meadow's growth that of a garden: mown, with small trees and bushes.
  static void plant_garden(Growth& growth);
  static void plant_garden(TreeKinds& kinds);

  /// Where a place's cover is asked for: covers have straight edges of raster cells, woods do not.
  Eigen::Vector2d strayed(const Eigen::Vector2d& place_world) const;

  double tree_line_m() const { return tree_line_m_; }

 private:
  /// How far a place lies below its tree line, or as far as matters.
  double below_line_m(const Ground& ground, const Eigen::Vector2d& place_world) const;
  double patches(const Eigen::Vector2d& place_world, double period_m, int which) const;
  /// Of land of which nothing is known: where it is wooded, 0 … 1.
  double woods(const Ground& ground, const Eigen::Vector2d& place_world) const;
  void grow_forest(Growth& growth, const Ground& ground, const Eigen::Vector2d& place_world) const;
  /// What stands on open land.
  Grove grove(const Ground& ground, const Eigen::Vector2d& place_world) const;
  void be_of_stand(TreeKinds& kinds, const Ground& ground,
                   const Eigen::Vector2d& place_world) const;

  double lat_deg_;
  double tree_line_m_;
  GradientNoise noise_;
  Stands stands_;
  Groves groves_;
};

}  // namespace terracast::tiler
