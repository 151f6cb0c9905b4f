#include "tiler/buildings/raster_outlines.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include "core/error.h"
#include "core/hash.h"
#include "core/parallel.h"
#include "tiler/buildings/block_outlines.h"
#include "tiler/buildings/height_cells.h"
#include "tiler/buildings/known_cells.h"
#include "tiler/buildings/raster_blocks.h"
#include "tiler/raster_cell_number.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;

/// Bumped when the same raster gives other outlines.
constexpr int kOutlinesVersion = 2;
constexpr std::size_t kMostOutlines = 2'000'000;
/// A roof is flat that is no steeper than what a raster of whole metres, rounded down, shows of
/// one.
constexpr double kFlat_m = 1.0;
/// Of surveyed ground: more of them would cost a country more than the cells that they tell of.
constexpr std::size_t kMostBoxes = 100'000;
/// So much of what is known is a building at most, or it is no height above the ground.
constexpr double kMostBuilt = 0.75;

struct Found {
  HeightCells cells;
  RasterBlocks blocks;
};

Found find(const HeightFiles& files, const RasterOutlineOptions& options,
           const LayerInputs& inputs) {
  Found found;
  found.cells =
      read_height_cells(files.surface, files.terrain, files.nodata, inputs.surface, inputs.size_m);
  BlockRules rules;
  rules.least_height_m = options.least_height_m;
  rules.height_class_m = options.height_class_m;
  rules.least_cells = std::max<std::int64_t>(
      1, static_cast<std::int64_t>(std::ceil(options.least_area_m2 / found.cells.cell.area_m2)));
  found.blocks = find_blocks(found.cells.heights_m, rules);
  if (found.blocks.pieces.size() > kMostOutlines)
    core::fail(core::ErrorKind::Input,
               "{}: shows {} buildings, and {} are taken at most; a larger least_area_m2 ({:g}) or "
               "least_height_m ({:g}) leaves out noise",
               found.cells.raster->path(), found.blocks.pieces.size(), kMostOutlines,
               options.least_area_m2, options.least_height_m);
  return found;
}

/// In place, of rings in cells.
void put_on_ground(const HeightCells& cells, const LayerInputs& inputs,
                   std::vector<CellRings>& outlines) {
  const VectorFrame frame = vector_frame(inputs);
  // The first cell's outer corner is half a cell before its middle.
  const Vector2d first = cells.first_cell.cast<double>().array() - 0.5;
  core::parallel_for_blocks(static_cast<std::int64_t>(outlines.size()), 64,
                            [&](std::int64_t begin, std::int64_t end) {
                              std::vector<Vector2d> samples;
                              for (std::int64_t k = begin; k < end; ++k)
                                for (const auto& ring : outlines[static_cast<std::size_t>(k)])
                                  for (const Vector2d& at : ring) samples.push_back(first + at);
                              if (samples.empty()) return;
                              std::vector<geo::Geodetic> places(samples.size());
                              cells.raster->grid().geodetic_from_samples(samples, places);
                              std::size_t next = 0;
                              for (std::int64_t k = begin; k < end; ++k)
                                for (auto& ring : outlines[static_cast<std::size_t>(k)])
                                  for (Vector2d& at : ring) {
                                    geo::Geodetic& place = places[next++];
                                    place.height_m = frame.ground_height_m(place);
                                    at = frame.frame.world_from_geodetic(place).head<2>();
                                  }
                            });
}

std::vector<CellRings> outlines_world(const Found& found, const RasterOutlineOptions& options,
                                      const LayerInputs& inputs) {
  std::vector<CellRings> outlines =
      outlines_of(found.blocks.piece, static_cast<std::int32_t>(found.blocks.pieces.size()),
                  options.straighten_cells);
  put_on_ground(found.cells, inputs, outlines);
  return outlines;
}

std::string hash_of(const Found& found, const RasterOutlineOptions& options) {
  return core::content_hash(fmt::format("outlines {} {} {} {} {} {}", kOutlinesVersion,
                                        found.cells.content_hash, options.least_height_m,
                                        options.least_area_m2, options.height_class_m,
                                        options.straighten_cells));
}

std::vector<SurveyedGround::Ring> known_ground(const Found& found, const LayerInputs& inputs) {
  std::vector<CellRings> areas;
  for (const CellBox& box : boxes_of_known(found.cells.heights_m, kMostBoxes))
    areas.push_back(
        {{Vector2d(box.first_column, box.first_row), Vector2d(box.end_column, box.first_row),
          Vector2d(box.end_column, box.end_row), Vector2d(box.first_column, box.end_row)}});
  put_on_ground(found.cells, inputs, areas);
  std::vector<SurveyedGround::Ring> rings;
  for (CellRings& area : areas) rings.push_back(std::move(area.front()));
  return rings;
}

VectorFeature feature_of(const Found& found, const BlockPiece& piece, CellRings rings) {
  VectorFeature feature;
  feature.number = cell_number(found.cells.first_cell.x() + piece.first_column,
                               found.cells.first_cell.y() + piece.first_row);
  feature.kind = FeatureKind::Area;
  std::vector<std::pair<std::string, std::string>> tags = {{"building", "yes"}};
  if (piece.spread_m < kFlat_m) tags.emplace_back("roof:shape", "flat");
  feature.tags = FeatureTags(std::move(tags));
  feature.parts_world.push_back(std::move(rings));
  return feature;
}

std::string name_of(const core::Path& file) {
  return std::filesystem::path(file.written).filename().string();
}

void warn_of_what_is_odd(const Found& found, const RasterOutlineOptions& options,
                         const LayerInputs& inputs) {
  const std::vector<float>& heights = found.cells.heights_m.values;
  const auto num_known = static_cast<double>(std::count_if(
      heights.begin(), heights.end(), [](float height_m) { return !std::isnan(height_m); }));
  const std::string& path = found.cells.raster->path();
  if (!found.cells.raster->grid().warning().empty())
    inputs.context.log.warn("{}", found.cells.raster->grid().warning());
  if (found.blocks.pieces.empty())
    inputs.context.log.warn(
        "{}: nothing in the world's square stands {:g} m above the ground on {:g} m2 and more: it "
        "shows no buildings",
        path, options.least_height_m, options.least_area_m2);
  if (static_cast<double>(found.blocks.num_cells) > kMostBuilt * num_known)
    inputs.context.log.warn(
        "{}: {:.0f} % of its cells stand {:g} m above the ground and more; are they heights above "
        "the ground? a surface is stated as surface, beside its terrain",
        path, 100.0 * static_cast<double>(found.blocks.num_cells) / num_known,
        options.least_height_m);
}

}  // namespace

void RasterOutlineOptions::describe(core::SchemaVisitor& visit) {
  visit.key("least_height_m", least_height_m,
            "raster: what stands so far above the ground is a building.",
            core::between(0.5, 100.0));
  visit.key("least_area_m2", least_area_m2,
            "raster: blocks of less ground are left out, and pieces of them are joined to their "
            "neighbours.",
            core::between(0.0, 1e6));
  visit.key("height_class_m", height_class_m,
            "raster: blocks are cut into pieces so that the heights in each lie within so much: "
            "houses of a terrace, the tower on its hall.",
            core::between(0.1, 1000.0));
  visit.key("straighten_cells", straighten_cells,
            "raster: straight walls keep so near to the middles of the sides of cells, in cells; a "
            "slanted wall's own steps reach 0.5 far.",
            core::between(0.5, 4.0));
}

RasterOutlines read_raster_outlines(const HeightFiles& files, const RasterOutlineOptions& options,
                                    const LayerInputs& inputs) {
  const Found found = find(files, options, inputs);
  warn_of_what_is_odd(found, options, inputs);
  std::vector<CellRings> outlines = outlines_world(found, options, inputs);
  RasterOutlines all;
  all.ground.content_hash = hash_of(found, options);
  all.ground.areas = known_ground(found, inputs);
  for (const CellRings& rings : outlines)
    if (!rings.empty() && rings.front().size() >= 3) all.ground.buildings.push_back(rings.front());
  for (std::size_t k = 0; k < outlines.size(); ++k) {
    all.features.features.push_back(
        feature_of(found, found.blocks.pieces[k], std::move(outlines[k])));
    all.medians_m.emplace(all.features.features.back().number, found.blocks.pieces[k].median_m);
  }
  all.features.name =
      name_of(files.surface) + (files.terrain.empty() ? "" : ", " + name_of(files.terrain));
  all.features.content_hash = all.ground.content_hash;
  all.features.ledger = found.cells.ledger;
  all.features.counts = {
      {"cells of the raster", static_cast<std::int64_t>(found.blocks.piece.values.size())},
      {"cells as high as buildings", found.blocks.num_cells},
      {"blocks", found.blocks.num_blocks},
      {std::string(kCellCount), static_cast<std::int64_t>(all.features.features.size())},
      {"specks left out", found.blocks.num_specks},
      {"cells of specks", found.blocks.num_speck_cells}};
  return all;
}

}  // namespace terracast::tiler
