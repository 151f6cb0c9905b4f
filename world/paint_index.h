#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "world/ground_paint.h"
#include "world/tile_id.h"

namespace terracast::world {

/// What is painted on a tile's ground, found by place. Immutable; threads: safe.
///
/// A place (x, y) is on a strip when its distance from the strip's line, in double, is at most half the
/// width. It is in an area when an odd number of its edges pass east of it: those one of whose ends has
/// y at most that of the place and the other a larger one, and of which the place lies west, by the sign
/// of (x1 - x0)(y - y0) - (x - x0)(y1 - y0) from the southern end. So areas that share an edge share no
/// place there and leave none out.
class PaintIndex {
 public:
  /// strips, areas   finite; those that do not reach into the tile's square are never found
  PaintIndex(const TileId& id, std::vector<Strip> strips, std::vector<Area> areas);

  /// What is seen at a place of the tile's square.
  /// sample   is_painted is set; the rest of it where that is true
  void find(double x_world, double y_world, PaintSample& sample) const;

  bool is_empty() const { return ranked_.empty(); }
  std::size_t num_bytes() const;

 private:
  /// A part of a strip, or an area.
  struct Coat {
    std::uint32_t index;  ///< of strips_ or areas_
    std::uint32_t point;  ///< kArea, or the first of the part's two
    double start_m;       ///< of the part, along the whole line
  };
  static constexpr std::uint32_t kArea = 0xffffffffU;
  /// Of a place and a part's line.
  struct Nearest {
    double squared_m2;
    double along_m;
    double across_m;
  };

  const Coating& coating(const Coat& coat) const;
  Nearest nearest(const Coat& coat, double x_world, double y_world) const;
  bool is_in(const Area& area, double x_world, double y_world) const;
  void fill_rows(int num_rows);
  void fill_cells(int num_cells);
  int row_at(double y_world) const;

  TileId id_;
  std::vector<Strip> strips_;
  std::vector<Area> areas_;
  std::vector<Coat> ranked_;  ///< what is seen before what
  /// Of an area; its ends in steps.
  struct Edge {
    Eigen::Vector2i south;
    Eigen::Vector2i north;
  };
  int num_rows_ = 1;  ///< of the tile, from the south
  /// Edges of area a in row r: from row_begins_[a * num_rows_ + r] on.
  std::vector<std::uint32_t> row_begins_;
  std::vector<Edge> edges_;
  int num_cells_ = 1;                       ///< along a side of the tile
  std::vector<std::uint32_t> cell_begins_;  ///< of each cell, by rows from the south-west
  std::vector<std::uint32_t> coats_;        ///< of ranked_, in its order
};

}  // namespace terracast::world
