#include "tiler/raster_field.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tiler/known_rasters.h"
#include "tiler/shoreline.h"

namespace terracast::tiler {
namespace {

class RasterField : public HeightField, public KnownRasters {
 public:
  explicit RasterField(RasterMosaic mosaic) : mosaic_(std::move(mosaic)) {
    for (const world::SourceInfo& source : mosaic_.sources)
      is_filled_.push_back(source.kind == "void" || source.kind == "extend" ? 1 : 0);
    if (mosaic_.has_sea && !mosaic_.datum.is_ellipsoid())
      shoreline_ = Shoreline(mosaic_.is_sea, mosaic_.is_shelf);
    const auto [lowest, highest] =
        std::minmax_element(mosaic_.heights_m.values.begin(), mosaic_.heights_m.values.end());
    // The spline overshoots its samples by less than an eighth of their range.
    const double beyond_m = 0.125 * (*highest - *lowest);
    lowest_m_ = *lowest - beyond_m;
    highest_m_ = *highest + beyond_m;
  }

  void map_from_geodetic(std::span<const geo::Geodetic> places,
                         std::span<Eigen::Vector2d> map) const override {
    mosaic_.first->grid().samples_from_geodetic(places, map);
    const Eigen::Vector2d first_sample = mosaic_.first_sample.cast<double>();
    for (Eigen::Vector2d& at : map) at -= first_sample;
  }

  double height_m(const Eigen::Vector2d& map) const override {
    return shoreline_.height_m(mosaic_.heights_m, map);
  }

  FieldFacts facts(const Eigen::Vector2d& map) const override {
    FieldFacts facts;
    const int nearest_i = static_cast<int>(std::lround(map.x()));
    const int nearest_j = static_cast<int>(std::lround(map.y()));
    facts.source = mosaic_.source.clamped(nearest_i, nearest_j);
    if (!mosaic_.has_sea) return facts;
    const int i = static_cast<int>(std::floor(map.x()));
    const int j = static_cast<int>(std::floor(map.y()));
    const int num_sea = mosaic_.is_sea.clamped(i, j) + mosaic_.is_sea.clamped(i + 1, j) +
                        mosaic_.is_sea.clamped(i, j + 1) + mosaic_.is_sea.clamped(i + 1, j + 1);
    // Above the geoid, the sea is where the interpolated land comes down to 0; above the ellipsoid,
    // where all samples round the place are sea.
    if (!mosaic_.datum.is_ellipsoid()) {
      if (num_sea > 0) facts.sea_height_m = 0.0;
    } else if (num_sea == 4) {
      facts.sea_height_m = height_m(map);
    }
    if (!facts.sea_height_m) return facts;
    facts.floor_depth_m = bilinear(mosaic_.floor_depth_m, map);
    facts.is_shelf =
        mosaic_.is_shelf.clamped(nearest_i, nearest_j) != 0 && is_filled_[facts.source] == 0;
    return facts;
  }

  bool has_sea() const override { return mosaic_.has_sea; }
  double lowest_m() const override { return lowest_m_; }
  double highest_m() const override { return highest_m_; }
  const geo::VerticalDatum& datum() const override { return mosaic_.datum; }
  double spacing_m() const override { return mosaic_.sources.front().spacing_m; }
  double metres_per_map_unit() const override { return spacing_m(); }
  bool takes_detail() const override { return true; }
  const std::vector<world::SourceInfo>& sources() const override { return mosaic_.sources; }
  std::vector<std::optional<world::RasterInfo>> rasters() const override { return mosaic_.rasters; }
  std::string input_hash() const override { return mosaic_.input_hash; }

 private:
  const RasterMosaic mosaic_;
  Shoreline shoreline_;  ///< none above the ellipsoid, where the sea's surface is not 0
  std::vector<std::uint8_t> is_filled_;  ///< rows of sources; filled sea is theirs, no shelf
  double lowest_m_ = 0.0;
  double highest_m_ = 0.0;
};

}  // namespace

std::unique_ptr<HeightField> make_raster_field(RasterMosaic mosaic) {
  return std::make_unique<RasterField>(std::move(mosaic));
}

}  // namespace terracast::tiler
