#include "tiler/imagery/color_raster.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "core/error.h"
#include "core/hash.h"
#include "core/srgb.h"
#include "tiler/grid.h"
#include "tiler/raster_ledger.h"
#include "tiler/surface.h"
#include "tiler/world_options.h"

namespace terracast::tiler {
namespace {

using core::ErrorKind;
using core::fail;
using world::ImageryTileId;
using world::kImageryTile_px;

/// Raised when the same inputs give other colours.
constexpr int kVersion = 1;
/// Pixels may be so much wider than samples, rather than half as wide: little is lost, and three
/// quarters of the pixels are saved.
constexpr double kWidestPixel = 1.1;
/// A raster's range and mean are taken from so many samples a side.
constexpr int kProbes = 256;
constexpr double kLowestPlausible = 0.08;
constexpr double kHighestPlausible = 0.22;
/// No window under a tile is wider: a raster whose samples are so much denser one way is none of
/// pictures.
constexpr int kMaxWindow = 16 * kImageryTile_px;

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

float light_of_srgb(double encoded) {
  return static_cast<float>(encoded <= 0.04045 ? encoded / 12.92
                                               : std::pow((encoded + 0.055) / 1.055, 2.4));
}

float luminance_of(const Eigen::Array3f& light) {
  return 0.2126f * light[0] + 0.7152f * light[1] + 0.0722f * light[2];
}

/// Colour at sample coordinates of a window; nothing where the nearest sample is missing.
std::optional<Eigen::Array3f> interpolated(const std::vector<Eigen::Array4f>& samples,
                                           const SampleWindow& window, const Eigen::Vector2d& at) {
  const auto sample = [&](int x, int y) -> const Eigen::Array4f* {
    if (x < 0 || y < 0 || x >= window.width || y >= window.height) return nullptr;
    const Eigen::Array4f& one =
        samples[static_cast<std::size_t>(y) * static_cast<std::size_t>(window.width) +
                static_cast<std::size_t>(x)];
    return one[3] > 0.0f ? &one : nullptr;
  };
  if (sample(static_cast<int>(std::floor(at.x() + 0.5)),
             static_cast<int>(std::floor(at.y() + 0.5))) == nullptr)
    return std::nullopt;
  const int x0 = static_cast<int>(std::floor(at.x()));
  const int y0 = static_cast<int>(std::floor(at.y()));
  const double tx = at.x() - x0;
  const double ty = at.y() - y0;
  double wx[4], wy[4];
  catmull_rom_weights(tx, wx);
  catmull_rom_weights(ty, wy);
  Eigen::Array4f sum = Eigen::Array4f::Zero();
  bool is_whole = true;
  for (int j = 0; j < 4 && is_whole; ++j)
    for (int i = 0; i < 4; ++i) {
      const Eigen::Array4f* one = sample(x0 - 1 + i, y0 - 1 + j);
      if (one == nullptr) {
        is_whole = false;
        break;
      }
      sum += static_cast<float>(wx[i] * wy[j]) * *one;
    }
  if (!is_whole) {
    sum = Eigen::Array4f::Zero();
    for (int j = 0; j < 2; ++j)
      for (int i = 0; i < 2; ++i)
        if (const Eigen::Array4f* one = sample(x0 + i, y0 + j))
          sum += static_cast<float>((i == 0 ? 1.0 - tx : tx) * (j == 0 ? 1.0 - ty : ty)) * *one;
    sum /= sum[3];  // the nearest sample is there, with a weight of a quarter or more
  }
  return Eigen::Array3f(sum.head<3>().max(0.0f).min(1.0f));
}

}  // namespace

double plausible_gain(double mean_albedo) {
  if (!(mean_albedo > 0.0)) return 1.0;
  return std::clamp(std::clamp(mean_albedo, kLowestPlausible, kHighestPlausible) / mean_albedo, 0.2,
                    5.0);
}

/// A dataset for one thread at a time.
class ColorRaster::Lease {
 public:
  explicit Lease(const ColorRaster& raster) : raster_(raster) {
    {
      const std::lock_guard lock(raster.mutex_);
      if (!raster.idle_.empty()) {
        dataset_ = std::move(raster.idle_.back());
        raster.idle_.pop_back();
      }
    }
    if (!dataset_) dataset_ = raster.open();
  }
  ~Lease() {
    const std::lock_guard lock(raster_.mutex_);
    raster_.idle_.push_back(std::move(dataset_));
  }
  Lease(const Lease&) = delete;
  Lease& operator=(const Lease&) = delete;
  GDALDataset& dataset() const { return *dataset_; }

 private:
  const ColorRaster& raster_;
  GdalDatasetPtr dataset_;
};

GdalDatasetPtr ColorRaster::open() const {
  const GdalErrors errors;
  return open_gdal_raster(file_, errors);
}

ColorRaster::ColorRaster(const core::Path& file, const ColorOptions& options,
                         const LayerInputs& inputs)
    : file_(file),
      options_(options),
      name_(std::filesystem::path(file.written).filename().string()),
      half_size_m_(0.5 * inputs.size_m) {
  const GdalErrors errors;
  GdalDatasetPtr dataset = open_gdal_raster(file, errors);
  choose_bands(*dataset);
  grid_ = std::make_unique<RasterGrid>(*dataset, file.written, inputs.frame.origin(), errors);
  if (!grid_->warning().empty()) inputs.context.log.warn("{}", grid_->warning());
  spacing_m_ = grid_->size_of_samples(inputs.frame, half_size_m_).spacing_m;
  level_ = static_cast<int>(std::floor(std::log2(spacing_m_ * kWidestPixel)));
  std::string content =
      fmt::format("{} {} {} {} {} {} {} {} {} {} {}", kVersion, grid_->description(),
                  fmt::join(options.bands, ","), options.nodata, options.black, options.white,
                  options.percentile, options.transfer, options.gain, options.saturation,
                  inputs.surface.input_hash());
  content += content_hash_of(*dataset, file);
  hash_ = core::content_hash(content);
  ledger_ = ledger_of(*dataset, {.what = "colours",
                                 .band = bands_.front(),
                                 .uses_unit = false,
                                 .uses_scale = false,
                                 .uses_nodata = no_data_.takes_declared(),
                                 .uses_mask = uses_mask_,
                                 .uses_colours = true});
  if (errors.has_failure()) said_ = errors.text();

  const Eigen::AlignedBox2d box = grid_->box_of_square(inputs.frame, half_size_m_);
  box_ = box.intersection(Eigen::AlignedBox2d(
      Eigen::Vector2d(-0.5, -0.5), Eigen::Vector2d(grid_->width() - 0.5, grid_->height() - 0.5)));
  if (box_.isEmpty()) return;
  cells_ = std::make_unique<GeodesyCells>(inputs.frame, SampleProjection(*grid_, spacing_m_),
                                          nullptr, half_size_m_, inputs.surface.lowest_m(),
                                          inputs.surface.highest_m());
  choose_range(*dataset);
  set_codes();
  idle_.push_back(std::move(dataset));
  choose_gain();
}

void ColorRaster::choose_bands(GDALDataset& dataset) {
  const int count = dataset.GetRasterCount();
  for (const std::int64_t band : options_.bands) {
    if (band < 1 || band > count)
      fail(ErrorKind::Input, "{}: has {} bands, and bands names {}", file_.written, count, band);
    bands_.push_back(static_cast<int>(band));
  }
  const auto band_of = [&](GDALColorInterp color) {
    for (int band = 1; band <= count; ++band)
      if (dataset.GetRasterBand(band)->GetColorInterpretation() == color) return band;
    return 0;
  };
  if (bands_.empty()) {
    const int red = band_of(GCI_RedBand), green = band_of(GCI_GreenBand),
              blue = band_of(GCI_BlueBand);
    const bool has_alpha = band_of(GCI_AlphaBand) != 0;
    if (red != 0 && green != 0 && blue != 0)
      bands_ = {red, green, blue};
    else if (count - (has_alpha ? 1 : 0) >= 3)
      bands_ = {1, 2, 3};
    else if (count >= 1)
      bands_ = {1};
    else
      fail(ErrorKind::Input, "{}: has no bands", file_.written);
  }
  GDALRasterBand& first = *dataset.GetRasterBand(bands_[0]);
  is_bytes_ = true;
  for (const int band : bands_) {
    const GDALDataType type = dataset.GetRasterBand(band)->GetRasterDataType();
    if (GDALDataTypeIsComplex(type) != FALSE)
      fail(ErrorKind::Input, "{}: its samples are complex numbers ({}), not colours", file_.written,
           GDALGetDataTypeName(type));
    is_bytes_ = is_bytes_ && type == GDT_Byte;
  }
  if (bands_.size() == 1 && is_bytes_ && first.GetColorTable() != nullptr) {
    const GDALColorTable& table = *first.GetColorTable();
    palette_.resize(256, {0, 0, 0, 0});
    for (int i = 0; i < std::min(table.GetColorEntryCount(), 256); ++i) {
      GDALColorEntry entry;
      if (table.GetColorEntryAsRGB(i, &entry) == FALSE) continue;
      palette_[static_cast<std::size_t>(i)] = {
          static_cast<std::uint8_t>(entry.c1), static_cast<std::uint8_t>(entry.c2),
          static_cast<std::uint8_t>(entry.c3), static_cast<std::uint8_t>(entry.c4)};
    }
  }
  no_data_ = NoData::of(options_.nodata);
  no_data_.take_declared(first);
  uses_mask_ = no_data_.takes_masks() && (first.GetMaskFlags() & (GMF_ALL_VALID | GMF_NODATA)) == 0;
  is_srgb_ = options_.transfer == "srgb" || (options_.transfer == "auto" && is_bytes_);
}

float ColorRaster::light_of(float sample) const {
  const double share = std::clamp(
      (static_cast<double>(sample) - options_.black) / (options_.white - options_.black), 0.0, 1.0);
  return is_srgb_ ? light_of_srgb(share) : static_cast<float>(share);
}

void ColorRaster::set_codes() {
  for (std::size_t code = 0; code < 256; ++code)
    light_of_byte_[code] = light_of(static_cast<float>(code));
}

ColorRaster::Window ColorRaster::read(GDALDataset& dataset, const SampleWindow& at, int width,
                                      int height) const {
  const GdalErrors errors;
  const auto count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  std::vector<float> raw(count * bands_.size());
  std::vector<int> bands = bands_;
  const auto fail_unread = [&] {
    fail(ErrorKind::Input, "{}: its samples cannot be read; is it truncated? ({})", file_.written,
         errors.has_failure() || said_.empty() ? errors.text() : said_);
  };
  const auto line = static_cast<GSpacing>(width);
  const std::vector<WindowPart> parts = grid_->parts_of(at, width);
  for (const WindowPart& part : parts)
    if (dataset.RasterIO(GF_Read, part.in_file.first_column, part.in_file.first_row,
                         part.in_file.width, part.in_file.height, raw.data() + part.first_column,
                         part.width, height, GDT_Float32, static_cast<int>(bands.size()),
                         bands.data(), sizeof(float), line * static_cast<GSpacing>(sizeof(float)),
                         static_cast<GSpacing>(count * sizeof(float)), nullptr) != CE_None)
      fail_unread();
  std::vector<std::uint8_t> mask;
  if (uses_mask_) {
    mask.resize(count);
    GDALRasterBand& mask_band = *dataset.GetRasterBand(bands_[0])->GetMaskBand();
    for (const WindowPart& part : parts)
      if (mask_band.RasterIO(GF_Read, part.in_file.first_column, part.in_file.first_row,
                             part.in_file.width, part.in_file.height,
                             mask.data() + part.first_column, part.width, height, GDT_Byte, 1, line,
                             nullptr) != CE_None)
        fail_unread();
  }
  Window window{at, std::vector<Eigen::Array4f>(count, Eigen::Array4f::Zero())};
  const bool is_raw = options_.white == options_.black;  // its range is being looked for
  for (std::size_t k = 0; k < count; ++k) {
    if (uses_mask_ && mask[k] == 0) continue;
    bool is_number = true;
    bool is_nodata = true;
    Eigen::Array4f& out = window.samples[k];
    std::array<float, 3> light = {};
    for (std::size_t band = 0; band < bands_.size(); ++band) {
      const float value = raw[band * count + k];
      is_number = is_number && std::isfinite(value);
      is_nodata = is_nodata && no_data_.holds(static_cast<double>(value), GDT_Float32);
      if (!std::isfinite(value)) continue;
      light[band] = is_raw      ? value
                    : is_bytes_ ? light_of_byte_[static_cast<std::size_t>(value)]
                                : light_of(value);
    }
    if (!is_number || is_nodata) continue;
    if (!palette_.empty()) {
      const auto& color = palette_[static_cast<std::size_t>(raw[k])];
      if (color[3] == 0) continue;
      for (std::size_t c = 0; c < 3; ++c) light[c] = light_of_byte_[color[c]];
    } else if (bands_.size() == 1) {
      light = {light[0], light[0], light[0]};
    }
    out = {light[0], light[1], light[2], 1.0f};
  }
  return window;
}

void ColorRaster::choose_range(GDALDataset& dataset) {
  if (options_.black != options_.white) return;
  if (is_bytes_) {
    options_.black = 0.0;
    options_.white = 255.0;
    return;
  }
  const SampleWindow whole{0, 0, grid_->width(), grid_->height()};
  const Window probes =
      read(dataset, whole, std::min(whole.width, kProbes), std::min(whole.height, kProbes));
  std::vector<float> values;
  for (const Eigen::Array4f& one : probes.samples)
    if (one[3] > 0.0f) values.insert(values.end(), {one[0], one[1], one[2]});
  if (values.empty())
    fail(ErrorKind::Input, "{}: holds no samples with data; state black and white", file_.written);
  std::sort(values.begin(), values.end());
  const auto of_share = [&](double share) {
    return static_cast<double>(
        values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))]);
  };
  options_.black = of_share(options_.percentile / 100.0);
  options_.white = of_share(1.0 - options_.percentile / 100.0);
  // Light is proportional to the samples of a linear raster: nothing but 0 is black.
  if (!is_srgb_) options_.black = std::min(options_.black, 0.0);
  if (options_.white <= options_.black) options_.white = options_.black + 1.0;
}

void ColorRaster::choose_gain() {
  gain_ = options_.gain;
  if (gain_ > 0.0) return;
  const Lease lease(*this);
  const Eigen::Array2d low = (box_.min().array() + 0.5).floor().max(0.0);
  const Eigen::Array2d high = (box_.max().array() + 0.5)
                                  .ceil()
                                  .max(low + 1.0)
                                  .min(Eigen::Array2d(grid_->width(), grid_->height()));
  const SampleWindow window{static_cast<int>(low.x()), static_cast<int>(low.y()),
                            static_cast<int>(high.x() - low.x()),
                            static_cast<int>(high.y() - low.y())};
  gain_ = 1.0;
  if (window.is_empty()) return;
  const Window probes = read(lease.dataset(), window, std::min(window.width, kProbes),
                             std::min(window.height, kProbes));
  double sum = 0.0;
  std::int64_t num_samples = 0;
  for (const Eigen::Array4f& one : probes.samples) {
    if (one[3] == 0.0f) continue;
    sum += static_cast<double>(luminance_of(one.head<3>()));
    ++num_samples;
  }
  if (num_samples > 0) gain_ = plausible_gain(sum / static_cast<double>(num_samples));
}

Eigen::Array3f ColorRaster::shown(const Eigen::Array3f& light) const {
  const auto saturation = static_cast<float>(options_.saturation);
  const float grey = luminance_of(light);
  return static_cast<float>(gain_) * (grey + saturation * (light - grey));
}

bool ColorRaster::fill(const ImageryTileId& id, std::span<const double> z_world,
                       core::Image8& image) const {
  if (!touches_square()) return false;
  constexpr int kPixelsPerNode = kImageryTile_px / kNodes;
  const Eigen::Vector2d corner = id.corner_world();
  const double pixel_m = id.pixel_m();
  std::vector<Eigen::Vector2d> at(image.num_pixels());
  std::vector<std::uint8_t> is_wanted(image.num_pixels(), 0);
  Eigen::AlignedBox2d needed;
  for (int y = 0; y < kImageryTile_px; ++y) {
    const int row = kImageryTile_px - 1 - y;  // from the south
    const double y_world = corner.y() + (row + 0.5) * pixel_m;
    if (std::abs(y_world) > half_size_m_) continue;
    GeodesyCells::Row places(*cells_, y_world);
    const int node_y = row / kPixelsPerNode;
    const double ty = (row % kPixelsPerNode + 0.5) / kPixelsPerNode;
    const auto z_along = [&](int node_x) {
      const double* z = &z_world[static_cast<std::size_t>(node_y * (kNodes + 1) + node_x)];
      return z[0] + ty * (z[kNodes + 1] - z[0]);
    };
    for (int x = 0; x < kImageryTile_px; ++x) {
      const double x_world = corner.x() + (x + 0.5) * pixel_m;
      if (std::abs(x_world) > half_size_m_ || image(x, y, 3) != 0) continue;
      const int node_x = x / kPixelsPerNode;
      const double tx = (x % kPixelsPerNode + 0.5) / kPixelsPerNode;
      const double z = z_along(node_x) + tx * (z_along(node_x + 1) - z_along(node_x));
      const GeodesyColumn column = places.column(x_world);
      // The height is all but linear in z: a step leaves millimetres.
      double height_m =
          z + (x_world * x_world + y_world * y_world) / (2.0 * geo::kWgs84SemiMajorAxis_m);
      height_m += z - column.at(height_m).z_world;
      const Eigen::Vector2d sample = column.at(height_m).map;
      if (!box_.contains(sample)) continue;
      const std::size_t pixel =
          static_cast<std::size_t>(y) * kImageryTile_px + static_cast<std::size_t>(x);
      at[pixel] = sample;
      is_wanted[pixel] = 1;
      needed.extend(sample);
    }
  }
  if (needed.isEmpty()) return false;
  const Eigen::Array2d low = (needed.min().array().floor() - 1.0).max(0.0);
  const Eigen::Array2d high = (needed.max().array().floor() + 2.0)
                                  .min(Eigen::Array2d(grid_->width(), grid_->height()) - 1.0);
  const Eigen::Array2d size = high - low + 1.0;
  if (size.maxCoeff() > kMaxWindow)
    fail(ErrorKind::Input,
         "{}: a tile of imagery takes {} x {} of its samples, which are much denser one way than "
         "the "
         "other; warp it to square pixels",
         file_.written, size.x(), size.y());
  const SampleWindow window{static_cast<int>(low.x()), static_cast<int>(low.y()),
                            static_cast<int>(size.x()), static_cast<int>(size.y())};
  const Window read_window = [&] {
    const Lease lease(*this);
    return read(lease.dataset(), window, window.width, window.height);
  }();
  const Eigen::Vector2d first(window.first_column, window.first_row);
  bool has_filled = false;
  for (int y = 0; y < kImageryTile_px; ++y)
    for (int x = 0; x < kImageryTile_px; ++x) {
      const std::size_t pixel =
          static_cast<std::size_t>(y) * kImageryTile_px + static_cast<std::size_t>(x);
      if (is_wanted[pixel] == 0) continue;
      const auto light = interpolated(read_window.samples, window, at[pixel] - first);
      if (!light) continue;
      const Eigen::Array3f albedo = shown(*light);
      for (int k = 0; k < 3; ++k) image(x, y, k) = core::srgb8_from_linear(albedo[k]);
      image(x, y, 3) = 255;
      has_filled = true;
    }
  return has_filled;
}

}  // namespace terracast::tiler
