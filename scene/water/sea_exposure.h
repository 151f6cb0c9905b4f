#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "world/tile_store.h"

namespace terracast::scene {

/// How open the sea is round places: waves from the open sea break at its coast, not in a narrow estuary or far up
/// a tidal river that the data call sea. Told by the share of sea in a square round a place, as tiles of some
/// spacing show it: about a half at a straight coast, less than a tenth in an estuary of 100 m.
/// memory    8 bytes a node: 5 MB for 50 km, 134 MB at most (kMaxNodes)
/// cost      a place: the sums of four nodes. The whole: each tile of the level is read once
/// threads   safe
class SeaExposure {
 public:
  /// Half a side of the square.
  static constexpr double kReach_m = 800.0;
  /// Shares of sea from which on there is some surf, and all of it.
  static constexpr double kSheltered = 0.14;
  static constexpr double kOpen = 0.28;

  static constexpr std::int64_t kMaxNodes = std::int64_t{1} << 24;

  /// Of a world's sea, from the tiles of level kLevel, or of the coarsest level where that is
  /// finer: every sample of them, every second, or every fourth …, so that there are no more nodes
  /// than max_nodes (4 at least).
  /// throws   Input, Io: as TileStore::load
  /// threads  one
  static std::shared_ptr<const SeaExposure> of(const world::TileStore& store,
                                               std::int64_t max_nodes = kMaxNodes);

  /// Share of sea among what tiles know in the square round a place, 0 … 1; between the places of samples it is
  /// interpolated. 1 where nothing is known.
  double sea_share(const Eigen::Vector2d& place_world) const;
  /// Share of the surf of an open coast that there is, 0 … 1.
  double surf(const Eigen::Vector2d& place_world) const;

  /// Distance of the samples that are counted.
  double spacing_m() const { return spacing_m_; }
  /// Of all that the shares depend on.
  const std::string& content_hash() const { return content_hash_; }

 private:
  static constexpr int kLevel = 6;  ///< samples 64 m apart

  /// Of samples west and south of a node: known ones, and of these sea.
  struct Sums {
    std::int32_t known = 0;
    std::int32_t sea = 0;
  };
  void add(const world::TileId& id, const world::Tile& tile, int step_log2);
  void add_up();
  double share_at(std::int64_t i, std::int64_t j) const;

  double spacing_m_ = 1.0;
  std::int64_t first_x_ = 0;  ///< of the lattice, in spacings from the world's origin
  std::int64_t first_y_ = 0;
  std::int64_t width_ = 0;
  std::int64_t height_ = 0;
  std::vector<Sums> sums_;  ///< (width_ + 1) x (height_ + 1), row by row from south to north
  std::string content_hash_;
};

}  // namespace terracast::scene
