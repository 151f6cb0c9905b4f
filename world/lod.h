#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/schema.h"
#include "geo/box3.h"
#include "world/tile_store.h"

namespace terracast::world {

/// All that rays see which start at many places: the sums of places between `starts` and of `directions` with
/// factors of 0 or more. Convex, and without an end.
class RaySheaf {
 public:
  /// Of the image's corners, in their order around it.
  /// pixels_per_m   that span as many pixels from near and from far
  RaySheaf(const std::array<Eigen::Vector3d, 4>& starts_world,
           const std::array<Eigen::Vector3d, 4>& directions_world, double pixels_per_m);

  double pixels_per_m() const { return pixels_per_m_; }
  const geo::Box3d& starts_box_world() const { return starts_box_; }
  /// Whether it meets a box; where roundings decide, either. By the planes that part two convex bodies.
  bool meets(const geo::Box3d& box_world) const;

 private:
  bool is_apart(const geo::Box3d& box_world, const Eigen::Vector3d& axis) const;

  std::array<Eigen::Vector3d, 4> starts_;
  std::array<Eigen::Vector3d, 4> directions_;
  std::vector<Eigen::Vector3d> edges_;
  double pixels_per_m_;
  geo::Box3d starts_box_;
};

/// A place from which the world is seen, and how finely.
struct Viewpoint {
  Eigen::Vector3d position_world;
  double pixels_per_radian = 0.0;  ///< of the finest camera there
  /// Of a camera whose rays start at many places; null: all start at the position.
  std::shared_ptr<const RaySheaf> sheaf = nullptr;
};

/// Config `[detail]`: how fine terrain is near the cameras.
struct DetailOptions {
  double cell_px = 2.0;           ///< a cell may span this many pixels before it is split
  double finest_spacing_m = 1.0;  ///< never finer than this; a power of two

  template <class Visitor>
  void describe(Visitor& visit) {
    visit.key("cell_px", cell_px, "A terrain cell is split when it spans more pixels than this.",
              core::between(0.25, 64.0));
    visit.key(
        "finest_spacing_m", finest_spacing_m,
        "Cameras get no terrain samples closer together than this; a power of two. The world's "
        "square is tiled all over at the spacing of its heights, whatever this says (that of "
        "the first raster that is no inset, or of the procedural land behind rasters, "
        "rounded down to a power of two; at least world.size_m / 8192, at most 128 m): a "
        "larger value shows coarser terrain and saves none of these tiles.",
        core::between(0.125, 1024.0));
  }
  void validate() const;  ///< throws Config: spacing not a power of two
  int finest_level() const;
};

/// Whether a tile is too coarse for at least one viewpoint: its spacing, seen at the least distance
/// between the viewpoint and the tile's box, spans more than cell_px pixels. Of a camera whose rays start at
/// many places that is the distance to the box around these, and a tile that its rays meet is too coarse also
/// where the spacing spans more pixels than that at any distance. Depends on the tile's own bounds only, so that the tiler (which grows the tree from the top) and the renderer (which
/// reads it) decide alike.
bool wants_refinement(const TileInfo& tile, std::span<const Viewpoint> viewpoints,
                      const DetailOptions& options);

/// A tile of a cut, and which of its sides meet a coarser neighbour.
struct CutTile {
  TileId id;
  std::uint8_t coarser_sides = 0;  ///< bits of TileSide
  bool operator==(const CutTile&) const = default;
};

/// Which tiles must be split so that edge neighbours of the leaves differ by one level at most.
/// leaves    ids that tile the plane within the roots
/// returns   the leaves after splitting, sorted
std::vector<TileId> balance(const std::vector<TileId>& leaves);

/// The frozen cut: each tile's level is chosen once for a whole sequence, from the least distance
/// of any camera to it, then balanced. Odd border samples on a coarser side stand for the exact
/// mean of their two neighbours there.
/// viewpoints   all cameras at all frames (the whole sequence, whatever shard renders)
/// returns      leaves that cover every tile of the coarsest level, sorted by id
/// throws       Input: the store lacks a tile that the balanced cut needs
std::vector<CutTile> choose_cut(const TileStore& store, std::span<const Viewpoint> viewpoints,
                                const DetailOptions& options);

/// A tile that these viewpoints want finer than the store has it, which was tiled for others; nothing
/// when it has all that the cut for them asks for.
std::optional<TileId> missing_detail(const TileStore& store, std::span<const Viewpoint> viewpoints,
                                     const DetailOptions& options);

/// The finest cut that the store holds, balanced.
std::vector<CutTile> finest_cut(const TileStore& store);

/// Neighbour masks for leaves that are balanced.
std::vector<CutTile> with_coarser_sides(const std::vector<TileId>& leaves);

/// Applies the stitching rule to a tile's heights: on each side of `coarser_sides`, the odd samples
/// become the mean of their even neighbours along the side, in units of half a kHeightStep_m.
/// returns    heights above the tile's center_z_m in half steps (exact integers), kTileSamples^2
std::vector<std::int32_t> stitched_half_steps(const Tile& tile, std::uint8_t coarser_sides);

}  // namespace terracast::world
