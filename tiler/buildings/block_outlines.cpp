#include "tiler/buildings/block_outlines.h"

#include <gdal_alg.h>
#include <gdal_priv.h>
#include <ogrsf_frmts.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <unordered_map>

#include "core/error.h"
#include "tiler/buildings/straight_path.h"
#include "tiler/gdal_formats.h"
#include "tiler/gdal_support.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;
using Eigen::Vector2i;

/// Corners of cells, each a side from the one before.
using CellPath = std::vector<Vector2i>;

[[noreturn]] void fail_polygonizing(const GdalErrors& errors) {
  core::fail(core::ErrorKind::Internal, "GDAL cannot make outlines of cells ({})", errors.text());
}

/// The corners of a ring's cells one by one, of which GDAL leaves out those along straight sides.
CellPath path_of(const OGRLinearRing& ring) {
  CellPath path;
  for (int k = 0; k + 1 < ring.getNumPoints(); ++k) {
    const Vector2i from(static_cast<int>(std::lround(ring.getX(k))),
                        static_cast<int>(std::lround(ring.getY(k))));
    const Vector2i to(static_cast<int>(std::lround(ring.getX(k + 1))),
                      static_cast<int>(std::lround(ring.getY(k + 1))));
    const Vector2i step = (to - from).cwiseSign();
    TERRACAST_CHECK(from != to && (step.x() == 0 || step.y() == 0), "a side from {} {} to {} {}",
                    from.x(), from.y(), to.x(), to.y());
    for (Vector2i at = from; at != to; at += step) path.push_back(at);
  }
  return path;
}

/// The rings round cells of one number that share sides, number by number.
void for_each_area(
    const Grid<std::int32_t>& cells,
    const std::function<void(std::int32_t number, std::vector<CellPath> rings)>& take) {
  register_gdal();
  const GdalErrors errors;
  GDALDriver* raster_driver = GetGDALDriverManager()->GetDriverByName("MEM");
  GDALDriver* vector_driver = GetGDALDriverManager()->GetDriverByName("Memory");
  if (raster_driver == nullptr || vector_driver == nullptr) fail_polygonizing(errors);
  const GdalDatasetPtr raster(
      raster_driver->Create("", cells.width, cells.height, 1, GDT_Int32, nullptr));
  const GdalDatasetPtr vectors(vector_driver->Create("", 0, 0, 0, GDT_Unknown, nullptr));
  OGRLayer* layer = vectors ? vectors->CreateLayer("areas", nullptr, wkbPolygon, nullptr) : nullptr;
  OGRFieldDefn field("number", OFTInteger);
  if (!raster || layer == nullptr || layer->CreateField(&field) != OGRERR_NONE)
    fail_polygonizing(errors);
  GDALRasterBand* band = raster->GetRasterBand(1);
  // GDAL writes from what it is given, and does not change it.
  auto* values = const_cast<std::int32_t*>(cells.values.data());
  if (band->RasterIO(GF_Write, 0, 0, cells.width, cells.height, values, cells.width, cells.height,
                     GDT_Int32, 0, 0, nullptr) != CE_None ||
      GDALPolygonize(GDALRasterBand::ToHandle(band), GDALRasterBand::ToHandle(band),
                     OGRLayer::ToHandle(layer), 0, nullptr, nullptr, nullptr) != CE_None)
    fail_polygonizing(errors);
  for (const auto& feature : *layer) {
    const OGRGeometry* geometry = feature->GetGeometryRef();
    if (geometry == nullptr || wkbFlatten(geometry->getGeometryType()) != wkbPolygon) continue;
    std::vector<CellPath> rings;
    for (const OGRLinearRing* ring : *geometry->toPolygon()) rings.push_back(path_of(*ring));
    take(feature->GetFieldAsInteger(0), std::move(rings));
  }
}

/// The stretches of a ring from each of its ends to the next one, with both; none where nothing of
/// it is an end.
template <class IsEnd>
std::vector<CellPath> cut_at(const CellPath& ring, const IsEnd& is_end) {
  std::vector<CellPath> stretches;
  const auto first = std::find_if(ring.begin(), ring.end(), is_end);
  if (first == ring.end()) return stretches;
  CellPath whole(first, ring.end());
  whole.insert(whole.end(), ring.begin(), first);
  whole.push_back(*first);
  for (auto from = whole.begin(); from + 1 != whole.end();) {
    const auto to = std::find_if(from + 1, whole.end(), is_end);
    stretches.emplace_back(from, to + 1);
    from = to;
  }
  return stretches;
}

class Outlines {
 public:
  Outlines(const Grid<std::int32_t>& piece, double farthest) : piece_(piece), farthest_(farthest) {}

  std::vector<CellRings> draw(std::int32_t num_pieces) {
    Grid<std::int32_t> is_built(piece_.width, piece_.height);
    for (std::size_t k = 0; k < piece_.values.size(); ++k)
      is_built.values[k] = piece_.values[k] == 0 ? 0 : 1;
    for_each_area(is_built, [&](std::int32_t, const std::vector<CellPath>& rings) {
      for (const CellPath& ring : rings) draw_round_block(ring);
    });
    std::vector<std::vector<CellPath>> paths(static_cast<std::size_t>(num_pieces));
    for_each_area(piece_, [&](std::int32_t number, std::vector<CellPath> rings) {
      TERRACAST_CHECK(number >= 1 && number <= num_pieces, "piece {} of {}", number, num_pieces);
      paths[static_cast<std::size_t>(number - 1)] = std::move(rings);
    });
    std::vector<CellRings> outlines(paths.size());
    for (std::size_t k = 0; k < paths.size(); ++k)
      for (const CellPath& path : paths[k]) {
        draw_between_pieces(path);
        outlines[k].emplace_back();
        for (const Vector2i& corner : path)
          if (const std::optional<Vector2d>& at = corners_.at(key_of(corner)))
            outlines[k].back().push_back(*at);
      }
    return outlines;
  }

 private:
  std::uint64_t key_of(const Vector2i& corner) const {
    return static_cast<std::uint64_t>(corner.y()) * static_cast<std::uint64_t>(piece_.width + 1) +
           static_cast<std::uint64_t>(corner.x());
  }
  std::int32_t piece_at(int i, int j) const { return piece_.contains(i, j) ? piece_(i, j) : 0; }
  /// The cells round a corner, clockwise.
  std::array<std::int32_t, 4> round(const Vector2i& at) const {
    return {piece_at(at.x() - 1, at.y() - 1), piece_at(at.x(), at.y() - 1),
            piece_at(at.x(), at.y()), piece_at(at.x() - 1, at.y())};
  }
  /// Walls that meet at a corner.
  int num_walls(const Vector2i& at) const {
    const std::array<std::int32_t, 4> cells = round(at);
    int num = 0;
    for (std::size_t k = 0; k < 4; ++k) num += cells[k] != cells[(k + 1) % 4] ? 1 : 0;
    return num;
  }
  /// Of these, the ones round blocks.
  int num_outer_walls(const Vector2i& at) const {
    const std::array<std::int32_t, 4> cells = round(at);
    int num = 0;
    for (std::size_t k = 0; k < 4; ++k) num += (cells[k] == 0) != (cells[(k + 1) % 4] == 0) ? 1 : 0;
    return num;
  }

  /// Two blocks may touch at a corner, which both then keep.
  bool is_crossing(const Vector2i& at) const { return num_outer_walls(at) == 4; }

  void draw_round_block(const CellPath& ring) {
    const std::vector<CellPath> walls =
        cut_at(ring, [&](const Vector2i& at) { return is_crossing(at); });
    if (walls.empty()) draw(ring, true);
    for (const CellPath& wall : walls) draw(wall, false);
  }

  /// Walls between pieces end where three and more meet, and at what is drawn round blocks.
  void draw_between_pieces(const CellPath& ring) {
    const std::vector<CellPath> walls = cut_at(
        ring, [&](const Vector2i& at) { return num_walls(at) > 2 || num_outer_walls(at) > 0; });
    if (walls.empty() && !corners_.contains(key_of(ring.front()))) draw(ring, true);
    // Those of a single side have no corner between; of others the first says whether they are
    // drawn.
    for (const CellPath& wall : walls)
      if (wall.size() == 2 || !corners_.contains(key_of(wall[1]))) draw(wall, false);
  }

  /// Says of each corner of a path where it stands, or that it is none. Ends that are drawn already
  /// stay.
  void draw(const CellPath& path, bool is_ring) {
    std::vector<std::optional<Vector2d>> corners = straightened(path, is_ring, farthest_);
    put_ends_of_others(path, is_ring, corners);
    for (std::size_t k = 0; k < path.size(); ++k) corners_.try_emplace(key_of(path[k]), corners[k]);
  }

  /// Where walls between pieces end on a path, its wall has a corner, on the straight line that it
  /// runs.
  void put_ends_of_others(const CellPath& path, bool is_ring,
                          std::vector<std::optional<Vector2d>>& corners) const {
    const std::vector<std::optional<Vector2d>> drawn = corners;
    const std::size_t num = path.size();
    std::vector<std::size_t> kept;
    for (std::size_t k = 0; k < num; ++k)
      if (drawn[k]) kept.push_back(k);
    if (kept.size() < 2) return;
    const auto put = [&](std::size_t from, std::size_t to) {
      const Vector2d a = *drawn[from % num];
      const Vector2d b = *drawn[to % num];
      const double squared = (b - a).squaredNorm();
      double last = 0.0;
      for (std::size_t k = from + 1; k < to; ++k) {
        const Vector2i& at = path[k % num];
        if (num_walls(at) <= 2) continue;
        // One after the other, as they follow along the cells.
        if (squared > 0.0)
          last = std::clamp((at.cast<double>() - a).dot(b - a) / squared, last, 1.0);
        corners[k % num] = Vector2d(a + last * (b - a));
      }
    };
    for (std::size_t k = 0; k + 1 < kept.size(); ++k) put(kept[k], kept[k + 1]);
    if (is_ring) put(kept.back(), kept.front() + num);
  }

  const Grid<std::int32_t>& piece_;
  double farthest_;
  std::unordered_map<std::uint64_t, std::optional<Vector2d>> corners_;
};

}  // namespace

std::vector<CellRings> outlines_of(const Grid<std::int32_t>& piece, std::int32_t num_pieces,
                                   double farthest) {
  return Outlines(piece, farthest).draw(num_pieces);
}

}  // namespace terracast::tiler
