#include "tiler/buildings/raster_outlines.h"

#include <gtest/gtest.h>

#include <GeographicLib/UTMUPS.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "core/parallel.h"
#include "core/random.h"
#include "tests/tiler/building_layers.h"
#include "tests/tiler/vector_files.h"
#include "tiler/buildings/setback.h"
#include "tiler/raster_cell_number.h"
#include "tiler/surveyed_ground.h"

/// Buildings made of rasters of heights: of drawn blocks, of bad files, and of Bilbao.
namespace terracast::test {
namespace {

using core::ErrorKind;
using Eigen::Vector2d;
using tiler::FeatureSet;
using tiler::VectorFeature;

/// Calls with the inputs of a layer of that surface.
template <class Use>
auto with_inputs(const tiler::WorldSurface& surface, const Use& use) {
  const core::Log log("tile", core::LogLevel::Off);
  tiler::InstanceIds ids;
  return use(tiler::LayerInputs{.frame = surface.frame(),
                                .size_m = surface.options().size_m,
                                .seed = 1,
                                .surface = surface,
                                .earlier = {},
                                .ids = ids,
                                .country = {},
                                .licence = {},
                                .accuracy = {},
                                .context = {.log = log, .num_threads = 0, .events_file = {}}});
}

tiler::RasterOutlines outlines(const tiler::WorldSurface& surface, const tiler::HeightFiles& files,
                               const tiler::RasterOutlineOptions& options = {}) {
  return with_inputs(surface, [&](const tiler::LayerInputs& inputs) {
    return tiler::read_raster_outlines(files, options, inputs);
  });
}

tiler::HeightFiles heights_of(const std::filesystem::path& file) {
  return {path_of(file), {}, "declared"};
}

double area_of(const VectorFeature& feature) {
  double all = 0.0;
  for (const auto& rings : feature.parts_world)
    for (std::size_t r = 0; r < rings.size(); ++r) {
      double sum = 0.0;
      for (std::size_t k = 0; k < rings[r].size(); ++k) {
        const Vector2d& a = rings[r][k];
        const Vector2d& b = rings[r][(k + 1) % rings[r].size()];
        sum += a.x() * b.y() - a.y() * b.x();
      }
      all += (r == 0 ? 0.5 : -0.5) * std::abs(sum);
    }
  return all;
}

/// Of a ring that bulges everywhere.
bool holds(const tiler::SurveyedGround::Ring& ring, const Vector2d& at) {
  int num_left = 0;
  for (std::size_t k = 0; k < ring.size(); ++k) {
    const Vector2d edge = ring[(k + 1) % ring.size()] - ring[k];
    const Vector2d from = at - ring[k];
    num_left += edge.x() * from.y() - edge.y() * from.x() > 0.0 ? 1 : 0;
  }
  return num_left == 0 || num_left == static_cast<int>(ring.size());
}

std::int64_t count_of(const FeatureSet& set, const std::string& name) {
  for (const auto& [key, value] : set.counts)
    if (key == name) return value;
  return -1;
}

/// Blocks about the origin on ground that rises to the east, in a raster of a surface of 2 m and a terrain of 5 m.
class Blocks : public testing::Test {
 protected:
  static constexpr double kSlope = 0.05;
  struct Block {
    Vector2d middle;
    double length_m, width_m, angle_rad, height_m;
    bool contains(const Vector2d& at) const {
      const Vector2d along(std::cos(angle_rad), std::sin(angle_rad));
      const Vector2d from = at - middle;
      return std::abs(along.dot(from)) < 0.5 * length_m &&
             std::abs(along.x() * from.y() - along.y() * from.x()) < 0.5 * width_m;
    }
  };
  const Vector2d origin_ = utm31(kOriginLat_deg, kOriginLon_deg).array().round();
  /// The second to fourth are a terrace, which shares walls.
  const std::vector<Block> blocks_ = {
      {{-100, 100}, 40, 24, 0.0, 12.0}, {{0, 0}, 20, 16, 0.0, 7.0},
      {{20, 0}, 20, 16, 0.0, 13.0},     {{40, 0}, 20, 16, 0.0, 19.0},
      {{-80, -90}, 60, 26, 0.55, 30.0}, {{120, 80}, 50, 30, 1.1, 9.0}};
  const ScratchFolder folder_;
  /// Cells without a height, by their middles about the origin.
  std::function<bool(const Vector2d&)> is_void_ = [](const Vector2d&) { return false; };

  static double ground_m(double u) { return 250.0 + kSlope * u; }
  void write(bool as_heights, double noise_m = 0.0) const {
    RasterSpec spec;
    spec.width = spec.height = 250;
    spec.type = GDT_Float32;
    spec.geotransform = {origin_.x() - 250.0, 2.0, 0.0, origin_.y() + 250.0, 0.0, -2.0};
    spec.nodata = -9999.0;
    spec.value = [&](double u, double v) {
      const Vector2d at = Vector2d(u, v) - origin_;
      if (is_void_(at)) return -9999.0;
      double height_m =
          noise_m *
          core::random_unit(3, 4, static_cast<std::uint64_t>((at.x() + 500) * 4096 + at.y()));
      for (const Block& block : blocks_)
        if (block.contains(at)) height_m += block.height_m;
      return height_m + (as_heights ? 0.0 : ground_m(at.x()));
    };
    write_raster(folder_ / "surface.tif", spec);
    spec.width = spec.height = 110;
    spec.geotransform = {origin_.x() - 271.0, 5.0, 0.0, origin_.y() + 273.0, 0.0, -5.0};
    spec.value = [&](double u, double) { return ground_m(u - origin_.x()); };
    write_raster(folder_ / "terrain.tif", spec);
  }
  tiler::HeightFiles files(bool as_heights) const {
    tiler::HeightFiles files{path_of(folder_ / "surface.tif"), {}, "declared"};
    if (!as_heights) files.terrain = path_of(folder_ / "terrain.tif");
    return files;
  }
  std::string keys(const std::string& more = "") const {
    return fmt::format("source = \"raster\"\nsurface = \"{}\"\nterrain = \"{}\"\n{}",
                       (folder_ / "surface.tif").string(), (folder_ / "terrain.tif").string(),
                       more);
  }
  /// From metres of the projection to those of the ground.
  double per_grid_m2() const {
    int zone = 0;
    bool north = false;
    double x = 0, y = 0, gamma = 0, scale = 0;
    GeographicLib::UTMUPS::Forward(kOriginLat_deg, kOriginLon_deg, zone, north, x, y, gamma, scale,
                                   31);
    return 1.0 / (scale * scale);
  }
};

TEST_F(Blocks, ComeBackWithTheirAreasAndHeights) {
  tiler::WorldOptions options = world_of("plane", 1024.0);
  options.elevation[0].height_m = 0.0;
  const auto surface = prepare(options);
  for (const bool as_heights : {true, false}) {
    SCOPED_TRACE(as_heights);
    write(as_heights, 0.3);
    const tiler::RasterOutlines all = outlines(*surface, files(as_heights));
    const FeatureSet& set = all.features;
    ASSERT_EQ(set.features.size(), blocks_.size());
    for (const Block& block : blocks_) {
      SCOPED_TRACE(block.middle.transpose());
      // By its number alone: the first of its cells, from the north.
      const VectorFeature* found = nullptr;
      for (const VectorFeature& feature : set.features) {
        const Eigen::Vector2i cell = tiler::cell_of_number(feature.number);
        const Vector2d at(-250.0 + 2.0 * (cell.x() + 0.5), 250.0 - 2.0 * (cell.y() + 0.5));
        if (block.contains(at)) found = &feature;
      }
      ASSERT_NE(found, nullptr);
      const double truth_m2 = block.length_m * block.width_m * per_grid_m2();
      // Along the cells to the millimetres of float samples and nodes; slanted by what steps leave open of walls.
      EXPECT_NEAR(area_of(*found), truth_m2, (block.angle_rad == 0.0 ? 0.001 : 0.02) * truth_m2);
      // The middle of noise of 0 to 0.3 m.
      EXPECT_NEAR(all.medians_m.at(found->number), block.height_m + 0.15, 0.05);
      EXPECT_EQ(found->tags.value("roof:shape"), "flat");
    }
  }
}

TEST_F(Blocks, StandAsHighAsTheyAreAndAreTracedToTheirCells) {
  write(false);
  const Built built(keys(), world_of("plane", 1024.0));
  EXPECT_EQ(built.count("buildings"), 6);
  EXPECT_EQ(built.count("heights from the raster"), 6);
  EXPECT_EQ(built.count(std::string(tiler::kCellCount)), 6);
  EXPECT_EQ(built.count("cells of the raster"), 250 * 250);
  EXPECT_EQ(built.layer->info().source, "surface.tif, terrain.tif");
  const Land land;
  std::map<std::uint64_t, double> heights;
  for (const auto& [id, solid] : built.all(land)) {
    // Block, without parapets and what stands on roofs.
    double top = -1e9;
    for (const auto& vertex : solid.levels.back().shape.vertices_steps)
      top = std::max(top, world::kHeightStep_m * (solid.origin_steps.z() + vertex.z()));
    heights[solid.provenance.feature] = top - land.ground_z_world({0.0, 0.0});
  }
  ASSERT_EQ(heights.size(), 6U);
  std::vector<double> found;
  for (const auto& [feature, height_m] : heights) found.push_back(height_m);
  std::sort(found.begin(), found.end());
  const std::vector<double> truth = {7.0, 9.0, 12.0, 13.0, 19.0, 30.0};
  // Terrain between samples of 5 m, in float, setbacks of rank, and the levels on which tops of blocks lie.
  for (std::size_t k = 0; k < 6; ++k)
    EXPECT_NEAR(found[k], truth[k], 0.02 + 0.5 * tiler::kLevels_m);
}

/// A height above the ground is one above the middle of a slope, not above its foot.
TEST_F(Blocks, OnASlopeTheirRoofsLieWhereTheSurfaceDoes) {
  write(false);
  const Built built(keys(), world_of_rasters({folder_ / "terrain.tif"}, 512.0));
  EXPECT_EQ(built.count("buildings"), 6);
  Land land;
  land.slope = kSlope;
  int num_found = 0;
  for (const auto& [id, solid] : built.all(land)) {
    double top = -1e9;
    for (const auto& vertex : solid.levels.back().shape.vertices_steps)
      top = std::max(top, world::kHeightStep_m * (solid.origin_steps.z() + vertex.z()));
    for (const Block& block : blocks_) {
      // The world's north is a degree off that of the grid.
      if ((solid.place_m.cast<double>() - block.middle).norm() > 4.0) continue;
      ++num_found;
      // Places within a footprint stand a tenth of it apart at most: 0.3 m of the slope over the longest.
      EXPECT_NEAR(top, land.ground_z_world(block.middle) + block.height_m, 0.3);
    }
  }
  EXPECT_EQ(num_found, 6);
}

TEST_F(Blocks, AreTheSameInAWorldOfAnotherSizeAndWithOneThread) {
  write(true, 0.3);
  const auto surface = prepare(world_of("plane", 1024.0));
  const FeatureSet once = outlines(*surface, files(true)).features;
  {
    const core::ThreadLimit limit(1);
    const FeatureSet again = outlines(*surface, files(true)).features;
    ASSERT_EQ(again.features.size(), once.features.size());
    for (std::size_t k = 0; k < once.features.size(); ++k) {
      EXPECT_EQ(again.features[k].number, once.features[k].number);
      EXPECT_EQ(again.features[k].parts_world, once.features[k].parts_world);
    }
  }
  // A square that cuts the raster counts its cells all the same.
  const auto small = prepare(world_of("plane", 384.0));
  const FeatureSet less = outlines(*small, files(true)).features;
  int num_same = 0;
  for (const VectorFeature& feature : less.features)
    for (const VectorFeature& other : once.features)
      if (feature.number == other.number && feature.tags == other.tags) ++num_same;
  EXPECT_EQ(num_same, static_cast<int>(less.features.size()));
  EXPECT_GE(num_same, 5);
}

/// Seen in November 2026: what had no height within a raster counted as surveyed, and so did all of a
/// square of 50 m of which one cell had one.
TEST_F(Blocks, AreAllThatStandsWhereTheRasterHasHeightsAndNowhereElse) {
  is_void_ = [](const Vector2d& at) {
    return (at - Vector2d(120, -120)).norm() < 70.0 ||               // in its middle
           at.x() + 30.0 * std::sin(0.05 * at.y()) > 210.0 ||        // a ragged border
           (at - Vector2d(-21, 181)).cwiseAbs().maxCoeff() < 1.0 ||  // one cell
           (std::abs(at.y() + 201) < 1.0 &&
            std::fmod(at.x() + 251, 4) < 1);  // each second of a row
  };
  write(true);
  const auto surface = prepare(world_of("plane", 1024.0));
  const tiler::SurveyedGround ground = outlines(*surface, files(true)).ground;
  EXPECT_EQ(ground.buildings.size(), blocks_.size());
  int num_void = 0;
  for (int row = 0; row < 250; ++row)
    for (int column = 0; column < 250; ++column) {
      const Vector2d middle(-250.0 + 2.0 * column + 1.0, 250.0 - 2.0 * row - 1.0);
      const bool is_void = is_void_(middle);
      num_void += is_void ? 1 : 0;
      // Near two corners of the cell: between corners of boxes 128 m apart lines of the grid bend
      // by less than a millimetre.
      for (const double side : {-0.99, 0.99}) {
        const Vector2d at = origin_ + middle + Vector2d(side, side);
        geo::Geodetic place;
        GeographicLib::UTMUPS::Reverse(31, true, at.x(), at.y(), place.lat_deg, place.lon_deg);
        place.height_m = *surface->measured_height_m(place.lat_deg, place.lon_deg);
        const Vector2d at_world = surface->frame().world_from_geodetic(place).head<2>();
        const auto num = std::count_if(ground.areas.begin(), ground.areas.end(),
                                       [&](const auto& ring) { return holds(ring, at_world); });
        ASSERT_EQ(num, is_void ? 0 : 1) << middle.transpose();
      }
    }
  EXPECT_GT(num_void, 5'000);
  EXPECT_LT(ground.areas.size(), 1'000U);
}

TEST_F(Blocks, AreReadOnceForASurveyAndForTheLayer) {
  write(false);
  const auto surface = prepare(world_of("plane", 1024.0));
  const tiler::LayerOptions options = layer_of(keys());
  const auto* kind = dynamic_cast<const tiler::SurveyingKind*>(&options.kind_options());
  ASSERT_NE(kind, nullptr);
  const std::string hash = made_layer(options, *surface, 1)->input_hash();
  const auto survey_and_make = [&](const tiler::LayerInputs& inputs) {
    const std::unique_ptr<tiler::GroundSurvey> survey = kind->survey(inputs);
    EXPECT_EQ(survey->ground().buildings.size(), blocks_.size());
    EXPECT_FALSE(survey->ground().content_hash.empty());
    std::filesystem::remove(folder_ / "surface.tif");
    std::filesystem::remove(folder_ / "terrain.tif");
    return survey->make(inputs);
  };
  const std::unique_ptr<tiler::Layer> layer = with_inputs(*surface, survey_and_make);
  EXPECT_EQ(layer->input_hash(), hash);
  EXPECT_TRUE(layer->holds(blocks_[0].middle, 0.0));
  const core::Ledger ledger = layer->info().ledger;
  ASSERT_EQ(ledger.entries().count("horizontal system"), 1U) << ledger.table();
  EXPECT_GE(ledger.entries().at("horizontal system").num_used, 1);
  // Footprints survey nothing.
  const tiler::LayerOptions of_files = layer_of("files = [\"a.gpkg\"]\n");
  const auto survey_files = [&](const tiler::LayerInputs& inputs) {
    return dynamic_cast<const tiler::SurveyingKind&>(of_files.kind_options()).survey(inputs);
  };
  EXPECT_EQ(with_inputs(*surface, survey_files), nullptr);
}

/// Seen in November 2026: a raster's layer listed before the first that asks for the country was read
/// for the layer, and once more for the country. A reading that finds nothing says so.
TEST_F(Blocks, AreReadOnceBeforeAndAfterTheLayerThatAsksForTheCountry) {
  write(false);
  tiler::LayerOptions roads;
  core::TomlDocument::parse("kind = \"roads\"\nsource = \"country\"\n", "layer.toml").read(roads);
  const tiler::LayerOptions buildings = layer_of(keys("least_height_m = 40.0\n"));
  const core::Log log("tile", core::LogLevel::Warn);
  const core::Context context{.log = log, .num_threads = 0, .events_file = {}};
  for (const auto& layers : {std::vector{buildings, roads}, std::vector{roads, buildings},
                             std::vector{buildings, roads, buildings}}) {
    tiler::WorldOptions options = world_of("plane", 1024.0);
    options.layers = layers;
    const auto surface = prepare(options);
    testing::internal::CaptureStderr();
    const tiler::LayerStack stack(*surface, context);
    const std::string said = testing::internal::GetCapturedStderr();
    std::size_t num_read = 0;
    for (std::size_t at = 0; (at = said.find("it shows no buildings", at)) != std::string::npos;
         ++at)
      ++num_read;
    EXPECT_EQ(num_read, layers.size() - 1) << said;
  }
}

TEST_F(Blocks, KeysThatContradictAreRefused) {
  write(false);
  const auto refuse = [](const std::string& text, const std::vector<std::string>& words) {
    expect_error(ErrorKind::Config, words, [&] { layer_of(text).kind_options().validate(); });
  };
  refuse("source = \"raster\"\n", {"needs heights"});
  refuse(keys("files = [\"a.gpkg\"]\n"), {"reads no files"});
  refuse(keys("least_height_m = 0.0\n"), {"least_height_m", "outside"});
  refuse(keys("straighten_cells = 0.1\n"), {"straighten_cells", "outside"});
}

/// Rasters that are not what they should be.
class BadHeights : public testing::Test {
 protected:
  BadHeights() {
    spec_ = utm_spec(400.0, 4.0);
    spec_.type = GDT_Float32;
    spec_.value = [](double, double) { return 0.0; };
  }
  void write() const { write_raster(folder_ / "heights.tif", spec_); }
  tiler::RasterOutlines read(const tiler::RasterOutlineOptions& options = {},
                             const std::string& nodata = "declared") const {
    return outlines(*surface_, {path_of(folder_ / "heights.tif"), {}, nodata}, options);
  }
  void refuses(ErrorKind kind, const std::vector<std::string>& words,
               const std::string& nodata = "declared") const {
    expect_error(kind, words, [&] { read({}, nodata); });
  }
  const ScratchFolder folder_;
  const std::shared_ptr<const tiler::WorldSurface> surface_ = prepare(world_of("plane", 1024.0));
  RasterSpec spec_;
};

TEST_F(BadHeights, WithoutPlaceOrElsewhereAreRefused) {
  refuses(ErrorKind::Io, {"heights.tif", "no such raster"});
  spec_.crs = "";
  write();
  refuses(ErrorKind::Input, {"heights.tif", "gdal_edit.py -a_srs"});
  spec_.crs = "EPSG:32631";
  spec_.geotransform[0] += 50e3;
  write();
  refuses(ErrorKind::Input, {"heights.tif", "beside the world's square", "32631", "right CRS"});
  spec_.geotransform[0] -= 50e3;
  for (const char* crs : {"EPSG:32633", "EPSG:4326"}) {
    SCOPED_TRACE(crs);
    spec_.crs = crs;
    write();
    refuses(ErrorKind::Input, {"heights.tif", "beside the world's square", crs, "right CRS"});
  }
  write_text(folder_ / "heights.tif", "no raster");
  refuses(ErrorKind::Input, {"heights.tif", "cannot be opened as a raster"});
}

TEST_F(BadHeights, VoidsAreNoBuildingsAndNothingButVoidsIsRefused) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  spec_.value = [=](double, double) { return nan; };
  write();
  refuses(ErrorKind::Input, {"heights.tif", "none of the", "has a height"});
  refuses(ErrorKind::Input, {"heights.tif", "none of the", "has a height"}, "nan");
  // Half of a block is unknown: the other half stands.
  const Vector2d at = utm31(kOriginLat_deg, kOriginLon_deg);
  spec_.value = [=](double u, double v) {
    if (std::abs(v - at.y()) > 20.0 || std::abs(u - at.x()) > 40.0) return 0.0;
    return u < at.x() ? -9999.0 : 10.0;
  };
  spec_.nodata = -9999.0;
  write();
  const tiler::RasterOutlines all = read();
  const FeatureSet& set = all.features;
  ASSERT_EQ(set.features.size(), 1U);
  EXPECT_NEAR(area_of(set.features[0]), 40.0 * 40.0, 40.0 * 4.0 * 2.0);  // a cell on two sides
  EXPECT_NEAR(all.medians_m.at(set.features[0].number), 10.0, 1e-6);
}

TEST_F(BadHeights, AnEmptyOneMakesNothingAndHeightsAboveTheSeaAreRefused) {
  write();
  const FeatureSet none = read().features;
  EXPECT_TRUE(none.features.empty());
  EXPECT_EQ(count_of(none, "cells as high as buildings"), 0);
  spec_.value = [](double, double) { return 1250.0; };
  write();
  refuses(ErrorKind::Input, {"heights.tif", "pixel (", "1250", "above the ground", "surface"});
  spec_.value = [](double, double) { return -4.0; };
  write();
  const auto below = [&] {
    tiler::HeightFiles files = heights_of(folder_ / "heights.tif");
    RasterSpec terrain = spec_;
    terrain.value = [](double, double) { return 30.0; };
    write_raster(folder_ / "terrain.tif", terrain);
    files.terrain = path_of(folder_ / "terrain.tif");
    outlines(*surface_, files);
  };
  expect_error(ErrorKind::Input,
               {"heights.tif", "below the terrain", "terrain.tif", "state heights"}, below);
}

/// Tens of thousands of specks, which the search of the test counts by itself, and a raster that is all noise.
TEST_F(BadHeights, NoiseIsCountedAndLeftOut) {
  spec_.width = spec_.height = 500;
  const Vector2d at = utm31(kOriginLat_deg, kOriginLon_deg);
  spec_.geotransform = {std::round(at.x()) - 500.0, 2.0, 0.0,
                        std::round(at.y()) + 500.0, 0.0, -2.0};
  const auto is_high = [&](int i, int j) {
    return i >= 0 && j >= 0 && i < 500 && j < 500 &&
           core::random_unit(1, 2, static_cast<std::uint64_t>(j * 500 + i)) < 0.15;
  };
  spec_.value = [&](double u, double v) {
    return is_high(static_cast<int>((u - spec_.geotransform[0]) / 2.0),
                   static_cast<int>((spec_.geotransform[3] - v) / 2.0))
               ? 8.0
               : 0.0;
  };
  write();
  const FeatureSet set = read({.least_area_m2 = 60.0}).features;
  std::int64_t num_cells = 0;
  for (int j = 0; j < 500; ++j)
    for (int i = 0; i < 500; ++i) num_cells += is_high(i, j) ? 1 : 0;
  EXPECT_EQ(count_of(set, "cells as high as buildings"), num_cells);
  EXPECT_GT(count_of(set, "specks left out"), 15'000);
  // Clusters of 15 cells of such noise are rarer than one in ten thousand (Stauffer and Aharony 1994).
  EXPECT_LT(set.features.size(), 40U);
  spec_.value = [](double u, double v) {
    return 60.0 * core::random_unit(1, 2, static_cast<std::uint64_t>(std::abs(u * 7919.0 + v)));
  };
  write();
  const Built built(
      fmt::format("source = \"raster\"\nheights = \"{}\"\n", (folder_ / "heights.tif").string()),
      world_of("plane", 1024.0));
  EXPECT_GT(built.count("buildings"), 0);
  EXPECT_EQ(built.count("cells of the raster"), 500 * 500);
}

/// Against the raster's own cells, by GDAL and GeographicLib alone.
TEST(RasterOutlines, OfBilbaoCoverWhatItsRasterShows) {
  TERRACAST_NEEDS_SHARED_DATA("bilbao/bilbao_BDSM.tif");
  const auto file = shared_data() / "bilbao/bilbao_BDSM.tif";
  tiler::WorldOptions options = world_of_rasters({shared_data() / "bilbao/bilbao_DEM.tif"}, 3072.0);
  options.origin_lat_deg = 43.3123;
  options.origin_lon_deg = -2.9865;
  options.elevation[0].sea = "none";
  const auto surface = prepare(options);
  GDALAllRegister();
  const std::unique_ptr<GDALDataset> dataset(GDALDataset::Open(file.c_str(), GDAL_OF_RASTER));
  ASSERT_TRUE(dataset);
  std::array<double, 6> corner = {};
  ASSERT_EQ(dataset->GetGeoTransform(corner.data()), CE_None);
  const int width = dataset->GetRasterXSize();
  const int height = dataset->GetRasterYSize();
  std::vector<float> heights_m(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  ASSERT_EQ(dataset->GetRasterBand(1)->RasterIO(GF_Read, 0, 0, width, height, heights_m.data(),
                                                width, height, GDT_Float32, 0, 0, nullptr),
            CE_None);
  const auto layer = made_layer(
      layer_of(fmt::format("source = \"raster\"\nheights = \"{}\"\n", file.string())), *surface, 1);
  // Of every third cell of every third row, well within the square: whether a building stands at its middle.
  std::int64_t num_high = 0;
  std::int64_t num_built = 0;
  std::int64_t num_both = 0;
  for (int row = 0; row < height; row += 3)
    for (int column = 0; column < width; column += 3) {
      geo::Geodetic place;
      GeographicLib::UTMUPS::Reverse(30, true, corner[0] + (column + 0.5) * corner[1],
                                     corner[3] + (row + 0.5) * corner[5], place.lat_deg,
                                     place.lon_deg);
      place.height_m = *surface->measured_height_m(place.lat_deg, place.lon_deg);
      const Vector2d at = surface->frame().world_from_geodetic(place).head<2>();
      if (at.cwiseAbs().maxCoeff() > 1500.0) continue;
      const bool is_high =
          heights_m[static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
                    static_cast<std::size_t>(column)] >= 2.5F;
      const bool is_built = layer->holds(at, 0.0);
      num_high += is_high ? 1 : 0;
      num_built += is_built ? 1 : 0;
      num_both += is_high && is_built ? 1 : 0;
    }
  EXPECT_GT(num_high, 20'000);
  // All of the area, less specks and what stands in water; cells that walls cut go to one side or the other.
  EXPECT_NEAR(static_cast<double>(num_built), static_cast<double>(num_high),
              0.03 * static_cast<double>(num_high));
  EXPECT_GT(static_cast<double>(num_both), 0.93 * static_cast<double>(num_high));
}

}  // namespace
}  // namespace terracast::test
