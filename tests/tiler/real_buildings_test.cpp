#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/parallel.h"
#include "tests/support/mesh_checks.h"
#include "tests/tiler/building_layers.h"
#include "tests/tiler/raster_files.h"
#include "tests/tiler/vector_files.h"
#include "tiler/buildings/footprint.h"
#include "tiler/buildings/height_raster.h"

namespace terracast::test {
namespace {

using tiler::FootprintCounts;
using world::Solid;

/// All real footprints of a file, on a slope.
void check_all(const Built& built, const Land& land, std::size_t stride, double flat_share_below) {
  const auto solids = built.all(land, 0);
  std::vector<const Solid*> sample;
  for (const auto& [id, solid] : solids) sample.push_back(&solid);
  std::vector<std::string> problems(sample.size());
  std::vector<double> num_triangles(sample.size(), 0.0);
  core::parallel_for(static_cast<std::int64_t>(sample.size()), [&](std::int64_t k) {
    const auto i = static_cast<std::size_t>(k);
    num_triangles[i] = static_cast<double>(sample[i]->levels.front().shape.triangles.size());
    if (i % stride != 0) return;
    for (const auto& level : sample[i]->levels) {
      const MeshFacts facts = mesh_facts(level.shape);
      if (!facts.problem.empty() || facts.meets_itself)
        problems[i] += fmt::format("level {}: {} {} ", level.coarsest_level, facts.problem,
                                   facts.meets_itself ? "meets itself" : "");
    }
  });
  std::size_t num_bad = 0;
  for (std::size_t i = 0; i < sample.size(); ++i)
    if (!problems[i].empty() && ++num_bad < 20)
      ADD_FAILURE() << "feature " << (sample[i]->provenance.feature & 0xfffffffffffULL) << ": "
                    << problems[i];
  EXPECT_EQ(num_bad, 0u);
  std::sort(num_triangles.begin(), num_triangles.end());
  EXPECT_LE(num_triangles[num_triangles.size() / 2], flat_share_below);
}

TEST(RealBuildings, OfMonacoAreClosedAndMeetNothingOfThemselves) {
  TERRACAST_NEEDS_SHARED_DATA("monaco/monaco.osm.pbf");
  tiler::WorldOptions options = world_of("plane", 8192.0);
  options.origin_lat_deg = 43.7375;
  options.origin_lon_deg = 7.4225;
  const Built built(files_key(shared_data() / "monaco/monaco.osm.pbf"), options);
  EXPECT_GT(built.count("buildings"), 1100);
  Land land;
  land.slope = 0.15;
  check_all(built, land, 1, 150.0);
}

TEST(RealBuildings, OfAndorraAreClosedAndMeetNothingOfThemselves) {
  TERRACAST_NEEDS_SHARED_DATA("andorra/andorra.osm.pbf");
  tiler::WorldOptions options = world_of("plane", 8192.0);
  options.origin_lat_deg = 42.51;
  options.origin_lon_deg = 1.53;
  const Built built(files_key(shared_data() / "andorra/andorra.osm.pbf"), options);
  EXPECT_GT(built.count("buildings"), 1000);
  Land land;
  land.slope = 0.3;
  check_all(built, land, 3, 150.0);
}

/// By GDAL alone: pixel centres a metre within the footprints, in the rasters' own grid.
TEST(RealBuildings, OfAlexandriaAreAsHighAsTheSurfaceLessTheTerrain) {
  TERRACAST_NEEDS_SHARED_DATA("alexandria/alexandria_dsm_2m.tif");
  const std::filesystem::path folder = shared_data() / "alexandria";
  tiler::WorldOptions options = world_of("plane", 1024.0);
  options.origin_lat_deg = 38.8106;
  options.origin_lon_deg = -77.0526;
  const auto surface = prepare(options);
  const auto raster = tiler::HeightRaster::open(path_of(folder / "alexandria_dsm_2m.tif"),
                                                path_of(folder / "alexandria_dtm_2m.tif"),
                                                "declared", *surface, 1024.0);
  GDALAllRegister();
  using Dataset = std::unique_ptr<GDALDataset>;
  const Dataset high(GDALDataset::Open((folder / "alexandria_dsm_2m.tif").c_str(), GDAL_OF_RASTER));
  const Dataset ground(
      GDALDataset::Open((folder / "alexandria_dtm_2m.tif").c_str(), GDAL_OF_RASTER));
  const Dataset file(
      GDALDataset::Open((folder / "alexandria_buildings.geojson").c_str(), GDAL_OF_VECTOR));
  ASSERT_TRUE(high && ground && file);
  const auto value = [](GDALDataset& from, double u, double v) {
    std::array<double, 6> gt = {};
    from.GetGeoTransform(gt.data());
    const int i = static_cast<int>(std::floor((u - gt[0]) / gt[1]));
    const int j = static_cast<int>(std::floor((v - gt[3]) / gt[5]));
    double at = std::nan("");
    if (i >= 0 && j >= 0 && i < from.GetRasterXSize() && j < from.GetRasterYSize() &&
        from.GetRasterBand(1)->RasterIO(GF_Read, i, j, 1, 1, &at, 1, 1, GDT_Float64, 0, 0) !=
            CE_None)
      return std::nan("");
    return at < -1000.0 ? std::nan("") : at;
  };
  OGRSpatialReference utm;
  ASSERT_EQ(utm.SetFromUserInput("EPSG:26918"), OGRERR_NONE);
  utm.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  std::vector<double> differences;
  for (const auto& feature : *file->GetLayer(0)) {
    const OGRGeometry* whole = feature->GetGeometryRef();
    if (whole == nullptr || wkbFlatten(whole->getGeometryType()) != wkbMultiPolygon) continue;
    const OGRPolygon* polygon = whole->toMultiPolygon()->getGeometryRef(0);
    tiler::PointsWorld ring;
    for (const auto& point : *polygon->getExteriorRing())
      ring.push_back(surface->frame()
                         .world_from_geodetic(
                             {.lat_deg = point.getY(), .lon_deg = point.getX(), .height_m = 0.0})
                         .head<2>());
    ring.pop_back();
    std::vector<tiler::PointsWorld> rings = {ring};
    FootprintCounts counts;
    const auto footprints = tiler::footprints_of(rings, counts);
    if (footprints.size() != 1 || polygon->getNumInteriorRings() > 0) continue;
    const std::optional<double> median = raster->median_m(footprints[0]);
    OGRPolygon in_utm(*polygon);
    if (in_utm.transformTo(&utm) != OGRERR_NONE) continue;
    const std::unique_ptr<OGRGeometry> inside(in_utm.Buffer(-1.0));
    OGREnvelope box;
    inside->getEnvelope(&box);
    std::vector<double> heights;
    for (double v = std::floor(box.MinY) + 0.5; v < box.MaxY; v += 1.0)
      for (double u = std::floor(box.MinX) + 0.5; u < box.MaxX; u += 1.0) {
        const OGRPoint at(u, v);
        const double height = value(*high, u, v) - value(*ground, u, v);
        if (std::isfinite(height) && inside->Contains(&at)) heights.push_back(height);
      }
    if (heights.size() < 60 || !median) continue;
    std::nth_element(heights.begin(),
                     heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 2),
                     heights.end());
    differences.push_back(std::abs(*median - heights[heights.size() / 2]));
  }
  ASSERT_GT(differences.size(), 30u);
  std::sort(differences.begin(), differences.end());
  // Bilinear here and nearest there: pixels of 2 m on roofs that lean by up to 0.5 m a pixel.
  EXPECT_LT(differences[differences.size() / 2], 0.15);
  EXPECT_LT(differences[differences.size() * 9 / 10], 0.6);
}

}  // namespace
}  // namespace terracast::test
