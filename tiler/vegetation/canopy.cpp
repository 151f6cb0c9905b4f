#include "tiler/vegetation/canopy.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "core/error.h"
#include "tiler/grid.h"
#include "tiler/raster_source.h"

namespace terracast::tiler {
namespace {

/// Taller than any tree: the raster holds something else.
constexpr double kTallest_m = 130.0;
/// Lidar puts some returns below the ground.
constexpr double kLowest_m = -5.0;
/// Sample coordinates are computed at nodes so far apart, and are straight between them within a
/// hundredth of a metre.
constexpr double kNode_m = 256.0;
/// Rows that are read at a time.
constexpr int kRows = 512;

class RasterCanopy final : public Canopy {
 public:
  RasterCanopy(const core::Path& file, const std::string& nodata, const WorldSurface& surface,
               double size_m)
      : half_size_m_(0.5 * size_m) {
    ElevationOptions options;
    options.nodata = nodata;
    const WorldOptions& world = surface.options();
    const std::unique_ptr<RasterSource> raster = RasterSource::open(
        file, options, {.lat_deg = world.origin_lat_deg, .lon_deg = world.origin_lon_deg});
    content_hash_ = raster->content_hash();
    ledger_ = raster->ledger();
    place_nodes(*raster, surface);
    read(*raster);
  }

  std::optional<double> height_m(const Eigen::Vector2d& place_world) const override {
    const Eigen::Vector2d node = (place_world + Eigen::Vector2d::Constant(half_size_m_)) / kNode_m;
    const Eigen::Vector2d at = bilinear_place(node) - first_sample_;
    // Pixels reach half a sample beyond the outermost centres.
    if (!(at.x() >= -0.5 && at.y() >= -0.5 && at.x() < heights_m_.width - 0.5 &&
          at.y() < heights_m_.height - 0.5))
      return std::nullopt;
    const double x = std::floor(at.x());
    const double y = std::floor(at.y());
    const int i = static_cast<int>(x);
    const int j = static_cast<int>(y);
    const double tx = at.x() - x;
    const double ty = at.y() - y;
    double sum = 0.0;
    double known = 0.0;
    for (int dj = 0; dj < 2; ++dj)
      for (int di = 0; di < 2; ++di) {
        const auto value = static_cast<double>(heights_m_.clamped(i + di, j + dj));
        const double weight = (di == 0 ? 1.0 - tx : tx) * (dj == 0 ? 1.0 - ty : ty);
        if (std::isnan(value)) continue;
        sum += weight * value;
        known += weight;
      }
    if (known < 0.5) return std::nullopt;
    return sum / known;
  }

  const std::string& content_hash() const override { return content_hash_; }
  const core::Ledger& ledger() const override { return ledger_; }
  std::int64_t num_samples() const override { return num_samples_; }
  std::int64_t num_voids() const override { return num_voids_; }
  std::int64_t num_wooded() const override { return num_wooded_; }

 private:
  void place_nodes(const RasterSource& raster, const WorldSurface& surface) {
    const int side = static_cast<int>(std::ceil(2.0 * half_size_m_ / kNode_m)) + 1;
    nodes_ = Grid<Eigen::Vector2d>(side, side, Eigen::Vector2d::Zero());
    std::vector<geo::Geodetic> places;
    for (int j = 0; j < side; ++j)
      for (int i = 0; i < side; ++i) {
        const double x = i * kNode_m - half_size_m_;
        const double y = j * kNode_m - half_size_m_;
        const double inside_x = std::clamp(x, -half_size_m_, half_size_m_);
        const double inside_y = std::clamp(y, -half_size_m_, half_size_m_);
        places.push_back(surface.frame().geodetic_from_world(
            {x, y, surface.sample(inside_x, inside_y).z_world}));
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

  void read(const RasterSource& raster) {
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
                 "{}: lies beside the world's square ({} m wide); state a raster of canopy heights "
                 "that reaches into it",
                 raster.path(), 2.0 * half_size_m_);
    first_sample_ = {window.first_column, window.first_row};
    heights_m_ = Grid<float>(window.width, window.height);
    for (int row = 0; row < window.height; row += kRows) {
      const int num_rows = std::min(kRows, window.height - row);
      const Grid<double> rows = raster.read({.first_column = window.first_column,
                                             .first_row = window.first_row + row,
                                             .width = window.width,
                                             .height = num_rows});
      for (int j = 0; j < num_rows; ++j)
        for (int i = 0; i < window.width; ++i) take(raster, i, row + j, rows(i, j));
    }
  }

  void take(const RasterSource& raster, int i, int j, double height_m) {
    ++num_samples_;
    if (std::isnan(height_m)) {
      ++num_voids_;
    } else if (!(height_m >= kLowest_m && height_m <= kTallest_m)) {
      core::fail(core::ErrorKind::Input,
                 "{}: pixel ({}, {}) is {:.6g} m above the ground, and trees are 0 to {} m high; a "
                 "canopy raster holds heights of trees above the ground, not of the ground; state "
                 "nodata if it marks voids",
                 raster.path(), i + static_cast<int>(first_sample_.x()),
                 j + static_cast<int>(first_sample_.y()), height_m, kTallest_m);
    } else if (height_m >= kLowestTree_m) {
      ++num_wooded_;
    }
    heights_m_(i, j) = static_cast<float>(height_m);
  }

  double half_size_m_;
  std::string content_hash_;
  core::Ledger ledger_;
  Grid<Eigen::Vector2d> nodes_;  ///< sample coordinates of the raster
  Eigen::Vector2d first_sample_ = Eigen::Vector2d::Zero();
  Grid<float> heights_m_;
  std::int64_t num_samples_ = 0;
  std::int64_t num_voids_ = 0;
  std::int64_t num_wooded_ = 0;
};

}  // namespace

std::unique_ptr<Canopy> Canopy::open(const core::Path& file, const std::string& nodata,
                                     const WorldSurface& surface, double size_m) {
  return std::make_unique<RasterCanopy>(file, nodata, surface, size_m);
}

}  // namespace terracast::tiler
