// What it costs to have a file read by a process of its own (tiler/apart), against reading it here by the same driver: a
// grid of text of 4000 x 4000 heights, and a GML of 50 000 buildings.
//
//     build/bench/terracast_bench --benchmark_filter=Read --benchmark_repetitions=5
//
// Needs terracast_program beside it.

#include <benchmark/benchmark.h>
#include <cpl_conv.h>
#include <ogrsf_frmts.h>

#include <cstdlib>
#include <fstream>

#include "tests/bench/bench_support.h"
#include "tiler/apart/given_features.h"
#include "tiler/apart/given_raster.h"
#include "tiler/gdal_formats.h"
#include "tiler/gdal_support.h"

namespace terracast::bench {
namespace {

/// Files in a folder of their own, gone at the end.
class Files {
 public:
  static const Files& get() {
    static const Files files;
    return files;
  }
  core::Path grid() const { return path_of("grid.asc"); }
  core::Path buildings() const { return path_of("buildings.gml"); }

 private:
  Files() {
    tiler::register_gdal();
    // Here too every driver is at hand.
    CPLSetConfigOption("GDAL_SKIP", "");
    GDALAllRegister();
    write_grid();
    write_buildings();
  }

  core::Path path_of(const char* name) const {
    return {.written = name, .resolved = folder_.path() / name};
  }

  void write_grid() const {
    constexpr int kSide = 4000;
    std::ofstream out(folder_.path() / "grid.asc");
    out << "ncols 4000\nnrows 4000\nxllcorner 376000\nyllcorner 4600000\ncellsize 5\n";
    for (int row = 0; row < kSide; ++row) {
      std::string line;
      for (int column = 0; column < kSide; ++column)
        line += fmt::format("{}.{:02} ", 500 + (row + column) % 700, (row * 7 + column * 13) % 100);
      out << line << "\n";
    }
    std::ofstream(folder_.path() / "grid.prj")
        << "PROJCS[\"WGS 84 / UTM zone 31N\",GEOGCS[\"WGS 84\",DATUM[\"WGS_1984\",SPHEROID[\"WGS "
           "84\","
           "6378137,298.257223563]],PRIMEM[\"Greenwich\",0],UNIT[\"degree\",0.0174532925199433]],"
           "PROJECTION[\"Transverse_Mercator\"],PARAMETER[\"latitude_of_origin\",0],"
           "PARAMETER[\"central_meridian\",3],PARAMETER[\"scale_factor\",0.9996],"
           "PARAMETER[\"false_easting\",500000],PARAMETER[\"false_northing\",0],UNIT[\"metre\",1]]";
  }

  void write_buildings() const {
    const tiler::GdalErrors quiet;
    const tiler::GdalDatasetPtr made(GetGDALDriverManager()->GetDriverByName("GML")->Create(
        (folder_.path() / "buildings.gml").c_str(), 0, 0, 0, GDT_Unknown, nullptr));
    OGRSpatialReference crs;
    crs.importFromEPSG(4326);
    OGRLayer* layer = made->CreateLayer("buildings", &crs, wkbPolygon, nullptr);
    for (const char* name : {"building", "name", "height"}) {
      OGRFieldDefn field(name, OFTString);
      if (layer->CreateField(&field) != OGRERR_NONE) std::abort();
    }
    for (int i = 0; i < 50'000; ++i) {
      OGRFeature feature(layer->GetLayerDefn());
      feature.SetField("building", "yes");
      feature.SetField("name", fmt::format("house {}", i).c_str());
      feature.SetField("height", fmt::format("{}", 5 + i % 20).c_str());
      const double lat = 42.0 + 0.001 * (i / 250);
      const double lon = 1.0 + 0.001 * (i % 250);
      auto* ring = new OGRLinearRing;
      for (const auto& [u, v] :
           {std::pair{0.0, 0.0}, {0.0, 1e-4}, {1e-4, 1e-4}, {1e-4, 0.0}, {0.0, 0.0}})
        ring->addPoint(lat + u, lon + v);
      OGRPolygon polygon;
      polygon.addRingDirectly(ring);
      feature.SetGeometry(&polygon);
      if (layer->CreateFeature(&feature) != OGRERR_NONE) std::abort();
    }
  }

  Folder folder_{"apart-bench"};
};

/// All samples, a row at a time.
double sum_of(GDALDataset& dataset) {
  std::vector<double> row(static_cast<std::size_t>(dataset.GetRasterXSize()));
  double sum = 0.0;
  for (int y = 0; y < dataset.GetRasterYSize(); ++y) {
    if (dataset.GetRasterBand(1)->RasterIO(GF_Read, 0, y, dataset.GetRasterXSize(), 1, row.data(),
                                           dataset.GetRasterXSize(), 1, GDT_Float64, 0, 0,
                                           nullptr) != CE_None)
      std::abort();
    for (const double sample : row) sum += sample;
  }
  return sum;
}

std::size_t count_of(GDALDataset& dataset) {
  std::size_t count = 0;
  for (int i = 0; i < dataset.GetLayerCount(); ++i)
    while (const auto feature = std::unique_ptr<OGRFeature>(dataset.GetLayer(i)->GetNextFeature()))
      count += feature->GetGeometryRef() != nullptr ? 1 : 0;
  return count;
}

void GridReadHere(benchmark::State& state) {
  for (auto _ : state) {
    const tiler::GdalErrors errors;
    benchmark::DoNotOptimize(sum_of(*tiler::open_raster_here(Files::get().grid(), errors)));
  }
}
void GridReadApart(benchmark::State& state) {
  for (auto _ : state) {
    const auto raster = tiler::read_raster_apart(
        Files::get().grid(), {.limits = tiler::limits_of_apart(tiler::kMostSamplesBytes)});
    benchmark::DoNotOptimize(sum_of(*tiler::dataset_of(raster)));
  }
}
void BuildingsReadHere(benchmark::State& state) {
  for (auto _ : state) {
    const tiler::GdalErrors errors;
    benchmark::DoNotOptimize(count_of(*tiler::open_vectors_here(Files::get().buildings(), errors)));
  }
}
void BuildingsReadApart(benchmark::State& state) {
  for (auto _ : state) {
    const auto features = tiler::read_features_apart(
        Files::get().buildings(), {.limits = tiler::limits_of_apart(tiler::kMostFeaturesBytes)});
    benchmark::DoNotOptimize(count_of(*tiler::dataset_of(features)));
  }
}

BENCHMARK(GridReadHere)->Unit(benchmark::kMillisecond)->Iterations(1)->UseRealTime();
BENCHMARK(GridReadApart)->Unit(benchmark::kMillisecond)->Iterations(1)->UseRealTime();
BENCHMARK(BuildingsReadHere)->Unit(benchmark::kMillisecond)->Iterations(1)->UseRealTime();
BENCHMARK(BuildingsReadApart)->Unit(benchmark::kMillisecond)->Iterations(1)->UseRealTime();

}  // namespace
}  // namespace terracast::bench
