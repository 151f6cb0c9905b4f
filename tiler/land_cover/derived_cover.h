#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tiler/dryness.h"
#include "tiler/even_noise.h"
#include "tiler/grid.h"
#include "tiler/layer.h"

namespace terracast::tiler {

struct DerivedCoverOptions {
  double forest_share = 0.45;
  double field_share = 0.45;
  double snow_line_m = -1.0;  ///< below 0: as the latitude has it
  double tree_line_m = -1.0;
};

/// Land cover that nobody has mapped, as it would lie on this land: forests below the tree line, more on
/// slopes than on the plain; fields on level land with a growing season; meadows between; shrubs at
/// forests' edges, on dry ground and above the trees; bare rock and scree on the steep, on crests
/// between walls, and high up; snow above its line, less on slopes to the sun; wetlands on level ground at water. Of the sea's
/// shore nothing is said: what it is made of follows from its height.
///
/// Heights of the lines are above the ellipsoid, which is within 110 m of the sea, and less than the
/// lines wander. Patches come from noise between 4 km and 60 m. Where the world says that it is dry, deserts and
/// steppes come before all that grows.
///
/// threads   safe; cover() is a function of the place and the seed
class DerivedCover {
 public:
  /// cost   0.5 us a node of a grid over the square, of up to 2049 nodes a side
  DerivedCover(const DerivedCoverOptions& options, const LayerInputs& inputs);

  std::optional<world::Cover> cover(const Eigen::Vector2d& place_world,
                                    const SurfaceSample& ground) const;

  const std::string& content_hash() const { return hash_; }

 private:
  void measure(const LayerInputs& inputs);
  Eigen::Vector2d node_of(const Eigen::Vector2d& place_world) const;

  DerivedCoverOptions options_;
  bool is_north_;
  double spacing_m_ = 0.0;  ///< of the grid, whose nodes lie on the world's lattice
  int first_node_ = 0;      ///< the first row and column stand at first_node_ * spacing_m_
  Grid<float> slope_;       ///< rise over run
  Grid<float> crest_;       ///< rise over run of the more level side of a crest; 0 elsewhere
  Grid<float> northness_;   ///< 1 on a slope of 45 degrees to the north, -1 to the south
  Grid<float> water_m_;     ///< distance to the sea or to a stream
  Grid<float> sea_m_;       ///< distance to the sea; empty without one
  EvenNoise region_, fields_, woods_, patch_;
  std::shared_ptr<const Dryness> dryness_;  ///< null: the land is humid
  std::string hash_;
};

}  // namespace terracast::tiler
