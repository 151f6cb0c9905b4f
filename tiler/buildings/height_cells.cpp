#include "tiler/buildings/height_cells.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/error.h"
#include "core/hash.h"
#include "tiler/earth_heights.h"

namespace terracast::tiler {
namespace {

using core::ErrorKind;
using core::fail;
using Eigen::Vector2d;

/// Rows that are read at a time.
constexpr int kRows = 256;
constexpr std::int64_t kMostCells = 100'000'000;
/// No building is higher (the tallest stands 828 m high): heights above the sea are.
constexpr double kTallest_m = 900.0;
/// A surface lies below its terrain by as much as both err, and not by more in most places.
constexpr double kBelow_m = 1.0;
/// Cells of the terrain are found at nodes so many cells of the surface apart, and are straight
/// between them within a hundredth of a cell.
constexpr int kNode = 64;

struct Part {
  std::unique_ptr<RasterSource> raster;
  SampleWindow window;  ///< that may lie in the square
  std::string nodata;   ///< as the config states it
};

Part open_part(const core::Path& file, const std::string& nodata, const WorldSurface& world,
               double size_m) {
  ElevationOptions options;
  options.nodata = nodata;
  const geo::Geodetic& origin = world.frame().origin();
  Part part{RasterSource::open(file, options, origin), {}, nodata};
  const RasterGrid& grid = part.raster->grid();
  const Eigen::AlignedBox2d box = grid.box_of_square(world.frame(), 0.5 * size_m);
  const auto clamped = [](double value, int size) {
    return static_cast<int>(std::clamp(value, 0.0, static_cast<double>(size)));
  };
  part.window.first_column = clamped(std::floor(box.min().x()) - 1.0, grid.width());
  part.window.first_row = clamped(std::floor(box.min().y()) - 1.0, grid.height());
  part.window.width =
      clamped(std::ceil(box.max().x()) + 2.0, grid.width()) - part.window.first_column;
  part.window.height =
      clamped(std::ceil(box.max().y()) + 2.0, grid.height()) - part.window.first_row;
  if (part.window.is_empty())
    fail(ErrorKind::Input,
         "{}: lies beside the world's square ({} m wide); state a raster of building heights that "
         "reaches into it; if it should, is {} the right CRS of its coordinates? (gdal_edit.py "
         "-a_srs states another)",
         part.raster->path(), size_m, grid.crs_name());
  if (part.window.num_samples() > kMostCells)
    fail(ErrorKind::Input,
         "{}: {} of its cells lie in the world's square, and {} are taken at most; make it coarser "
         "(gdalwarp -tr), or the square smaller",
         part.raster->path(), part.window.num_samples(), kMostCells);
  return part;
}

Grid<float> read_all(const Part& part) {
  Grid<float> values(part.window.width, part.window.height);
  for (int row = 0; row < part.window.height; row += kRows) {
    SampleWindow window = part.window;
    window.first_row += row;
    window.height = std::min(kRows, part.window.height - row);
    const Grid<double> rows = part.raster->read(window);
    refuse_undeclared_fills(*part.raster, rows, part.nodata, "heights_nodata");
    for (std::size_t k = 0; k < rows.values.size(); ++k)
      values.values[values.index(0, row) + k] = static_cast<float>(rows.values[k]);
  }
  return values;
}

/// Bilinear among the known ones, where they are half the weight and more; NaN elsewhere.
double terrain_at(const Grid<float>& terrain, const Vector2d& at) {
  // Pixels reach half a sample beyond the outermost centres.
  if (!(at.x() >= -0.5 && at.y() >= -0.5 && at.x() <= terrain.width - 0.5 &&
        at.y() <= terrain.height - 0.5))
    return std::numeric_limits<double>::quiet_NaN();
  const int i = static_cast<int>(std::floor(at.x()));
  const int j = static_cast<int>(std::floor(at.y()));
  double sum = 0.0;
  double known = 0.0;
  for (const int dj : {0, 1})
    for (const int di : {0, 1}) {
      const auto sample = static_cast<double>(terrain.clamped(i + di, j + dj));
      if (std::isnan(sample)) continue;
      const double weight =
          (di == 0 ? 1.0 - (at.x() - i) : at.x() - i) * (dj == 0 ? 1.0 - (at.y() - j) : at.y() - j);
      sum += weight * sample;
      known += weight;
    }
  return known < 0.5 ? std::numeric_limits<double>::quiet_NaN() : sum / known;
}

/// Where the middles of a surface's cells lie among the terrain's, every kNode cells.
Grid<Vector2d> nodes_of(const Part& surface, const Part& terrain) {
  Grid<Vector2d> nodes((surface.window.width - 1) / kNode + 2,
                       (surface.window.height - 1) / kNode + 2, Vector2d::Zero());
  for (int j = 0; j < nodes.height; ++j)
    for (int i = 0; i < nodes.width; ++i)
      nodes(i, j) = {surface.window.first_column + i * kNode, surface.window.first_row + j * kNode};
  std::vector<geo::Geodetic> places(nodes.values.size());
  surface.raster->grid().geodetic_from_samples(nodes.values, places);
  terrain.raster->grid().samples_from_geodetic(places, nodes.values);
  const Vector2d first(terrain.window.first_column, terrain.window.first_row);
  for (Vector2d& node : nodes.values) node -= first;
  return nodes;
}

void subtract(const Part& surface, const Part& terrain, Grid<float>& heights_m) {
  const Grid<float> ground = read_all(terrain);
  const Grid<Vector2d> nodes = nodes_of(surface, terrain);
  std::int64_t num_known = 0;
  std::int64_t num_below = 0;
  for (int j = 0; j < heights_m.height; ++j)
    for (int i = 0; i < heights_m.width; ++i) {
      const Vector2d node = Vector2d(i, j) / kNode;
      float& height = heights_m(i, j);
      height =
          static_cast<float>(static_cast<double>(height) - terrain_at(ground, [&]() -> Vector2d {
                               const int u = i / kNode;
                               const int v = j / kNode;
                               const double s = node.x() - u;
                               const double t = node.y() - v;
                               return (1.0 - t) * ((1.0 - s) * nodes(u, v) + s * nodes(u + 1, v)) +
                                      t * ((1.0 - s) * nodes(u, v + 1) + s * nodes(u + 1, v + 1));
                             }()));
      if (std::isnan(height)) continue;
      ++num_known;
      num_below += static_cast<double>(height) < -kBelow_m ? 1 : 0;
    }
  if (2 * num_below > num_known)
    fail(ErrorKind::Input,
         "{}: {} of its {} cells lie more than {:g} m below the terrain of {}; are they on one "
         "datum? if they are heights above the ground already, state heights in place of surface "
         "and terrain",
         surface.raster->path(), num_below, num_known, kBelow_m, terrain.raster->path());
}

void check_heights(const HeightCells& cells) {
  std::int64_t num_known = 0;
  for (int j = 0; j < cells.heights_m.height; ++j)
    for (int i = 0; i < cells.heights_m.width; ++i) {
      const auto height_m = static_cast<double>(cells.heights_m(i, j));
      num_known += std::isnan(height_m) ? 0 : 1;
      if (height_m > kTallest_m)
        fail(ErrorKind::Input,
             "{}: pixel ({}, {}) stands {:.6g} m above the ground, and no building does (at most "
             "{:g} m); if its "
             "heights are above the sea, state it as surface beside its terrain; if the value "
             "marks voids, state heights_nodata",
             cells.raster->path(), cells.first_cell.x() + i, cells.first_cell.y() + j, height_m,
             kTallest_m);
    }
  if (num_known == 0)
    fail(ErrorKind::Input,
         "{}: none of the {} cells that may lie in the world's square has a height; is its no-data "
         "value the right one (heights_nodata)?",
         cells.raster->path(), cells.heights_m.values.size());
}

}  // namespace

HeightCells read_height_cells(const core::Path& surface, const core::Path& terrain,
                              const std::string& nodata, const WorldSurface& world, double size_m) {
  HeightCells cells;
  const auto take = [&] {
    Part high = open_part(surface, nodata, world, size_m);
    cells.heights_m = read_all(high);
    cells.content_hash = high.raster->content_hash();
    cells.ledger = high.raster->ledger();
    if (!terrain.empty()) {
      const Part low = open_part(terrain, nodata, world, size_m);
      subtract(high, low, cells.heights_m);
      cells.content_hash =
          core::content_hash(cells.content_hash + " " + low.raster->content_hash());
      cells.ledger.merge(low.raster->ledger());
    }
    cells.first_cell = {high.window.first_column, high.window.first_row};
    cells.cell = high.raster->grid().size_of_samples(world.frame(), 0.5 * size_m);
    cells.raster = std::move(high.raster);
    check_heights(cells);
  };
  core::with_context(take, "reading heights of buildings (no data: heights_nodata)");
  return cells;
}

}  // namespace terracast::tiler
