#include "job/cover_origin.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "job/raster_cells.h"

namespace terracast::job {
namespace {

using world::Cover;
using world::CoverRasterInfo;

/// Whether a layer of a kind ever says a cover: as Layer::cover() of the kinds has it.
bool may_say(const world::LayerInfo& layer, Cover cover) {
  const bool is_derived = layer.source == "derived";
  switch (cover) {
    case Cover::Land:
    case Cover::Sea:
    case Cover::Outside:
    case Cover::Seabed:
      return false;
    case Cover::River:
      return layer.kind == "water";
    case Cover::Lake:
      return layer.kind == "water" || (layer.kind == "land_cover" && !is_derived);
    case Cover::Grass:
      return layer.kind == "land_cover" || layer.kind == "buildings" || layer.kind == "roads";
    case Cover::Shrubs:
      return layer.kind == "land_cover" || layer.kind == "buildings";
    case Cover::BuiltUp:
      return layer.kind == "buildings" || (layer.kind == "land_cover" && !is_derived);
    default:
      return layer.kind == "land_cover";
  }
}

/// Derived cover says nothing only beside the sea (DerivedCover::cover()).
bool speaks_everywhere(const world::LayerInfo& layer, const world::WorldManifest& manifest) {
  if (layer.kind != "land_cover" || layer.source != "derived" || manifest.outside == "sea")
    return false;
  return std::none_of(manifest.sources.begin(), manifest.sources.end(),
                      [](const world::SourceInfo& source) { return source.kind == "sea"; });
}

/// Whether a raster said a cover of a place.
enum class Said { No, Maybe, Yes };

Said said_by(const CoverRasterInfo& info, Cover cover, const geo::Geodetic& place) {
  const auto pixel = pixel_from_geodetic(info.raster, place.lat_deg, place.lon_deg);
  if (!pixel || info.covers.empty()) return Said::No;
  // Pixels' numbers are those of their centres; borders are bent by so much, and ties may go either way.
  const double reach = info.border_px + 1e-6;
  const Eigen::Array2d sample = pixel->array() - 0.5;
  // What lies outside is silent, however far: one row and column of it stand for all.
  const auto in_covers = [&](const Eigen::Array2d& at) -> Eigen::Array2d {
    const Eigen::Array2d size(info.covers.width(), info.covers.height());
    return (at.round() - Eigen::Array2d(info.first_column, info.first_row)).max(-1.0).min(size);
  };
  const Eigen::Array2d first = in_covers(sample - reach);
  const Eigen::Array2d last = in_covers(sample + reach);
  bool speaks_everywhere = true;
  bool says_it = false;
  bool says_other = false;
  for (double row = first.y(); row <= last.y(); ++row)
    for (double column = first.x(); column <= last.x(); ++column) {
      const bool is_in =
          column >= 0.0 && row >= 0.0 && column < info.covers.width() && row < info.covers.height();
      const std::uint8_t said = is_in ? info.covers(static_cast<int>(column), static_cast<int>(row))
                                      : CoverRasterInfo::kSilent;
      speaks_everywhere = speaks_everywhere && said != CoverRasterInfo::kSilent;
      says_it = says_it || said == static_cast<std::uint8_t>(cover);
      says_other = says_other ||
                   (said != CoverRasterInfo::kSilent && said != static_cast<std::uint8_t>(cover));
    }
  if (!says_it) return Said::No;
  // Of water the first layer that knows it is believed, whatever others say; of the rest, the first that speaks.
  const bool is_sure =
      world::is_water(cover) ? speaks_everywhere && !says_other : speaks_everywhere;
  return is_sure ? Said::Yes : Said::Maybe;
}

}  // namespace

std::vector<CoverOrigin> origins_of_cover(const world::TileStore& store,
                                          std::optional<world::WorldRasters>& rasters, Cover cover,
                                          const geo::Geodetic& place) {
  std::vector<CoverOrigin> origins;
  const auto& layers = store.manifest().layers;
  for (std::size_t layer = 0; layer < layers.size(); ++layer) {
    if (!may_say(layers[layer], cover)) continue;
    if (!rasters || rasters->land_cover[layer].empty()) {
      origins.push_back({.layer = layer, .raster = {}});
      if (speaks_everywhere(layers[layer], store.manifest())) break;
      continue;
    }
    std::vector<std::size_t> speakers;
    bool is_sure = false;
    for (std::size_t i = 0; i < rasters->land_cover[layer].size() && !is_sure; ++i) {
      world::read_covers(store, layer, i, *rasters);
      const Said said = said_by(rasters->land_cover[layer][i], cover, place);
      rasters->land_cover[layer][i].covers = {};
      if (said != Said::No) speakers.push_back(i);
      is_sure = said == Said::Yes;
    }
    if (speakers.empty()) continue;
    origins.push_back(
        {.layer = layer,
         .raster = speakers.size() == 1 ? std::optional(speakers.front()) : std::nullopt});
    if (is_sure) break;
  }
  return origins;
}

}  // namespace terracast::job
