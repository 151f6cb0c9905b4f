#include "tiler/mosaic_draft.h"

#include <fmt/format.h>

#include "core/error.h"

namespace terracast::tiler {

using core::ErrorKind;
using core::fail;

std::vector<geo::Geodetic> MosaicDraft::places_of_row(int row) const {
  const int width = mosaic.heights_m.width;
  std::vector<Eigen::Vector2d> samples(static_cast<std::size_t>(width));
  for (int i = 0; i < width; ++i)
    samples[static_cast<std::size_t>(i)] =
        (mosaic.first_sample + Eigen::Vector2i(i, row)).cast<double>();
  std::vector<geo::Geodetic> places(samples.size());
  rasters.front().source->grid().geodetic_from_samples(samples, places);
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
  if (kind != "sea") source.spacing_m = sample.spacing_m;  // its floor has no samples
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
