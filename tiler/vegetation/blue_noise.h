#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace terracast::tiler {

/// Places strewn over the plane at random, none nearer to another than a least distance, and without
/// wide gaps: a Poisson-disc set, a pure function of seed and place.
///
/// The plane is cut into cells too small for two places. In each of some rounds every empty cell throws
/// darts and offers the first that is far enough from the places of earlier rounds; of offers that are too
/// near to each other the one with the highest number becomes a place (dart throwing in parallel after
/// Bowers, Wang, Wei and Maletz, "Parallel Poisson disk sampling with spectrum analysis on surfaces",
/// SIGGRAPH Asia 2010; each round is a thinning after Matern). So a cell depends on none but those within
/// 32 cells, any window comes out as any other, and no direction or order of cells is preferred.
///
/// threads   safe
class BlueNoise {
 public:
  struct Place {
    std::int32_t cell_x;
    std::int32_t cell_y;
    Eigen::Vector2d at_world;  ///< on the lattice of kHeightStep_m
  };

  /// cell_m   a multiple of kHeightStep_m, below 64
  BlueNoise(std::uint64_t seed, std::uint64_t stream, double cell_m);

  double cell_m() const { return cell_m_; }
  double least_distance_m() const { return kDistance * cell_m_; }

  /// All places with lowest <= x, y < highest, cell by cell from west to east, rows from south to
  /// north.
  /// cost   0.2 us a cell
  std::vector<Place> places_in(const Eigen::Vector2d& lowest_world,
                               const Eigen::Vector2d& highest_world) const;

 private:
  /// Of a cell's side; below the root of two a cell could hold a second place.
  static constexpr double kDistance = 1.4;

  std::uint64_t seed_;
  std::uint64_t stream_;
  double cell_m_;
};

}  // namespace terracast::tiler
