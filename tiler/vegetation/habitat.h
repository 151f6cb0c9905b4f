#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "tiler/gradient_noise.h"
#include "world/tile.h"

namespace terracast::tiler {

/// What plants find at a place.
struct Ground {
  world::Cover cover = world::Cover::Land;
  double height_m = 0.0;  ///< above the sea, or the ellipsoid
  double slope = 0.0;     ///< rise per metre
  double moisture = 0.5;  ///< 0 … 1
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

/// What trees, if any, grow at a place. Shares are of the trees; the rest are broadleaves.
struct TreeKinds {
  double size = 1.0;  ///< of the height that species reach in good places
  double conifers = 0.0;
  double pines = 0.0;
  double palms = 0.0;
  double dead = 0.0;
  double poplars = 0.0;  ///< of the broadleaves
};

/// What grows where, by cover, climate and ground. It follows no survey: shares are plain numbers, the
/// tree line is world::tree_line_m(), conifers take over towards it, and patches and edges come from noise.
///
/// threads   safe
class Habitat {
 public:
  Habitat(std::uint64_t seed, double lat_deg);

  Growth growth(const Ground& ground, const Eigen::Vector2d& place_world) const;
  TreeKinds tree_kinds(const Ground& ground, const Eigen::Vector2d& place_world) const;

  // Make of a meadow's growth that of a garden: mown, with small trees and bushes.
  static void plant_garden(Growth& growth);
  static void plant_garden(TreeKinds& kinds);

  /// Where a place's cover is asked for: covers have straight edges of raster cells, woods do not.
  Eigen::Vector2d strayed(const Eigen::Vector2d& place_world) const;

  double tree_line_m() const { return tree_line_m_; }

 private:
  /// How far a place lies below its tree line, or as far as matters.
  double below_line_m(const Ground& ground, const Eigen::Vector2d& place_world) const;
  /// 0 … 1, smooth over about `period_m`.
  double patches(const Eigen::Vector2d& place_world, double period_m, int which) const;

  double lat_deg_;
  double tree_line_m_;
  GradientNoise noise_;
};

}  // namespace terracast::tiler
