#include "tiler/buildings/height_raster.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/error.h"
#include "core/hash.h"
#include "tiler/earth_heights.h"
#include "tiler/grid.h"
#include "tiler/raster_source.h"
#include "world/tile.h"

namespace terracast::tiler {
namespace {

/// Sample coordinates are computed at nodes so far apart, and are straight between them within a
/// hundredth of a metre.
constexpr double kNode_m = 256.0;
/// Rows that are read at a time.
constexpr int kRows = 512;
/// So many places of a footprint are asked for at most, along its box's longer side.
constexpr int kMostPlaces = 40;
/// Samples at edges are half ground, half roof.
constexpr double kInside_m = 1.0;

/// What a raster holds of the world's square.
class Patch {
 public:
  Patch(const core::Path& file, const std::string& nodata, const WorldSurface& surface,
        double size_m)
      : half_size_m_(0.5 * size_m) {
    ElevationOptions options;
    options.nodata = nodata;
    const WorldOptions& world = surface.options();
    const auto take = [&] {
      const std::unique_ptr<RasterSource> raster = RasterSource::open(
          file, options, {.lat_deg = world.origin_lat_deg, .lon_deg = world.origin_lon_deg});
      content_hash_ = raster->content_hash();
      ledger_ = raster->ledger();
      place_nodes(*raster, surface);
      read(*raster, nodata);
    };
    core::with_context(take, "reading heights of buildings (no data: heights_nodata)");
  }

  std::optional<double> value(const Eigen::Vector2d& place_world) const {
    const Eigen::Vector2d node = (place_world + Eigen::Vector2d::Constant(half_size_m_)) / kNode_m;
    const Eigen::Vector2d at = bilinear_place(node) - first_sample_;
    // Pixels reach half a sample beyond the outermost centres.
    if (!(at.x() >= -0.5 && at.y() >= -0.5 && at.x() < values_.width - 0.5 &&
          at.y() < values_.height - 0.5))
      return std::nullopt;
    const int i = static_cast<int>(std::floor(at.x()));
    const int j = static_cast<int>(std::floor(at.y()));
    double sum = 0.0;
    double known = 0.0;
    for (int dj = 0; dj < 2; ++dj)
      for (int di = 0; di < 2; ++di) {
        const auto sample = static_cast<double>(values_.clamped(i + di, j + dj));
        const double weight = (di == 0 ? 1.0 - (at.x() - i) : at.x() - i) *
                              (dj == 0 ? 1.0 - (at.y() - j) : at.y() - j);
        if (std::isnan(sample)) continue;
        sum += weight * sample;
        known += weight;
      }
    if (known < 0.5) return std::nullopt;
    return sum / known;
  }

  const std::string& content_hash() const { return content_hash_; }
  const core::Ledger& ledger() const { return ledger_; }

 private:
  void place_nodes(const RasterSource& raster, const WorldSurface& surface) {
    const int side = static_cast<int>(std::ceil(2.0 * half_size_m_ / kNode_m)) + 1;
    nodes_ = Grid<Eigen::Vector2d>(side, side, Eigen::Vector2d::Zero());
    std::vector<geo::Geodetic> places;
    for (int j = 0; j < side; ++j)
      for (int i = 0; i < side; ++i) {
        const Eigen::Vector2d at(i * kNode_m - half_size_m_, j * kNode_m - half_size_m_);
        const Eigen::Vector2d inside = at.cwiseMax(-half_size_m_).cwiseMin(half_size_m_);
        places.push_back(surface.frame().geodetic_from_world(
            {at.x(), at.y(), surface.sample(inside.x(), inside.y()).z_world}));
      }
    raster.grid().samples_from_geodetic(places, nodes_.values);
  }

  Eigen::Vector2d bilinear_place(const Eigen::Vector2d& node) const {
    const int i = std::clamp(static_cast<int>(std::floor(node.x())), 0, nodes_.width - 2);
    const int j = std::clamp(static_cast<int>(std::floor(node.y())), 0, nodes_.height - 2);
    const double tx = node.x() - i;
    const double ty = node.y() - j;
    const Eigen::Vector2d south = nodes_(i, j) + tx * (nodes_(i + 1, j) - nodes_(i, j));
    const Eigen::Vector2d north = nodes_(i, j + 1) + tx * (nodes_(i + 1, j + 1) - nodes_(i, j + 1));
    return south + ty * (north - south);
  }

  void read(const RasterSource& raster, const std::string& nodata) {
    Eigen::Vector2d lowest = nodes_.values.front();
    Eigen::Vector2d highest = nodes_.values.front();
    for (const Eigen::Vector2d& node : nodes_.values) {
      lowest = lowest.cwiseMin(node);
      highest = highest.cwiseMax(node);
    }
    const auto clamped = [](double value, int size) {
      return static_cast<int>(std::clamp(value, 0.0, static_cast<double>(size)));
    };
    SampleWindow window;
    window.first_column = clamped(std::floor(lowest.x()) - 1.0, raster.grid().width());
    window.first_row = clamped(std::floor(lowest.y()) - 1.0, raster.grid().height());
    window.width =
        clamped(std::ceil(highest.x()) + 2.0, raster.grid().width()) - window.first_column;
    window.height =
        clamped(std::ceil(highest.y()) + 2.0, raster.grid().height()) - window.first_row;
    if (window.is_empty())
      core::fail(core::ErrorKind::Input,
                 "{}: lies beside the world's square ({} m wide); state a raster of building "
                 "heights that reaches into it; if it should, is {} the right CRS of its "
                 "coordinates? (gdal_edit.py -a_srs states another)",
                 raster.path(), 2.0 * half_size_m_, raster.grid().crs_name());
    first_sample_ = {window.first_column, window.first_row};
    values_ = Grid<float>(window.width, window.height);
    for (int row = 0; row < window.height; row += kRows) {
      const int num_rows = std::min(kRows, window.height - row);
      const Grid<double> rows = raster.read({.first_column = window.first_column,
                                             .first_row = window.first_row + row,
                                             .width = window.width,
                                             .height = num_rows});
      refuse_undeclared_fills(raster, rows, nodata, "heights_nodata");
      for (int j = 0; j < num_rows; ++j)
        for (int i = 0; i < window.width; ++i) values_(i, row + j) = static_cast<float>(rows(i, j));
    }
  }

  double half_size_m_;
  std::string content_hash_;
  core::Ledger ledger_;
  Grid<Eigen::Vector2d> nodes_;  ///< sample coordinates of the raster
  Eigen::Vector2d first_sample_ = Eigen::Vector2d::Zero();
  Grid<float> values_;
};

class PatchHeights final : public HeightRaster {
 public:
  PatchHeights(const core::Path& surface, const core::Path& terrain, const std::string& nodata,
               const WorldSurface& world, double size_m)
      : surface_(surface, nodata, world, size_m) {
    content_hash_ = surface_.content_hash();
    ledger_ = surface_.ledger();
    if (terrain.empty()) return;
    terrain_.emplace(terrain, nodata, world, size_m);
    content_hash_ = core::content_hash(content_hash_ + " " + terrain_->content_hash());
    ledger_.merge(terrain_->ledger());
  }

  std::optional<double> height_m(const Eigen::Vector2d& place_world) const override {
    const std::optional<double> high = surface_.value(place_world);
    if (!high || !terrain_) return high;
    const std::optional<double> ground = terrain_->value(place_world);
    if (!ground) return std::nullopt;
    return *high - *ground;
  }
  const std::string& content_hash() const override { return content_hash_; }
  const core::Ledger& ledger() const override { return ledger_; }

 private:
  Patch surface_;
  std::optional<Patch> terrain_;
  std::string content_hash_;
  core::Ledger ledger_;
};

}  // namespace

std::optional<double> HeightRaster::median_m(const Footprint& footprint) const {
  Eigen::Vector2d lowest = footprint.rings[0][0].cast<double>();
  Eigen::Vector2d highest = lowest;
  for (const Eigen::Vector2i& corner : footprint.rings[0]) {
    lowest = lowest.cwiseMin(corner.cast<double>());
    highest = highest.cwiseMax(corner.cast<double>());
  }
  // Every half a metre, but no more places than a median needs.
  const double step =
      std::max(0.5 / world::kHeightStep_m, (highest - lowest).maxCoeff() / kMostPlaces);
  std::vector<double> inside;
  std::vector<double> all;
  std::size_t num_places = 0;
  for (double y = lowest.y() + 0.5 * step; y < highest.y(); y += step)
    for (double x = lowest.x() + 0.5 * step; x < highest.x(); x += step) {
      const Eigen::Vector2d at(x, y);
      if (!contains(footprint.rings, at)) continue;
      ++num_places;
      const std::optional<double> height =
          height_m(footprint.place_m.cast<double>() + world::kHeightStep_m * at);
      if (!height) continue;
      all.push_back(*height);
      if (distance_to_edges(footprint.rings, at) >= kInside_m / world::kHeightStep_m)
        inside.push_back(*height);
    }
  if (all.empty() || 2 * all.size() < num_places) return std::nullopt;
  std::vector<double>& heights = inside.size() >= 8 ? inside : all;
  const auto middle = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 2);
  std::nth_element(heights.begin(), middle, heights.end());
  return *middle;
}

std::unique_ptr<HeightRaster> HeightRaster::open(const core::Path& surface,
                                                 const core::Path& terrain,
                                                 const std::string& nodata,
                                                 const WorldSurface& world, double size_m) {
  return std::make_unique<PatchHeights>(surface, terrain, nodata, world, size_m);
}

}  // namespace terracast::tiler
