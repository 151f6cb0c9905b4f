#include "tiler/mosaic_gaps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "core/error.h"
#include "tiler/mosaic_filling.h"
#include "tiler/void_filling.h"

namespace terracast::tiler {
namespace {

using core::ErrorKind;
using core::fail;

/// A region without heights at the edge of the coverage is a void while it is smaller than this;
/// larger, it is missing coverage.
constexpr double kLargestEdgeVoid_km2 = 4.0;

/// A part of the world's square.
struct Part {
  double area_m2 = 0.0;
  Eigen::AlignedBox2d box_deg;  ///< latitude, longitude
};

/// Parts samples without a height into voids and missing coverage.
Gaps sort_gaps(MosaicDraft& draft) {
  Gaps gaps;
  gaps.is_void = Grid<std::uint8_t>(draft.mosaic.heights_m.width, draft.mosaic.heights_m.height, 0);
  gaps.is_missing = gaps.is_void;
  bool has_height = false;
  for (std::size_t k = 0; k < gaps.is_void.values.size(); ++k) {
    if (draft.mosaic.source.values[k] != kNoSource)
      has_height = true;
    else if (draft.covered_by.values[k] == kNoSource)
      gaps.is_missing.values[k] = 1;
    else
      gaps.is_void.values[k] = 1;
  }
  if (!has_height) draft.fail_without_heights();

  // The collar of a raster that was turned is no void: nothing beyond it could tell how it goes on.
  const Regions regions = find_regions(gaps.is_void);
  std::vector<std::uint8_t> is_at_edge;
  for (const auto& region : regions.regions) is_at_edge.push_back(region.touches_border ? 1 : 0);
  for (int j = 0; j < gaps.is_void.height; ++j)
    for (int i = 0; i < gaps.is_void.width; ++i) {
      if (regions.label(i, j) == 0) continue;
      for (int dj = -1; dj <= 1; ++dj)
        for (int di = -1; di <= 1; ++di)
          if (gaps.is_missing.contains(i + di, j + dj) && gaps.is_missing(i + di, j + dj) != 0)
            is_at_edge[static_cast<std::size_t>(regions.label(i, j) - 1)] = 1;
    }
  double largest_km2 = 0.0;
  std::vector<std::uint8_t> is_filled(regions.regions.size(), 0);
  for (std::size_t k = 0; k < gaps.is_void.values.size(); ++k) {
    if (gaps.is_void.values[k] == 0) continue;
    const auto region = static_cast<std::size_t>(regions.label.values[k] - 1);
    const double area_km2 =
        static_cast<double>(regions.regions[region].num_samples) * draft.sample.area_m2 * 1e-6;
    if (is_at_edge[region] != 0 && area_km2 > kLargestEdgeVoid_km2) {
      gaps.is_void.values[k] = 0;
      gaps.is_missing.values[k] = 1;
      continue;
    }
    largest_km2 = std::max(largest_km2, area_km2);
    is_filled[region] = 1;
    ++draft.mosaic.sources[draft.covered_by.values[k]].num_voids_filled;
  }
  std::int64_t num_filled = 0;
  for (const world::SourceInfo& source : draft.mosaic.sources)
    num_filled += source.num_voids_filled;
  if (num_filled == 0) return gaps;
  draft.inputs.context.log.info(
      "{} voids of {} samples are filled from their surroundings ({:.2f} %), the largest {:.3g} "
      "km2",
      std::count(is_filled.begin(), is_filled.end(), 1), num_filled,
      100.0 * static_cast<double>(num_filled) / static_cast<double>(gaps.is_void.values.size()),
      largest_km2);
  if (largest_km2 > kLargestEdgeVoid_km2)
    draft.inputs.context.log.warn(
        "the largest void has {:.3g} km2: its ground is smooth and not measured; a second raster "
        "could fill it",
        largest_km2);
  return gaps;
}

bool is_in_square(const MosaicDraft& draft, const geo::Geodetic& place) {
  const Eigen::Vector3d at = draft.inputs.frame.world_from_geodetic(place);
  return std::abs(at.x()) <= draft.half_size_m && std::abs(at.y()) <= draft.half_size_m &&
         at.z() > -1e6;
}

/// The square's part that some samples stand for: by the samples in it, or, where they are so wide that
/// none is in it, by places of the square and the samples nearest to them.
Part part_of_square(const MosaicDraft& draft, const Grid<std::uint8_t>& is_member) {
  Part part;
  for (int j = 0; j < is_member.height; ++j) {
    std::vector<geo::Geodetic> places;
    for (int i = 0; i < is_member.width; ++i) {
      if (is_member(i, j) == 0) continue;
      if (places.empty()) places = draft.places_of_row(j);
      const geo::Geodetic& place = places[static_cast<std::size_t>(i)];
      if (!is_in_square(draft, place)) continue;
      part.area_m2 += draft.sample.area_m2;
      part.box_deg.extend(Eigen::Vector2d(place.lat_deg, place.lon_deg));
    }
  }
  if (part.area_m2 > 0.0) return part;

  constexpr int kProbes = 32;
  const double step_m = 2.0 * draft.half_size_m / kProbes;
  std::vector<geo::Geodetic> places;
  for (int j = 0; j < kProbes; ++j)
    for (int i = 0; i < kProbes; ++i)
      places.push_back(draft.inputs.frame.geodetic_from_world(
          {(i + 0.5) * step_m - draft.half_size_m, (j + 0.5) * step_m - draft.half_size_m, 0.0}));
  std::vector<Eigen::Vector2d> samples(places.size());
  draft.rasters.front().source->grid().samples_from_geodetic(places, samples);
  for (std::size_t k = 0; k < places.size(); ++k) {
    const Eigen::Vector2i at =
        samples[k].array().round().matrix().cast<int>() - draft.mosaic.first_sample;
    if ((at.array() < 0).any() || at.x() >= is_member.width || at.y() >= is_member.height ||
        is_member(at.x(), at.y()) == 0)
      continue;
    part.area_m2 += step_m * step_m;
    part.box_deg.extend(Eigen::Vector2d(places[k].lat_deg, places[k].lon_deg));
  }
  return part;
}

/// Refuses, or reports, what no raster covers within the square.
void refuse_missing(const MosaicDraft& draft, const Part& missing) {
  if (missing.area_m2 == 0.0) return;
  const Eigen::AlignedBox2d& area_deg = missing.box_deg;
  const std::string where = fmt::format(
      "{:.4g} km2 of the world's square, between latitude {:.4f} and {:.4f}, longitude {:.4f} and "
      "{:.4f}",
      missing.area_m2 * 1e-6, area_deg.min().x(), area_deg.max().x(), area_deg.min().y(),
      area_deg.max().y());
  if (draft.inputs.options.outside == "error")
    fail(ErrorKind::Input,
         "no raster covers {}; add one that does, make the square smaller, or say what lies there: "
         "outside = \"sea\", \"extend\" or \"procedural\"",
         where);
  draft.inputs.context.log.warn("no raster covers {}: outside = \"{}\" fills it", where,
                                draft.inputs.options.outside);
}

bool has_members(const Grid<std::uint8_t>& is_member) {
  return std::any_of(is_member.values.begin(), is_member.values.end(),
                     [](std::uint8_t member) { return member != 0; });
}

/// Names the source of samples that were filled, and says in the manifest how much that is.
void name_source(MosaicDraft& draft, const Grid<std::uint8_t>& is_filled, const std::string& kind,
                 const std::string& name, const Part& part) {
  const std::uint8_t row = draft.source_row(kind, name);
  if (part.area_m2 > 0.0)
    draft.mosaic.sources[row].accuracy =
        fmt::format("not measured: {:.4g} km2 of the square are filled from their surroundings",
                    part.area_m2 * 1e-6);
  for (std::size_t k = 0; k < is_filled.values.size(); ++k)
    if (is_filled.values[k] != 0) draft.mosaic.source.values[k] = row;
}

}  // namespace

void fill_gaps(MosaicDraft& draft) {
  const Gaps gaps = sort_gaps(draft);
  const bool has_void = has_members(gaps.is_void);
  const bool has_missing = has_members(gaps.is_missing);
  if (!has_void && !has_missing) return;
  Part missing;
  if (has_missing && !draft.part.is_patch) missing = part_of_square(draft, gaps.is_missing);
  refuse_missing(draft, missing);
  fill_heights(draft, gaps);
  if (has_void)
    name_source(draft, gaps.is_void, "void", "filled void", part_of_square(draft, gaps.is_void));
  if (!has_missing) return;
  if (!draft.part.is_patch) {
    name_source(draft, gaps.is_missing, "extend", "extended", missing);
    return;
  }
  draft.mosaic.is_missing = gaps.is_missing;
  for (std::size_t k = 0; k < gaps.is_missing.values.size(); ++k)
    if (gaps.is_missing.values[k] != 0) draft.mosaic.source.values[k] = 0;
}

}  // namespace terracast::tiler
