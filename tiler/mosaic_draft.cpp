#include "tiler/mosaic_draft.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"

namespace terracast::tiler {

using core::ErrorKind;
using core::fail;

MosaicDraft::SampleSize MosaicDraft::size_of_samples(const RasterSource& raster) const {
  std::array<geo::Geodetic, 3> places;
  const double reach_m = std::min(100.0, half_size_m);
  for (std::size_t k = 0; k < 3; ++k)
    places[k] =
        inputs.frame.geodetic_from_world({k == 1 ? reach_m : 0.0, k == 2 ? reach_m : 0.0, 0.0});
  std::array<Eigen::Vector2d, 3> samples;
  raster.samples_from_geodetic(places, samples);
  Eigen::Matrix2d sample_from_m;
  sample_from_m << (samples[1] - samples[0]) / reach_m, (samples[2] - samples[0]) / reach_m;
  // The eigenvalues of J^T J are the squares of samples a metre in the densest and the widest
  // direction.
  const Eigen::Matrix2d square = sample_from_m.transpose() * sample_from_m;
  const double half_trace = 0.5 * square.trace();
  const double densest =
      half_trace + std::sqrt(std::max(half_trace * half_trace - square.determinant(), 0.0));
  return {.spacing_m = 1.0 / std::sqrt(densest),
          .area_m2 = 1.0 / std::abs(sample_from_m.determinant()),
          .sides_m = sample_from_m.inverse().colwise().norm().transpose()};
}

std::vector<geo::Geodetic> MosaicDraft::places_of_row(int row) const {
  const int width = mosaic.heights_m.width;
  std::vector<Eigen::Vector2d> samples(static_cast<std::size_t>(width));
  for (int i = 0; i < width; ++i)
    samples[static_cast<std::size_t>(i)] =
        (mosaic.first_sample + Eigen::Vector2i(i, row)).cast<double>();
  std::vector<geo::Geodetic> places(samples.size());
  rasters.front().source->geodetic_from_samples(samples, places);
  return places;
}

double MosaicDraft::shift_m(const geo::VerticalDatum& from, const geo::Geodetic& place) const {
  if (from == mosaic.datum) return 0.0;
  const auto undulation_m = [&](const geo::VerticalDatum& of) {
    return of.is_ellipsoid() ? 0.0 : of.geoid->undulation_m(place.lat_deg, place.lon_deg);
  };
  return undulation_m(from) - undulation_m(mosaic.datum);
}

std::uint8_t MosaicDraft::source_row(const std::string& kind, const std::string& name) {
  for (std::size_t i = 0; i < mosaic.sources.size(); ++i)
    if (mosaic.sources[i].kind == kind) return static_cast<std::uint8_t>(i);
  world::SourceInfo source;
  source.name = name;
  source.kind = kind;
  source.vertical_datum = mosaic.datum.name;
  source.spacing_m = sample.spacing_m;
  mosaic.sources.push_back(std::move(source));
  return static_cast<std::uint8_t>(mosaic.sources.size() - 1);
}

void MosaicDraft::fail_without_heights() const {
  fail(ErrorKind::Input,
       "{}{}: no height within the world's square of {} m about latitude {}, longitude {}; move "
       "the origin, or give rasters that cover it",
       rasters.front().source->path(), rasters.size() > 1 ? " and the other rasters" : "",
       inputs.options.size_m, inputs.options.origin_lat_deg, inputs.options.origin_lon_deg);
}

}  // namespace terracast::tiler
