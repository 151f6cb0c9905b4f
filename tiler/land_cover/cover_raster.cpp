#include "tiler/land_cover/cover_raster.h"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/hash.h"
#include "core/parallel.h"
#include "tiler/raster_ledger.h"
#include "tiler/surface.h"
#include "tiler/world_options.h"

namespace terracast::tiler {
namespace {

using core::ErrorKind;
using core::fail;

/// Raised when the same inputs give other covers.
constexpr int kVersion = 1;

/// Samples that are read at once, unless a block of the file holds more.
constexpr int kSamplesOfStrip = 4'000'000;

/// Of the bends of borders: the first octave's period in samples, and where halving it ends.
constexpr double kBendPeriod_samples = 3.0;
constexpr double kFinestBend_m = 4.0;

/// So many heights tell whether a body of water is level.
constexpr std::int64_t kHeightsOfBody = 1000;
/// Lakes follow the geoid, and hardly anywhere leans it more against the ellipsoid. So many heights tell
/// how it leans.
constexpr double kGeoidLean = 1e-4;
constexpr std::size_t kHeightsOfPlane = 200;

/// A raster's samples as a projection.
class SampleProjection final : public MapProjection {
 public:
  SampleProjection(const RasterGrid& grid, double spacing_m) : grid_(grid), spacing_m_(spacing_m) {}
  void map_from_geodetic(std::span<const geo::Geodetic> places,
                         std::span<Eigen::Vector2d> map) const override {
    grid_.samples_from_geodetic(places, map);
  }
  double metres_per_map_unit() const override { return spacing_m_; }

 private:
  const RasterGrid& grid_;
  double spacing_m_;
};

void check_band(GDALDataset& dataset, const std::string& written) {
  const int count = dataset.GetRasterCount();
  const bool has_alpha =
      count == 2 && dataset.GetRasterBand(2)->GetColorInterpretation() == GCI_AlphaBand;
  if (count != 1 && !has_alpha)
    fail(ErrorKind::Input,
         "{}: has {} bands, and a raster of land cover has one, of class codes; a picture of a map "
         "does not do",
         written, count);
  const GDALDataType type = dataset.GetRasterBand(1)->GetRasterDataType();
  if (GDALDataTypeIsComplex(type) != FALSE)
    fail(ErrorKind::Input, "{}: its samples are complex numbers ({}), not codes", written,
         GDALGetDataTypeName(type));
}

auto order_of(const SampleRun& run) { return std::pair(run.row, run.first_column); }

bool is_water(std::uint8_t land_class) {
  return land_class == static_cast<std::uint8_t>(LandClass::Lake);
}

}  // namespace

CoverRaster::CoverRaster(const core::Path& file, const Legend& legend,
                         const CoverRasterOptions& options, const LayerInputs& inputs)
    : options_(options),
      half_size_m_(inputs.size_m / 2.0),
      aside_x_(inputs.seed, 1),
      aside_y_(inputs.seed, 2) {
  const GdalErrors errors;
  dataset_ = open_gdal_raster(file, errors);
  check_band(*dataset_, file.written);
  grid_ = std::make_unique<RasterGrid>(*dataset_, file.written, inputs.frame.origin(), errors);
  if (!grid_->warning().empty()) inputs.context.log.warn("{}", grid_->warning());
  no_data_ = NoData::of(options.nodata);
  no_data_.take_declared(*dataset_->GetRasterBand(1));
  spacing_m_ = grid_->size_of_samples(inputs.frame, half_size_m_).spacing_m;
  num_bends_ = std::max(
      static_cast<int>(std::ceil(std::log2(kBendPeriod_samples * spacing_m_ / kFinestBend_m))), 1);
  std::string content = fmt::format("{} {} {} {} {} {} {} {}", kVersion, grid_->description(),
                                    options.nodata, no_data_.text(), options.border_px,
                                    options.lake_flat_m, inputs.seed, inputs.surface.input_hash());
  for (const auto& [code, land_class] : legend.classes)
    content += fmt::format(" {}={}", code, static_cast<int>(land_class));
  content += content_hash_of(*dataset_, file);
  hash_ = core::content_hash(content);
  ledger_ = ledger_of(*dataset_, {.what = "codes",
                                  .uses_unit = false,
                                  .uses_scale = false,
                                  .uses_nodata = no_data_.takes_declared(),
                                  .uses_mask = no_data_.takes_masks()});

  choose_window(inputs);
  if (!touches_square()) return;
  read(legend, errors);
  dataset_.reset();
  cells_ = std::make_unique<GeodesyCells>(inputs.frame, SampleProjection(*grid_, spacing_m_),
                                          nullptr, half_size_m_, inputs.surface.lowest_m(),
                                          inputs.surface.highest_m());
  find_lakes(inputs);
}

void CoverRaster::choose_window(const LayerInputs& inputs) {
  const Eigen::AlignedBox2d box = grid_->box_of_square(inputs.frame, half_size_m_);
  // Places stray, and sides are longer than the spacing in one direction.
  const double margin = std::ceil(options_.border_px) + 2.0;
  const Eigen::Array2d last = Eigen::Array2d(grid_->width(), grid_->height()) - 1.0;
  if ((box.max().array() < -0.5).any() || (box.min().array() > last + 0.5).any()) return;
  const Eigen::Array2d low = (box.min().array().floor() - margin).max(0.0);
  const Eigen::Array2d high = (box.max().array().ceil() + margin).min(last);
  const Eigen::Array2d size = high - low + 1.0;
  // Refused here, before anything is tiled: what the world would keep of it could not be read again.
  if (!(size.prod() <= static_cast<double>(world::kMaxCoverPixels)))
    fail(
        ErrorKind::Input,
        "{}: the world's square of {} m takes {:.0f} of its samples, and a world keeps up to {} of "
        "a raster of land cover; give a coarser raster, or make the square smaller",
        grid_->written(), 2.0 * half_size_m_, size.prod(), world::kMaxCoverPixels);
  window_ = {.first_column = static_cast<int>(low.x()),
             .first_row = static_cast<int>(low.y()),
             .width = static_cast<int>(size.x()),
             .height = static_cast<int>(size.y())};
}

void CoverRaster::read(const Legend& legend, const GdalErrors& errors) {
  classes_ = Grid<std::uint8_t>(window_.width, window_.height);
  GDALRasterBand& band = *dataset_->GetRasterBand(1);
  const bool has_alpha = dataset_->GetRasterCount() == 2;
  const bool uses_mask = no_data_.takes_masks() &&
                         (has_alpha || (band.GetMaskFlags() & (GMF_ALL_VALID | GMF_NODATA)) == 0);
  GDALRasterBand& mask_band = has_alpha ? *dataset_->GetRasterBand(2) : *band.GetMaskBand();
  int block_width = 0;
  int block_height = 1;
  band.GetBlockSize(&block_width, &block_height);
  // Whole rows of blocks, so that none is unpacked twice.
  int rows = std::max(kSamplesOfStrip / window_.width, 1);
  if (rows > block_height) rows -= rows % block_height;
  std::vector<double> codes;
  std::vector<std::uint8_t> mask;
  for (int first = 0; first < window_.height;) {
    const int top = window_.first_row + first;
    const int to_block_end = block_height - top % block_height;
    const int most =
        rows >= block_height ? rows - top % block_height : std::min(rows, to_block_end);
    const SampleWindow strip{.first_column = window_.first_column,
                             .first_row = top,
                             .width = window_.width,
                             .height = std::min(most, window_.height - first)};
    const auto fetch = [&](GDALRasterBand& from, auto& samples) {
      samples.resize(static_cast<std::size_t>(strip.num_samples()));
      if (!read_window(from, *grid_, strip, samples))
        fail(ErrorKind::Input, "{}: its samples cannot be read; is it truncated? ({})",
             grid_->written(), errors.text());
    };
    fetch(band, codes);
    if (uses_mask) fetch(mask_band, mask);
    decode(legend, codes, mask, strip);
    first += strip.height;
  }
  counts_.num_samples = window_.num_samples();
}

void CoverRaster::decode(const Legend& legend, const std::vector<double>& codes,
                         const std::vector<std::uint8_t>& mask, const SampleWindow& strip) {
  const auto is_nodata = [&](std::size_t k) {
    return (!mask.empty() && mask[k] == 0) || no_data_.holds(codes[k], GDT_Float64);
  };
  const std::size_t start = classes_.index(0, strip.first_row - window_.first_row);
  double last_code = std::numeric_limits<double>::quiet_NaN();
  LandClass last_class = LandClass::Unknown;
  for (std::size_t k = 0; k < codes.size(); ++k) {
    if (is_nodata(k)) {
      ++counts_.num_nodata;
      continue;  // classes_ holds Unknown
    }
    if (codes[k] != last_code) {
      const bool is_code =
          codes[k] >= 0.0 && codes[k] <= 65535.0 && codes[k] == std::floor(codes[k]);
      const auto found =
          is_code ? legend.classes.find(static_cast<int>(codes[k])) : legend.classes.end();
      if (found == legend.classes.end()) {
        const int column = strip.first_column + static_cast<int>(k) % strip.width;
        const int row = strip.first_row + static_cast<int>(k) / strip.width;
        std::vector<int> known;
        for (const auto& [code, land_class] : legend.classes) known.push_back(code);
        fail(ErrorKind::Input,
             "{}: pixel ({}, {}) holds {:g}, which the legend {} does not know (it knows {}); {}",
             grid_->written(), column, row, codes[k], legend.name, fmt::join(known, ", "),
             is_code ? fmt::format("say what it stands for: classes = [\"{0:g} = forest\"], or "
                                   "\"{0:g} = unknown\" to ask the next source there",
                                   codes[k])
                     : std::string("is it a raster of class codes? If it marks where nothing is "
                                   "known, state it as nodata"));
      }
      last_code = codes[k];
      last_class = found->second;
    }
    if (last_class == LandClass::Unknown) ++counts_.num_unknown;
    if (last_class == LandClass::OtherWater) ++counts_.num_water_samples_left;
    classes_.values[start + k] = static_cast<std::uint8_t>(last_class);
  }
}

std::vector<CoverRaster::SampleHeight> CoverRaster::heights_of(const std::vector<SampleRun>& body,
                                                               const LayerInputs& inputs) const {
  std::int64_t num_samples = 0;
  for (const SampleRun& run : body) num_samples += run.num_columns;
  const std::int64_t step = std::max<std::int64_t>(num_samples / kHeightsOfBody, 1);
  std::vector<SampleHeight> heights;
  std::int64_t next = 0;  // among the body's samples
  std::int64_t first = 0;
  for (const SampleRun& run : body) {
    for (; next < first + run.num_columns; next += step) {
      const Eigen::Vector2d at(run.first_column + static_cast<double>(next - first), run.row);
      const Eigen::Vector2d sample = at + Eigen::Vector2d(window_.first_column, window_.first_row);
      geo::Geodetic place;
      grid_->geodetic_from_samples({&sample, 1}, {&place, 1});
      if (const auto height_m = inputs.surface.measured_height_m(place.lat_deg, place.lon_deg))
        heights.push_back({at, *height_m});
    }
    first += run.num_columns;
  }
  return heights;
}

std::optional<Eigen::Vector3d> CoverRaster::level_of(std::vector<SampleHeight> heights) const {
  if (heights.empty()) return std::nullopt;
  Eigen::AlignedBox2d box;
  for (const SampleHeight& height : heights) box.extend(height.sample);
  std::sort(heights.begin(), heights.end(),
            [](const SampleHeight& a, const SampleHeight& b) { return a.height_m < b.height_m; });
  const auto of_share = [&](double share) {
    return heights[static_cast<std::size_t>(
                       std::lround(share * static_cast<double>(heights.size() - 1)))]
        .height_m;
  };
  const double lean_m = kGeoidLean * box.diagonal().norm() * spacing_m_;
  if (of_share(0.9) - of_share(0.1) > options_.lake_flat_m + lean_m) return std::nullopt;
  const Eigen::Vector3d level(of_share(0.5), 0.0, 0.0);
  if (heights.size() < kHeightsOfPlane) return level;
  Eigen::MatrixX3d places(heights.size(), 3);
  Eigen::VectorXd values(heights.size());
  for (std::size_t k = 0; k < heights.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    places.row(row) << 1.0, heights[k].sample.x(), heights[k].sample.y();
    values[row] = heights[k].height_m;
  }
  const Eigen::Vector3d plane = places.colPivHouseholderQr().solve(values);
  return plane.tail<2>().norm() <= kGeoidLean * spacing_m_ ? plane : level;
}

void CoverRaster::find_lakes(const LayerInputs& inputs) {
  const auto bodies = find_bodies(classes_, is_water);
  std::vector<std::optional<Eigen::Vector3d>> levels(bodies.size());
  core::parallel_for(static_cast<std::int64_t>(bodies.size()), [&](std::int64_t index) {
    const auto b = static_cast<std::size_t>(index);
    levels[b] = level_of(heights_of(bodies[b], inputs));
  });
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    if (levels[b]) ++counts_.num_lakes;
    for (const SampleRun& run : bodies[b]) {
      if (levels[b]) {
        counts_.num_lake_samples += run.num_columns;
        lakes_.push_back({run, *levels[b]});
        continue;
      }
      counts_.num_water_samples_left += run.num_columns;
      for (int i = 0; i < run.num_columns; ++i)
        classes_(run.first_column + i, run.row) = static_cast<std::uint8_t>(LandClass::OtherWater);
    }
  }
  std::sort(lakes_.begin(), lakes_.end(),
            [](const LakeRun& a, const LakeRun& b) { return order_of(a.run) < order_of(b.run); });
}

double CoverRaster::lake_level_m(const Eigen::Vector2i& sample) const {
  const auto after =
      std::upper_bound(lakes_.begin(), lakes_.end(), std::pair(sample.y(), sample.x()),
                       [](const auto& at, const LakeRun& lake) { return at < order_of(lake.run); });
  TERRACAST_CHECK(after != lakes_.begin(), "sample ({}, {}) is no lake", sample.x(), sample.y());
  const Eigen::Vector3d& level = std::prev(after)->level;
  return level[0] + level[1] * sample.x() + level[2] * sample.y();
}

Eigen::Vector2d CoverRaster::aside_m(const Eigen::Vector2d& place_world) const {
  const Eigen::Vector2d at = place_world / (kBendPeriod_samples * spacing_m_);
  Eigen::Vector2d aside(fractal_noise(aside_x_, at.x(), at.y(), num_bends_, 0.55),
                        fractal_noise(aside_y_, at.x(), at.y(), num_bends_, 0.55));
  aside *= 1.5;  // the noise is seldom near its bounds
  return options_.border_px * spacing_m_ * aside / std::max(aside.norm(), 1.0);
}

world::CoverRasterInfo CoverRaster::info(const std::string& name) const {
  world::CoverRasterInfo info;
  info.raster = grid_->info(name);
  info.border_px = options_.border_px;
  info.first_column = window_.first_column;
  info.first_row = window_.first_row;
  info.num_columns = classes_.width;
  info.num_rows = classes_.height;
  return info;
}

void CoverRaster::tell_row(int row, std::span<std::uint8_t> covers) const {
  TERRACAST_CHECK(std::cmp_equal(covers.size(), classes_.width), "{}", covers.size());
  for (int i = 0; i < classes_.width; ++i) {
    const auto land_class = static_cast<LandClass>(classes_(i, row));
    const auto cover =
        land_class == LandClass::Lake ? std::optional(world::Cover::Lake) : cover_of(land_class);
    covers[static_cast<std::size_t>(i)] =
        cover ? static_cast<std::uint8_t>(*cover) : world::CoverRasterInfo::kSilent;
  }
}

std::optional<CoverRaster::Found> CoverRaster::find(const Eigen::Vector2d& place_world,
                                                    double z_world) const {
  if (!touches_square()) return std::nullopt;
  const Eigen::Vector2d place =
      (place_world + aside_m(place_world)).cwiseMax(-half_size_m_).cwiseMin(half_size_m_);
  const GeodesyColumn column = cells_->column(place.x(), place.y());
  // The height is all but linear in z: a step leaves millimetres.
  double height_m = z_world + place.squaredNorm() / (2.0 * geo::kWgs84SemiMajorAxis_m);
  height_m += z_world - column.at(height_m).z_world;
  const Eigen::Vector2d map = column.at(height_m).map;
  const Eigen::Vector2i sample(static_cast<int>(std::lround(map.x())) - window_.first_column,
                               static_cast<int>(std::lround(map.y())) - window_.first_row);
  if (!classes_.contains(sample.x(), sample.y())) return std::nullopt;
  const auto land_class = static_cast<LandClass>(classes_(sample.x(), sample.y()));
  if (land_class == LandClass::Lake) return Found{world::Cover::Lake, lake_level_m(sample)};
  const auto cover = cover_of(land_class);
  return cover ? std::optional(Found{*cover, std::nullopt}) : std::nullopt;
}

}  // namespace terracast::tiler
