#include "tiler/dryness.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/error.h"
#include "core/hash.h"
#include "core/random.h"
#include "tiler/raster_source.h"
#include "tiler/void_filling.h"

namespace terracast::tiler {
namespace {

using core::ErrorKind;
using core::fail;

/// Rasters of climate are a kilometre wide and more.
constexpr double kNode_m = 250.0;
constexpr double kMostNodes = 512.0;  ///< along a side of the square
/// Nowhere on Earth rains more than ten times what would evaporate.
constexpr double kHighestIndex = 20.0;

/// All is bare below the first, nothing beyond the second.
constexpr double kAllBare = 0.03, kNoneBare = 0.25;
/// What is not bare is all shrubs below the first, and what grows in humid climates from the second on.
constexpr double kAllShrubs = 0.3, kNoShrubs = 0.65;

/// 0 below the lowest, 1 above the highest.
double ramp(double lowest, double highest, double value) {
  return std::clamp((value - lowest) / (highest - lowest), 0.0, 1.0);
}

/// Sample coordinates of nodes over the world's square.
std::vector<Eigen::Vector2d> samples_of_nodes(const RasterGrid& grid, const geo::WorldFrame& frame,
                                              int side, double spacing_m, double half_size_m) {
  std::vector<geo::Geodetic> places;
  for (int j = 0; j < side; ++j)
    for (int i = 0; i < side; ++i)
      places.push_back(frame.geodetic_from_world(
          {i * spacing_m - half_size_m, j * spacing_m - half_size_m, 0.0}));
  std::vector<Eigen::Vector2d> samples(places.size());
  grid.samples_from_geodetic(places, samples);
  return samples;
}

/// How many columns lead round the Earth and back to the same meridian; 0 where the raster does not go round.
int columns_round_the_earth(const RasterGrid& grid) {
  const world::RasterInfo info = grid.info({});
  const auto& gt = info.geotransform;
  if (!info.is_geographic || gt[2] != 0.0 || gt[4] != 0.0) return 0;
  const double columns = 360.0 / std::abs(gt[1]);
  // Files print their steps with few digits.
  if (columns > grid.width() + 0.1 || std::abs(columns - std::round(columns)) > 0.1) return 0;
  return static_cast<int>(std::lround(columns));
}

/// The part of a raster within a sample of the nodes; columns run on beyond one that goes round the Earth.
SampleWindow window_over(const std::vector<Eigen::Vector2d>& samples, const RasterGrid& grid) {
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& sample : samples) box.extend(sample);
  const Eigen::Array2d size(grid.width(), grid.height());
  Eigen::Array2d low = box.min().array().floor() - 1.0;
  Eigen::Array2d high = box.max().array().ceil() + 2.0;
  const Eigen::Array2d low_within = low.max(0.0).min(size);
  const Eigen::Array2d high_within = high.max(0.0).min(size);
  low.y() = low_within.y();
  high.y() = high_within.y();
  if (columns_round_the_earth(grid) == 0) {
    low.x() = low_within.x();
    high.x() = high_within.x();
  }
  return {.first_column = static_cast<int>(low.x()),
          .first_row = static_cast<int>(low.y()),
          .width = static_cast<int>(high.x() - low.x()),
          .height = static_cast<int>(high.y() - low.y())};
}

/// Reads a window of window_over(), piece by piece where it goes beyond the raster's columns.
Grid<double> read_window(const RasterSource& raster, const SampleWindow& window) {
  if (window.is_empty()) return {};
  if (window.num_samples() > RasterSource::kMostSamples)
    fail(ErrorKind::Input, "{}: the world's square takes {} of its samples, and {} fit into memory",
         raster.path(), window.num_samples(), RasterSource::kMostSamples);
  const int round = columns_round_the_earth(raster.grid());
  if (round == 0) return raster.read(window);
  Grid<double> values(window.width, window.height);
  for (int done = 0; done < window.width;) {
    SampleWindow piece = window;
    piece.first_column = ((window.first_column + done) % round + round) % round;
    piece.width = std::min(window.width - done, round - piece.first_column);
    const Grid<double> read = raster.read(piece);
    for (int j = 0; j < piece.height; ++j)
      for (int i = 0; i < piece.width; ++i) values(done + i, j) = read(i, j);
    done += piece.width;
  }
  return values;
}

/// Bilinear of the samples that have a value; NaN where the nearest has none.
double value_at(const Grid<double>& values, const Eigen::Vector2d& at) {
  const int i = static_cast<int>(std::floor(at.x()));
  const int j = static_cast<int>(std::floor(at.y()));
  const int nearest_i = static_cast<int>(std::lround(at.x()));
  const int nearest_j = static_cast<int>(std::lround(at.y()));
  if (!values.contains(nearest_i, nearest_j)) return std::nan("");
  if (std::isnan(values(nearest_i, nearest_j))) return std::nan("");
  double sum = 0.0;
  double known = 0.0;
  for (int dj = 0; dj < 2; ++dj)
    for (int di = 0; di < 2; ++di) {
      if (!values.contains(i + di, j + dj) || std::isnan(values(i + di, j + dj))) continue;
      const double weight =
          (1.0 - std::abs(at.x() - (i + di))) * (1.0 - std::abs(at.y() - (j + dj)));
      sum += weight * values(i + di, j + dj);
      known += weight;
    }
  return sum / known;
}

RasterQuantity aridity_index_of(const std::string& path) {
  return {.name = "aridity index",
          .lowest = 0.0,
          .highest = kHighestIndex,
          .advice = fmt::format(
              "it is precipitation over potential evapotranspiration; where the file holds 10000 "
              "times the index, declare it: gdal_edit.py -scale 0.0001 {}",
              path)};
}

}  // namespace

std::shared_ptr<const Dryness> Dryness::of(const WorldOptions& options,
                                           const geo::WorldFrame& frame, const core::Log* log) {
  if (!options.states_aridity()) return nullptr;
  return std::shared_ptr<const Dryness>(new Dryness(options, frame, log));
}

Dryness::Dryness(const WorldOptions& options, const geo::WorldFrame& frame, const core::Log* log)
    : half_size_m_(0.5 * options.size_m),
      patches_(core::stream_of(static_cast<std::uint64_t>(options.seed), 0x61726964ULL), 1, 900.0,
               5),
      index_(options.aridity_index) {
  content_hash_ = core::content_hash(fmt::format("dryness 1 {} {}", index_, options.seed));
  if (!options.aridity_raster.empty())
    core::with_context(
        [&] { read(options, frame, log); },
        fmt::format("reading the aridity index from {}", options.aridity_raster.written));
}

void Dryness::read(const WorldOptions& options, const geo::WorldFrame& frame,
                   const core::Log* log) {
  const auto raster = RasterSource::open_quantity(
      options.aridity_raster, aridity_index_of(options.aridity_raster.written), frame.origin());
  const int num_cells = static_cast<int>(std::ceil(std::min(options.size_m / kNode_m, kMostNodes)));
  node_spacing_m_ = options.size_m / num_cells;
  nodes_ = Grid<double>(num_cells + 1, num_cells + 1);
  const std::vector<Eigen::Vector2d> samples =
      samples_of_nodes(raster->grid(), frame, nodes_.width, node_spacing_m_, half_size_m_);
  const SampleWindow window = window_over(samples, raster->grid());
  const Grid<double> values = read_window(*raster, window);
  Grid<std::uint8_t> is_unknown(nodes_.width, nodes_.height, 0);
  std::size_t num_unknown = 0;
  for (std::size_t k = 0; k < samples.size(); ++k) {
    const Eigen::Vector2d first(window.first_column, window.first_row);
    const double value = value_at(values, samples[k] - first);
    is_unknown.values[k] = std::isnan(value) ? 1 : 0;
    nodes_.values[k] = std::isnan(value) ? 0.0 : value;
    num_unknown += is_unknown.values[k];
  }
  if (num_unknown == samples.size())
    fail(ErrorKind::Input,
         "{}: says nothing of the world's square of {} m about latitude {}, longitude {}; give a "
         "raster that covers it, or state aridity_index",
         raster->path(), options.size_m, options.origin_lat_deg, options.origin_lon_deg);
  if (num_unknown > 0 && log != nullptr)
    log->warn(
        "{}: holds no aridity index in {:.3g} % of the world's square; what lies around fills it",
        raster->path(),
        100.0 * static_cast<double>(num_unknown) / static_cast<double>(samples.size()));
  // Rasters of climate end at coasts.
  fill_from_surroundings(nodes_, is_unknown);
  content_hash_ = core::content_hash(content_hash_ + " " + raster->content_hash());
  ledger_ = raster->ledger();
}

double Dryness::aridity_index(const Eigen::Vector2d& place_world) const {
  if (nodes_.values.empty()) return index_;
  return bilinear(nodes_, (place_world.array() + half_size_m_) / node_spacing_m_);
}

std::optional<world::Cover> Dryness::cover(const Eigen::Vector2d& place_world,
                                           double moisture) const {
  // The mean of the moisture of landscapes is about a half: valleys are wetter than their climate.
  const double index = aridity_index(place_world) * (0.6 + 0.8 * moisture);
  const double bare_share = 1.0 - ramp(kAllBare, kNoneBare, index);
  const double shrub_share = (1.0 - bare_share) * (1.0 - ramp(kAllShrubs, kNoShrubs, index));
  if (bare_share + shrub_share == 0.0) return std::nullopt;
  const double patch = patches_(place_world);
  if (patch < bare_share) return world::Cover::Bare;
  if (patch < bare_share + shrub_share) return world::Cover::Shrubs;
  return std::nullopt;
}

double Dryness::growth(const Eigen::Vector2d& place_world) const {
  return ramp(kAllBare, kNoShrubs, aridity_index(place_world));
}

std::string climate_in_words(const WorldOptions& options, bool has_cover_raster) {
  if (!options.aridity_raster.empty())
    return fmt::format("how dry the land is follows {}", options.aridity_raster.written);
  if (options.states_aridity())
    return fmt::format("how dry the land is follows aridity_index = {:g}", options.aridity_index);
  if (has_cover_raster)
    return "no aridity is stated: where land cover rasters say nothing the land is taken as humid";
  return "neither aridity nor a land cover raster is stated: the land is taken as humid, and what "
         "grows follows latitude, height and slope; dry places need aridity_index or "
         "aridity_raster";
}

}  // namespace terracast::tiler
