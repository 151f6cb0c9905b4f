#pragma once

#include <atomic>
#include <cstddef>
#include <limits>
#include <memory>

namespace terracast::world {

/// The tiles of a cut that rays came to: at which they were cast, and how low they passed over others.
///
/// A ray is cast at a tile when it comes as low as the tile's highest point within the tile's square,
/// before it has crossed the surface elsewhere; it passes over a tile within whose square it stays
/// above that. So a ray's crossing depends on the tiles at which it was cast, and on no other as long
/// as none reaches up to where the ray passes over it.
///
/// Rays are followed up to kFollowed_m above the highest point of the whole cut: passages that are all
/// higher than that may be left out.
///
/// determinism   what stands in it depends on the rays and the cut alone
/// threads       calls of RayQuery may add to one at the same time; reading waits for their end
class RayTrail {
 public:
  static constexpr double kFollowed_m = 65.0;
  static constexpr double kNever = std::numeric_limits<double>::infinity();

  /// num_tiles   of the cut
  explicit RayTrail(std::size_t num_tiles)
      : lowest_(std::make_unique<std::atomic<double>[]>(num_tiles)), num_tiles_(num_tiles) {
    clear();
  }

  std::size_t num_tiles() const { return num_tiles_; }

  bool is_touched(std::size_t tile) const { return lowest_z_world(tile) == kTouched; }
  /// The lowest z at which a ray passed over a tile at which none was cast; kNever: none did.
  double passed_z_world(std::size_t tile) const {
    const double z_world = lowest_z_world(tile);
    return z_world == kTouched ? kNever : z_world;
  }

  void touch(std::size_t tile) { pass(tile, kTouched); }
  void pass(std::size_t tile, double z_world) {
    std::atomic<double>& lowest = lowest_[tile];
    double known = lowest.load(std::memory_order_relaxed);
    while (z_world < known &&
           !lowest.compare_exchange_weak(known, z_world, std::memory_order_relaxed)) {
    }
  }
  /// What stands in another trail through the same cut.
  void add(const RayTrail& other) {
    for (std::size_t tile = 0; tile < num_tiles_; ++tile) pass(tile, other.lowest_z_world(tile));
  }
  void clear() {
    for (std::size_t tile = 0; tile < num_tiles_; ++tile)
      lowest_[tile].store(kNever, std::memory_order_relaxed);
  }

 private:
  static constexpr double kTouched = -std::numeric_limits<double>::infinity();

  double lowest_z_world(std::size_t tile) const {
    return lowest_[tile].load(std::memory_order_relaxed);
  }

  std::unique_ptr<std::atomic<double>[]> lowest_;
  std::size_t num_tiles_;
};

}  // namespace terracast::world
